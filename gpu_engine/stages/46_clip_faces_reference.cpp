// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "46_clip_faces_reference.h"

#include <algorithm>
#include <cstring>

#include "44_find_separating_axis_reference.h"

namespace btgpu {
namespace {

using namespace reference;

struct Box {
  Vec half, centre;  // the centre from A's
  Matrix rotation;
};

// The half space dot(normal, p) <= limit.
struct HalfSpace {
  Vec normal;
  double limit;
};

// Side k (0, 1, 2) of the box on the given side of its centre.
HalfSpace sideOf(const Box& box, int k, double sign) {
  const Vec normal = box.rotation.column(k) * sign;
  return {normal, dot(normal, box.centre) + box.half[k]};
}

struct Corner {
  Vec at;
  double sine = 1;  // CandidatePoint::sine
};

std::vector<Corner> clip(const std::vector<Corner>& polygon, const HalfSpace& space) {
  std::vector<Corner> kept;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec p = polygon[i].at, edge = polygon[(i + 1) % polygon.size()].at - p;
    const double above = dot(space.normal, p) - space.limit, rise = dot(space.normal, edge);
    if (above <= 0) kept.push_back(polygon[i]);
    if (above * (above + rise) < 0) kept.push_back({p - edge * (above / rise), std::fabs(rise) / length(edge)});
  }
  return kept;
}

// The face whose outward normal looks most against `direction`; its corners in turn.
std::vector<Corner> faceAgainst(const Box& box, Vec direction) {
  int face = 0;
  double sign = 1, least = INFINITY;
  for (int k = 0; k < 3; ++k) {
    for (const double s : {1.0, -1.0}) {
      const double facing = dot(box.rotation.column(k) * s, direction);
      if (facing >= least) continue;
      least = facing;
      face = k;
      sign = s;
    }
  }
  const int u = (face + 1) % 3, v = (face + 2) % 3;
  std::vector<Corner> corners;
  for (const auto& at : {std::pair<int, int>{1, 1}, {1, -1}, {-1, -1}, {-1, 1}}) {
    Vec p;
    p[face] = sign * box.half[face];
    p[u] = at.first * box.half[u];
    p[v] = at.second * box.half[v];
    corners.push_back({box.centre + box.rotation * p});
  }
  return corners;
}

// The incident face over the reference face.
struct FacePair {
  bool onA;  // the reference face is A's
  const Box &facing, &incident;
  int face;
  Vec outward;  // out of the reference face

  FacePair(const Box& a, const Box& b, int code, Vec aToB)
      : onA(code < 3),
        facing(onA ? a : b),
        incident(onA ? b : a),
        face(onA ? code : code - 3),
        outward(onA ? aToB : -aToB) {}

  std::vector<HalfSpace> sides() const {
    std::vector<HalfSpace> out;
    for (int k = 0; k < 3; ++k) {
      if (k == face) continue;
      for (const double sign : {1.0, -1.0}) out.push_back(sideOf(facing, k, sign));
    }
    return out;
  }
  CandidatePoint shown(const Corner& corner) const {
    const double distance = dot(outward, corner.at - facing.centre) - facing.half[face];
    return {onA ? corner.at : corner.at - outward * distance, distance, corner.sine};
  }
};

std::vector<CandidatePoint> clipFace(const FacePair& faces) {
  std::vector<Corner> polygon = faceAgainst(faces.incident, faces.outward);
  for (const HalfSpace& side : faces.sides()) polygon = clip(polygon, side);
  std::vector<CandidatePoint> points;
  for (const Corner& corner : polygon) points.push_back(faces.shown(corner));
  return points;
}

// Of the four edges of the box along its axis k, the midpoint of the one farthest along `direction`.
Vec supportingEdge(const Box& box, int k, Vec direction) {
  const int u = (k + 1) % 3, v = (k + 2) % 3;
  Vec best;
  double farthest = -INFINITY;
  for (const double su : {1.0, -1.0}) {
    for (const double sv : {1.0, -1.0}) {
      Vec p;
      p[u] = su * box.half[u];
      p[v] = sv * box.half[v];
      const Vec middle = box.centre + box.rotation * p;
      if (dot(direction, middle) <= farthest) continue;
      farthest = dot(direction, middle);
      best = middle;
    }
  }
  return best;
}

// Where the line through b along v comes nearest to the line through a along u.
Vec nearestOnSecond(Vec a, Vec u, Vec b, Vec v) {
  const Vec across = cross(u, v);
  // The plane that contains the first line and `across` cuts the second line there.
  const Vec plane = cross(u, across);
  return b + v * (dot(plane, a - b) / dot(plane, v));
}

struct BoxPair {
  Box a, b;
};

BoxPair boxesOf(const Shape& a, const BodyPose& poseA, const Shape& b, const BodyPose& poseB) {
  return {{toVec(a.extents), {}, rotationOf(poseA.orientation)},
          {toVec(b.extents), toVec(poseB.position) - toVec(poseA.position), rotationOf(poseB.orientation)}};
}

}  // namespace

