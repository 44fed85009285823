// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "46_clip_convex_faces_reference.h"

#include <algorithm>
#include <cstring>

#include "curved_reference.h"
#include "pick_points_reference.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kFaceAlongAxis = 0.995;  // FACE_ALONG_AXIS

// A polygon, segment or point, and its plane.
struct Patch {
  std::vector<Vec> corners;
  Vec normal;
  bool isFace = false;
};

Patch patchOf(const Polytope& p, const Polytope::Face& face) {
  Patch patch;
  for (const size_t c : face.corners) patch.corners.push_back(p.vertices[c]);
  patch.normal = face.normal;
  patch.isFace = face.corners.size() > 2;
  return patch;
}

// The faces that look most along the direction, equally much within `tie`, the first one of those that do so most
// first; of a segment itself, or its end where that is what a box as thin as it would show there.
std::vector<Patch> patchesAlong(const Polytope& p, Vec direction, double tie) {
  if (p.faces.empty()) {
    const Vec line = p.vertices.back() - p.vertices.front();
    const double along = dot(line, direction), share = std::fabs(along) / std::max(length(line), 1e-30);
    std::vector<Patch> patches;
    // Of such a box, the face along the line looks most along the direction at angles from 45 to 55 degrees on.
    if (share < 0.7072) patches.push_back({p.vertices, direction});
    if (share > 0.577) patches.push_back({{along > 0 ? p.vertices.back() : p.vertices.front()}, direction});
    return patches;
  }
  const Polytope::Face* best = &p.faces[0];
  for (const auto& f : p.faces) {
    if (dot(f.normal, direction) > dot(best->normal, direction)) best = &f;
  }
  std::vector<Patch> patches{patchOf(p, *best)};
  for (const auto& f : p.faces) {
    if (&f != best && dot(f.normal, direction) >= dot(best->normal, direction) - tie) patches.push_back(patchOf(p, f));
  }
  return patches;
}

// What of the polygon lies within the sides of the face, seen along the axis (Sutherland and Hodgman).
std::vector<Vec> clip(std::vector<Vec> polygon, const Patch& face, Vec axis) {
  Vec middle;
  for (const Vec c : face.corners) middle = middle + c / static_cast<double>(face.corners.size());
  for (size_t k = 0; k < face.corners.size(); ++k) {
    const Vec at = face.corners[k];
    Vec outward = cross(face.corners[(k + 1) % face.corners.size()] - at, axis);
    if (dot(outward, middle - at) > 0) outward = -outward;
    std::vector<Vec> kept;
    for (size_t i = 0; i < polygon.size(); ++i) {
      const Vec p = polygon[i], q = polygon[(i + 1) % polygon.size()];
      const double above = dot(outward, p - at), next = dot(outward, q - at);
      if (above <= 0) kept.push_back(p);
      if (above * next < 0) kept.push_back(p + (q - p) * (above / (above - next)));
    }
    polygon = kept;
  }
  return polygon;
}

double facingOf(const Patch& patch, Vec axis) { return patch.isFace ? std::fabs(dot(patch.normal, axis)) : 0; }

std::vector<RegionCorner> regionCorners(const Patch& onA, const Patch& onB, Vec axis) {
  const bool byA = facingOf(onA, axis) >= facingOf(onB, axis);
  const Patch &sides = byA ? onA : onB, &other = byA ? onB : onA;
  std::vector<RegionCorner> corners;
  for (const Vec p : clip(other.corners, sides, axis)) {
    const double along = dot(sides.normal, sides.corners[0] - p) / dot(sides.normal, axis);
    if (byA) {
      corners.push_back({p, -along});
    } else {
      corners.push_back({p + axis * along, along});
    }
  }
  return corners;
}

bool isPoint(const Polytope& core) {
  // A box as thin as its margin too, but not a hull that is a point.
  return core.faces.empty()
             ? core.vertices.size() == 1
             : !core.hasVolume && core.vertices.size() == 8 && length(core.vertices[7] - core.vertices[0]) == 0;
}

// What stage 44 found of a pair, in world axes.
struct Found {
  Vec axis, onB;
  double separation;
};

Found foundOf(const PlacedCores& c, const ClosestFeatures& f) {
  return {c.rotationA * toVec(f.normal), c.rotationA * toVec(f.onB), f.normal.w};
}

}  // namespace

std::vector<RegionCorner> regionCornersReference(const Polytope& a, const Polytope& b, Vec axis, double cosine) {
  const Patch onA = patchesAlong(a, axis, 0)[0], onB = patchesAlong(b, -axis, 0)[0];
  if (std::max(facingOf(onA, axis), facingOf(onB, axis)) < cosine) return {};
  return regionCorners(onA, onB, axis);
}

void clipConvexFacesReference(const PairArrays& in, const ClosestPairs& found, std::vector<RawContacts>& contacts) {
  CorePlacer placer(in);
  for (const uint position : found.near) {
    const uint i = in.items[in.bucketFirst[BUCKET_FIRST_CONVEX] + position];
    if (in.pairs[i].bucket == BUCKET_CURVED) {
      contacts[i] = curvedContactsReference(in, in.pairs[i], found.closest[position]);
      continue;
    }
    const PlacedCores c = placer.place(in.pairs[i]);
    const auto [axis, onB, separation] = foundOf(c, found.closest[position]);
    const double marginB = c.marginB;
    std::vector<PickCandidate> candidates;
    if (!isPoint(c.a) && !isPoint(c.b)) {
      for (const RegionCorner& corner : regionCornersReference(c.a, c.b, axis, kFaceAlongAxis)) {
        candidates.push_back({corner.onB, corner.gap - c.margins});
      }
    }
    // Where no corner of the region is as deep, the closest points are none of it.
    const double deepest = separation - c.margins + 2e-5 * c.size;
    if (std::none_of(candidates.begin(), candidates.end(),
                     [&](const PickCandidate& q) { return q.distance <= deepest; })) {
      candidates.push_back({onB, separation - c.margins});
    }
    RawContacts raw{};
    raw.normal = toFloat4(-axis);
    for (const PickCandidate& p : pickPointsReference({axis, c.threshold, 0, c.threshold}, candidates)) {
      raw.points[raw.count++] = toFloat4(p.at - axis * marginB, p.distance);
    }
    contacts[i] = raw;
  }
}

// ---- the contract
namespace {

constexpr double kRounding = 2e-6;
constexpr double kSeenFromTheSide = 2e-3;  // cosine; the kernel's FACE_ACROSS_AXIS, with what rounding makes of it

// Directions of the patch's sides, seen along the axis, that come within `reach` of the point. A segment is one side.
std::vector<Vec> sidesNear(const Patch& patch, Vec at, Vec axis, double reach) {
  const auto flat = [&](Vec v) { return v - axis * dot(axis, v); };
  std::vector<Vec> sides;
  const size_t count = patch.corners.size(), sideCount = count > 2 ? count : count - 1;
  for (size_t k = 0; k < sideCount; ++k) {
    const Vec from = patch.corners[k], line = flat(patch.corners[(k + 1) % count] - from);
    const double size = length(line);
    if (size > 0 && length(cross(line / size, flat(at - from))) <= reach) sides.push_back(line / size);
  }
  return sides;
}

// How far off a corner of the region may be: two sides cross there, or a corner of the one lies within the other.
double cornerError(const Patch& onA, const Patch& onB, Vec at, Vec axis, double error) {
  const auto ofA = sidesNear(onA, at, axis, 2 * error), ofB = sidesNear(onB, at, axis, 2 * error);
  if (ofA.empty() || ofB.empty()) return error;
  if (ofA.size() > 1 && ofB.size() > 1) return INFINITY;
  double sine = 0;
  for (const Vec u : ofA) {
    for (const Vec v : ofB) sine = std::max(sine, length(cross(u, v)));
  }
  return sine > 0 ? error / sine : INFINITY;
}

double distanceToSegment(Vec p, Vec a, Vec b) {
  const Vec d = b - a;
  const double lengthSqr = dot(d, d);
  return length(p - a - d * (lengthSqr > 0 ? std::clamp(dot(p - a, d) / lengthSqr, 0.0, 1.0) : 0));
}

double offPatch(const Patch& patch, Vec p) {
  double least = INFINITY;
  bool inside = patch.isFace;
  Vec middle;
  for (const Vec c : patch.corners) middle = middle + c / static_cast<double>(patch.corners.size());
  for (size_t k = 0; k < patch.corners.size(); ++k) {
    const Vec from = patch.corners[k], to = patch.corners[(k + 1) % patch.corners.size()];
    least = std::min(least, distanceToSegment(p, from, to));
    const Vec inward = cross(patch.normal, to - from);
    if (dot(inward, p - from) * dot(inward, middle - from) < 0) inside = false;
  }
  return inside ? std::fabs(dot(patch.normal, p - patch.corners[0])) : least;
}

// A pair as it is checked. `picked`: the device's points on B's core.
struct ConvexPair {
  const PlacedCores& cores;
  Found found;
  std::vector<PickCandidate> picked;
  double error;
};

void checkClosestPointOnly(Contract& contract, const ConvexPair& p) {
  const double distance = p.found.separation - p.cores.margins;
  if (p.picked.empty()) {
    return contract.within("how deep the missing point is", p.cores.threshold - distance, p.error);
  }
  contract.same("count of points", static_cast<double>(p.picked.size()), 1);
  contract.near("distance", p.picked[0].distance, distance, p.error);
  contract.near("closest point", toFloat4(p.picked[0].at), toFloat4(p.found.onB), p.error);
}

void checkRegion(Contract& contract, const ConvexPair& p, const Patch& onA, const Patch& onB) {
  const Vec axis = p.found.axis;
  const double margins = p.cores.margins;
  for (const PickCandidate& q : p.picked) {
    const double closest = std::max(length(q.at - p.found.onB), std::fabs(q.distance + margins - p.found.separation));
    if (closest <= p.error) continue;
    contract.within("how far a point is from B's face", offPatch(onB, q.at), p.error);
    contract.within("how far a point is from A's face", offPatch(onA, q.at - axis * (q.distance + margins)), p.error);
  }
  // Faces seen from the side know depths less well.
  double facing = 1;
  for (const Patch* patch : {&onA, &onB}) facing = patch->isFace ? std::min(facing, facingOf(*patch, axis)) : facing;
  const double depthError = p.error / std::max(facing, kSeenFromTheSide);
  if (p.picked.empty()) {
    contract.within("how deep the missing points are", p.cores.threshold + margins - p.found.separation, depthError);
  } else {
    const double least = separationAlong(p.cores.a, p.cores.b, axis), deepest = p.picked.back().distance + margins;
    contract.within("how much less deep the last point is than the overlap", deepest - p.found.separation,
                    2 * p.cores.depthSlack + p.error);
    contract.within("how much deeper the last point is than the overlap", std::min(least, p.found.separation) - deepest,
                    depthError);
  }
  std::vector<PickCandidate> candidates;
  if (facing > kSeenFromTheSide) {
    for (const RegionCorner& corner : regionCorners(onA, onB, axis)) {
      const double error = std::max(cornerError(onA, onB, corner.onB, axis, p.error), depthError);
      candidates.push_back({corner.onB, corner.gap - margins, error});
    }
  }
  checkPickedPoints(contract, {axis, p.cores.threshold, p.cores.depthSlack, p.cores.threshold}, candidates, p.picked,
                    depthError);
}

// Where rounding decides which faces look most along the axis, or whether they do so enough, either will do. Of what
// holds for none, the first one speaks.
void checkConvexPair(Contract& contract, const ConvexPair& p, const Contract& start) {
  constexpr double kTie = 2e-6;
  std::optional<Contract> first;
  const auto isRight = [&](const auto& check) {
    Contract c = start;
    check(c);
    if (!first) first = c;
    return c.ok();
  };
  const auto closestOnly = [&](Contract& c) { checkClosestPointOnly(c, p); };
  bool alone = isPoint(p.cores.a) || isPoint(p.cores.b);
  if (!alone) {
    for (const Patch& onA : patchesAlong(p.cores.a, p.found.axis, kTie)) {
      for (const Patch& onB : patchesAlong(p.cores.b, -p.found.axis, kTie)) {
        const double facing = std::max(facingOf(onA, p.found.axis), facingOf(onB, p.found.axis));
        if (facing < kFaceAlongAxis + kTie) alone = true;
        if (facing > kFaceAlongAxis - kTie && isRight([&](Contract& c) { checkRegion(c, p, onA, onB); })) return;
      }
    }
  }
  if (alone && isRight(closestOnly)) return;
  contract = *first;
}

}  // namespace