std::vector<CandidatePoint> clipBoxesReference(const Shape& a, const BodyPose& poseA, const Shape& b,
                                               const BodyPose& poseB, const SeparatingAxis& axis) {
  const auto [boxA, boxB] = boxesOf(a, poseA, b, poseB);
  const Vec aToB = toVec(axis.normal);
  if (axis.code < 6) return clipFace(FacePair(boxA, boxB, axis.code, aToB));
  const int i = (axis.code - 6) / 3, j = (axis.code - 6) % 3;
  const Vec u = boxA.rotation.column(i), v = boxB.rotation.column(j);
  const Vec onB = nearestOnSecond(supportingEdge(boxA, i, aToB), u, supportingEdge(boxB, j, -aToB), v);
  return {{onB, -static_cast<double>(axis.normal.w), length(cross(u, v))}};
}

bool hasTwoFeatures(const BodyPose& poseA, const BodyPose& poseB, const SeparatingAxis& axis) {
  const Matrix ra = rotationOf(poseA.orientation), rb = rotationOf(poseB.orientation);
  const auto facing = [&](const Matrix& rotation, int k) {
    return std::fabs(dot(rotation.column(k), toVec(axis.normal)));
  };
  constexpr double kTie = 1e-5;
  if (axis.code >= 6) {
    const int i = (axis.code - 6) / 3, j = (axis.code - 6) % 3;
    for (int k = 0; k < 3; ++k) {
      if ((k != i && facing(ra, k) < kTie) || (k != j && facing(rb, k) < kTie)) return true;
    }
    return false;
  }
  const Matrix& incident = axis.code < 3 ? rb : ra;
  const double x = facing(incident, 0), y = facing(incident, 1), z = facing(incident, 2);
  const double largest = std::max({x, y, z});
  const double second = std::max({std::min(x, y), std::min(y, z), std::min(z, x)});
  return largest - second < kTie;
}

void clipFacesReference(const PairArrays& in, const std::vector<SeparatingAxis>& axes,
                        std::vector<RawContacts>& contacts) {
  for (uint position = 0; position < axes.size(); ++position) {
    if (axes[position].code < 0) continue;
    const uint i = in.items[in.bucketFirst[BUCKET_BOX_BOX] + position];
    const Pair& p = in.pairs[i];
    RawContacts raw{};
    raw.normal = toFloat4(-toVec(axes[position].normal));
    for (const CandidatePoint& point : clipBoxesReference(in.shapeOf(p.bodyA), in.poses[p.bodyA], in.shapeOf(p.bodyB),
                                                          in.poses[p.bodyB], axes[position])) {
      if (point.distance <= 0 && raw.count < RAW_POINTS) raw.points[raw.count++] = toFloat4(point.onB, point.distance);
    }
    contacts[i] = raw;
  }
}

// ---- the contract
namespace {

// Below this sine between two edges the kernel takes the middle of B's.
constexpr double kSineOfEdges = 0.0101;

// Ends of the incident face's edges that lie on a side of the reference face as far as rounding can tell: the kernel
// may cut the edge there, or, where all of the edge lies on the side, anywhere.
std::vector<CandidatePoint> possibleCuts(const FacePair& faces, double error) {
  std::vector<CandidatePoint> cuts;
  const std::vector<Corner> polygon = faceAgainst(faces.incident, faces.outward);
  for (size_t k = 0; k < polygon.size(); ++k) {
    const Vec p = polygon[k].at, q = polygon[(k + 1) % polygon.size()].at;
    for (const HalfSpace& side : faces.sides()) {
      const double atP = dot(side.normal, p) - side.limit, atQ = dot(side.normal, q) - side.limit;
      const double sine = std::fabs(atQ - atP) / std::max(length(q - p), 1e-30);
      if (std::fabs(atP) <= error) cuts.push_back(faces.shown({p, sine}));
      if (std::fabs(atQ) <= error) cuts.push_back(faces.shown({q, sine}));
    }
  }
  return cuts;
}

bool isSame(float4 point, const CandidatePoint& expected, const SeparatingAxis& axis, double size) {
  const double sine = axis.code < 6 ? expected.sine : expected.sine * expected.sine;
  const double error = kBoxTolerance * size / std::max(sine, 1e-30);
  return length(toVec(point) - expected.onB) <= error && std::fabs(point.w - expected.distance) <= error;
}

// How far the point is from the box's surface.
double offSurface(const Box& box, Vec at) {
  const Vec local = transposed(box.rotation) * (at - box.centre);
  double most = -INFINITY;
  for (int k = 0; k < 3; ++k) most = std::max(most, std::fabs(local[k]) - box.half[k]);
  return std::fabs(most);
}

// Well conditioned however flat the angles are: the point lies on B and, going along the normal by the distance, on A.
void checkOnBoxes(Contract& contract, const BoxPair& boxes, const SeparatingAxis& axis, float4 point, double size) {
  // The lines of two edges may meet beyond their ends.
  if (axis.code >= 6) return contract.same("depth at the edges", point.w, -axis.normal.w);
  contract.within("distance of a point", point.w, 0);
  const Vec onB = toVec(point), onA = onB - toVec(axis.normal) * point.w;
  contract.within("how far a point is from A's surface", offSurface(boxes.a, onA), kBoxTolerance * size);
  contract.within("how far a point is from B's surface", offSurface(boxes.b, onB), kBoxTolerance * size);
}

void checkClippedPair(Contract& contract, const PairArrays& in, const Pair& p, const SeparatingAxis& axis,
                      const RawContacts& raw) {
  const Shape &a = in.shapeOf(p.bodyA), &b = in.shapeOf(p.bodyB);
  const BodyPose &poseA = in.poses[p.bodyA], &poseB = in.poses[p.bodyB];
  contract.near("normal", raw.normal, toFloat4(-toVec(axis.normal)), 0);
  contract.same("w of the normal", raw.normal.w, 0);
  contract.require(raw.count >= 0 && raw.count <= RAW_POINTS, "count of points");
  if (axis.code >= 6) contract.same("count of points of two edges", raw.count, 1);
  if (!contract.ok()) return;
  const double size = boxPairSize(a, poseA, b, poseB);
  const BoxPair boxes = boxesOf(a, poseA, b, poseB);
  for (int k = 0; k < raw.count; ++k) checkOnBoxes(contract, boxes, axis, raw.points[k], size);
  if (hasTwoFeatures(poseA, poseB, axis)) return;

  const auto expected = clipBoxesReference(a, poseA, b, poseB, axis);
  if (axis.code >= 6 && expected[0].sine < kSineOfEdges) return;
  std::vector<CandidatePoint> cuts;
  if (axis.code < 6) {
    cuts = possibleCuts(FacePair(boxes.a, boxes.b, axis.code, toVec(axis.normal)), kBoxTolerance * size);
  }
  for (int k = 0; k < raw.count; ++k) {
    const auto isIt = [&](const CandidatePoint& e) { return isSame(raw.points[k], e, axis, size); };
    if (std::any_of(expected.begin(), expected.end(), isIt) || std::any_of(cuts.begin(), cuts.end(), isIt)) continue;
    double off = INFINITY;
    for (const CandidatePoint& e : expected) off = std::min(off, length(toVec(raw.points[k]) - e.onB));
    contract.within("how far a point is from the next corner of the clipped face", off, kBoxTolerance * size);
  }
  for (const CandidatePoint& e : expected) {
    const double error = kBoxTolerance * size / std::max(e.sine, 1e-30);
    const bool found =
        std::any_of(raw.points, raw.points + raw.count, [&](float4 point) { return isSame(point, e, axis, size); });
    if (!found) contract.within("depth of a corner that is missing", -e.distance, error);
  }
}

}  // namespace

void checkClippedFaces(Contract& contract, const PairArrays& in, const std::vector<SeparatingAxis>& axes,
                       const std::vector<RawContacts>& before, const std::vector<RawContacts>& device) {
  std::vector<bool> written(in.pairs.size(), false);
  for (uint position = 0; position < axes.size(); ++position) {
    if (axes[position].code < 0) continue;
    const uint i = in.items[in.bucketFirst[BUCKET_BOX_BOX] + position];
    const Pair& p = in.pairs[i];
    written[i] = true;
    contract.at("pair {} (bodies {} and {}), position {}", i, p.bodyA, p.bodyB, position);
    checkClippedPair(contract, in, p, axes[position], device[i]);
  }
  for (size_t i = 0; i < in.pairs.size(); ++i) {
    contract.at("pair {}, which does not overlap", i);
    contract.require(written[i] || std::memcmp(&device[i], &before[i], sizeof(RawContacts)) == 0, "its candidates");
  }
}

}  // namespace btgpu