void checkClippedConvexFaces(Contract& contract, const PairArrays& in, const ClosestPairs& found,
                             const std::vector<RawContacts>& before, const std::vector<RawContacts>& device) {
  CorePlacer placer(in);
  std::vector<bool> written(in.pairs.size(), false);
  for (const uint position : found.near) {
    if (!contract.ok()) return;
    const uint i = in.items[in.bucketFirst[BUCKET_FIRST_CONVEX] + position];
    const Pair& pair = in.pairs[i];
    const RawContacts& raw = device[i];
    written[i] = true;
    contract.at("pair {} (bodies {} and {}), position {}", i, pair.bodyA, pair.bodyB, position);
    contract.require(raw.count >= 0 && raw.count <= 4, "count of points");
    if (!contract.ok()) return;
    if (pair.bucket == BUCKET_CURVED) {
      checkCurvedContacts(contract, in, pair, found.closest[position], raw);
      continue;
    }
    const PlacedCores c = placer.place(pair);
    ConvexPair p{c, foundOf(c, found.closest[position]), {}, kRounding * c.reach};
    // A rotated vector: some five roundings.
    contract.near("normal", raw.normal, toFloat4(-p.found.axis), 1e-6);
    contract.same("w of the normal", raw.normal.w, 0);
    for (int k = 0; k < raw.count; ++k) {
      const Vec inCore = p.found.axis * c.marginB;
      p.picked.push_back({toVec(raw.points[k]) + inCore, raw.points[k].w});
    }
    if (contract.ok()) checkConvexPair(contract, p, Contract(contract));
  }
  for (size_t i = 0; i < in.pairs.size(); ++i) {
    contract.at("pair {}, which is not listed", i);
    contract.require(written[i] || std::memcmp(&device[i], &before[i], sizeof(RawContacts)) == 0, "its candidates");
  }
}

}  // namespace btgpu
