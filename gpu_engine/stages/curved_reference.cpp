// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "curved_reference.h"

#include <algorithm>

namespace btgpu {
namespace {

using namespace reference;

Vec unitOf(Vec v) { return v / length(v); }

std::vector<Vec> directionsAllAround(int count) {
  std::vector<Vec> out;
  for (int i = 0; i < count; ++i) {
    // Along a spiral, evenly spread.
    const double y = 1 - 2 * (i + 0.5) / count, r = std::sqrt(1 - y * y), angle = 2.399963229728653 * i;
    out.push_back({r * std::cos(angle), y, r * std::sin(angle)});
  }
  return out;
}

double along(double extent, double d) { return d < 0 ? -extent : extent; }

Vec roundSupport(const Shape& s, Vec d) {
  Vec across = d;
  across[s.variant] = 0;
  const double size = length(across);
  Vec rim = size > 0 ? across * (s.radius / size) : Vec{};
  Vec tip;
  tip[s.variant] = s.halfLength;
  if (s.type == SHAPE_CYLINDER) {
    rim[s.variant] = along(s.halfLength, d[s.variant]);
    return rim;
  }
  rim = rim - tip;
  return dot(tip, d) > dot(rim, d) ? tip : rim;
}

Vec vertexAt(const HullArrays& hulls, const Shape& s, int i) {
  return toVec(hulls.vertices[static_cast<size_t>(s.firstVertex) + static_cast<size_t>(i)]);
}

Vec spheresSupport(const Shape& s, const HullArrays& hulls, Vec d) {
  const Vec stretch = vertexAt(hulls, s, s.vertexCount);
  Vec stretched{stretch.x * d.x, stretch.y * d.y, stretch.z * d.z};
  const double size = length(stretched);
  const Vec outward{stretch.x * stretched.x / size, stretch.y * stretched.y / size, stretch.z * stretched.z / size};
  Vec best;
  double farthest = -INFINITY;
  for (int i = 0; i < s.vertexCount; ++i) {
    const double radius = hulls.vertices[static_cast<size_t>(s.firstVertex) + static_cast<size_t>(i)].w;
    const Vec p = vertexAt(hulls, s, i) + outward * radius;
    if (dot(p, d) <= farthest) continue;
    farthest = dot(p, d);
    best = p;
  }
  return best;
}

Vec coreExtents(const Shape& s, double margin) {
  const Vec half = toVec(s.extents);
  if (s.type == SHAPE_SPHERE) return {};
  if (s.type != SHAPE_BOX) return half;
  return {std::max(half.x - margin, 0.0), std::max(half.y - margin, 0.0), std::max(half.z - margin, 0.0)};
}

Vec sumSupport(const Shape& s, const HullArrays& hulls, Vec d) {
  Vec sum = vertexAt(hulls, s, 0);
  for (int i = 1; i < s.vertexCount;) {
    const float4* head = &hulls.vertices[static_cast<size_t>(s.firstVertex) + static_cast<size_t>(i)];
    const Matrix turn = rotationOf(head[0]);
    const Vec inTerm = transposed(turn) * d;
    Shape term{};
    term.type = static_cast<int>(head[1].x);
    i += SUM_HEAD;
    if (term.type == SHAPE_MULTI_SPHERE) {
      term.firstVertex = s.firstVertex + i;
      term.vertexCount = static_cast<int>(head[1].y);
      sum = sum + turn * spheresSupport(term, hulls, inTerm);
      i += term.vertexCount + 1;
    } else {
      term.variant = static_cast<int>(head[1].y);
      term.radius = head[1].z;
      term.halfLength = head[1].w;
      sum = sum + turn * roundSupport(term, inTerm);
    }
  }
  return sum;
}

Vec localSupport(const Shape& s, const HullArrays& hulls, double margin, Vec d) {
  if (s.type == SHAPE_CYLINDER || s.type == SHAPE_CONE) return roundSupport(s, d);
  if (s.type == SHAPE_MULTI_SPHERE) return spheresSupport(s, hulls, d);
  if (s.type == SHAPE_SUM) return sumSupport(s, hulls, d);
  if (s.type != SHAPE_HULL) {
    const Vec half = coreExtents(s, margin);
    return {along(half.x, d.x), along(half.y, d.y), along(half.z, d.z)};
  }
  Vec best = vertexAt(hulls, s, 0);
  for (int i = 1; i < s.vertexCount; ++i) {
    if (dot(vertexAt(hulls, s, i), d) > dot(best, d)) best = vertexAt(hulls, s, i);
  }
  return best;
}

double outsideCylinder(const Shape& s, Vec p) {
  const double axial = std::fabs(p[s.variant]) - s.halfLength;
  Vec across = p;
  across[s.variant] = 0;
  return std::hypot(std::max(axial, 0.0), std::max(length(across) - s.radius, 0.0));
}

// Outside of the base or of the side, whichever is more: at most the distance.
double outsideCone(const Shape& s, Vec p) {
  const double sign = s.halfLength < 0 ? -1 : 1, height = 2 * std::fabs(s.halfLength), up = p[s.variant] * sign;
  Vec across = p;
  across[s.variant] = 0;
  const double slant = std::hypot(height, double(s.radius));
  const double side = slant > 0 ? (length(across) * height + (up - height / 2) * s.radius) / slant : length(across);
  return std::max({0.0, -up - height / 2, up - height / 2, side});
}

}  // namespace

bool isCurved(const Shape& shape) { return shape.type >= SHAPE_CYLINDER && shape.type <= SHAPE_SUM; }

Vec PlacedCore::support(Vec direction) const {
  return position + rotation * localSupport(*shape, *hulls, margin, transposed(rotation) * direction);
}

double PlacedCore::distanceTo(Vec point) const {
  const Vec p = transposed(rotation) * (point - position);
  if (shape->type == SHAPE_CYLINDER) return outsideCylinder(*shape, p);
  if (shape->type == SHAPE_CONE) return outsideCone(*shape, p);
  double most = 0;
  if (shape->type == SHAPE_HULL) {
    for (int f = 0; f < shape->faceCount; ++f) {
      const float4 plane = hulls->faces[static_cast<size_t>(shape->firstFace) + static_cast<size_t>(f)].plane;
      most = std::max(most, dot(toVec(plane), p) - plane.w);
    }
    return most;
  }
  if (shape->type != SHAPE_MULTI_SPHERE && shape->type != SHAPE_SUM) {
    const Vec half = coreExtents(*shape, margin);
    for (int k = 0; k < 3; ++k) most = std::max(most, std::fabs(p[k]) - half[k]);
    return most;
  }
  static const std::vector<Vec> kAllAround = directionsAllAround(500);
  for (const Vec d : kAllAround) most = std::max(most, dot(d, p - localSupport(*shape, *hulls, margin, d)));
  return most;
}

CurvedPair curvedPairOf(const PairArrays& in, const Pair& pair) {
  const Shape &a = in.shapeOf(pair.bodyA), &b = in.shapeOf(pair.bodyB);
  CurvedPair c;
  c.a = {&a, &in.hulls, rotationOf(in.poses[pair.bodyA].orientation), {}, a.margin};
  c.b = {&b, &in.hulls, rotationOf(in.poses[pair.bodyB].orientation), in.bFromA(pair), b.margin};
  c.size = length(toVec(a.extents)) + length(toVec(b.extents)) + length(toVec(a.centre)) + length(toVec(b.centre));
  c.margins = double(a.margin) + b.margin;
  c.threshold = in.thresholdOf(pair);
  return c;
}

double gapAlong(const CurvedPair& pair, Vec axis) {
  return dot(axis, pair.b.support(-axis)) - dot(axis, pair.a.support(axis));
}

namespace {

const std::vector<Vec>& allAround() {
  static const std::vector<Vec> directions = directionsAllAround(2000);
  return directions;
}

}  // namespace

bool areFartherApart(const CurvedPair& pair, double than) {
  const Vec apart = pair.b.position - pair.a.position;
  if (length(apart) > 0 && gapAlong(pair, unitOf(apart)) > than) return true;
  const auto isAlong = [&](Vec axis) { return gapAlong(pair, axis) > than; };
  return std::any_of(allAround().begin(), allAround().end(), isAlong);
}

WidestGap widestGapReference(const CurvedPair& pair) {
  std::vector<WidestGap> best;
  const auto look = [&](Vec axis) { best.push_back({axis, gapAlong(pair, axis)}); };
  for (const Vec axis : allAround()) look(axis);
  for (int k = 0; k < 3; ++k) {
    for (const double sign : {1.0, -1.0}) {
      look(pair.a.rotation.column(k) * sign);
      look(pair.b.rotation.column(k) * sign);
    }
  }
  for (const PlacedCore* core : {&pair.a, &pair.b}) {
    for (int f = 0; core->shape->type == SHAPE_HULL && f < core->shape->faceCount; ++f) {
      const Vec normal =
          unitOf(core->rotation *
                 toVec(core->hulls->faces[static_cast<size_t>(core->shape->firstFace) + static_cast<size_t>(f)].plane));
      look(core == &pair.a ? normal : -normal);
    }
  }
  const auto wider = [](const WidestGap& p, const WidestGap& q) { return p.gap > q.gap; };
  constexpr size_t kRefined = 12;
  std::partial_sort(best.begin(), best.begin() + kRefined, best.end(), wider);
  best.resize(kRefined);
  for (WidestGap& g : best) {
    // Eight steps to the sides, shorter and shorter.
    for (double step = 0.05; step > 1e-9;) {
      const Vec u = unitOf(cross(g.axis, std::fabs(g.axis.x) < 0.6 ? Vec{1, 0, 0} : Vec{0, 1, 0})),
                v = cross(g.axis, u);
      bool found = false;
      for (int k = 0; k < 8; ++k) {
        const double angle = 0.7853981633974483 * k;
        const Vec axis = unitOf(g.axis + (u * std::cos(angle) + v * std::sin(angle)) * step);
        const double gap = gapAlong(pair, axis);
        if (gap <= g.gap) continue;
        g = {axis, gap};
        found = true;
      }
      if (!found) step *= 0.5;
    }
  }
  return *std::min_element(best.begin(), best.end(), wider);
}

ClosestFeatures curvedFeaturesReference(const PairArrays& in, const Pair& pair) {
  const CurvedPair c = curvedPairOf(in, pair);
  const WidestGap w = widestGapReference(c);
  const Matrix toA = transposed(c.a.rotation);
  const Vec onA = c.a.support(w.axis);
  return {toFloat4(toA * w.axis, w.gap), toFloat4(toA * onA), toFloat4(toA * (onA + w.axis * w.gap))};
}

// Errors: the device ends its searches at 1e-6 of the squared distance (5e-7 of the distance), at 1e-5 of the smaller
// core where they overlap, and takes a flat face's axis within 1e-5 of the size; nearer than 1e-5 of the size cores
// count as touching, and their centres' distance rounds too.
void checkCurvedFeatures(Contract& contract, const PairArrays& in, const Pair& pair, const ClosestFeatures& device) {
  const CurvedPair c = curvedPairOf(in, pair);
  const double reach = c.size + length(in.bFromA(pair)), slack = 3e-5 * reach;
  const Vec axis = c.a.rotation * toVec(device.normal), onA = c.a.rotation * toVec(device.onA),
            onB = c.a.rotation * toVec(device.onB);
  const double gap = device.normal.w;
  contract.near("length of the normal", length(axis), 1, 1e-5);
  if (!contract.ok()) return;
  // The search for the closest points is over when the squared distance is known to 1e-6, or in float no better.
  const double turned = gap > 0 ? 2e-3 * gap : 0;
  contract.near("separation along the normal", gapAlong(c, unitOf(axis)), gap, slack + turned);
  contract.within("how far the point on A is from its core", c.a.distanceTo(onA), slack);
  contract.within("how far the point on B is from its core", c.b.distanceTo(onB), slack + turned);
  if (gap > 2 * slack) {
    contract.near("distance of the points", length(onB - onA), gap, slack + turned);
    return;
  }
  contract.within("how much shorter the way out could be", widestGapReference(c).gap - gap, slack);
}

RawContacts curvedContactsReference(const PairArrays& in, const Pair& pair, const ClosestFeatures& found) {
  const CurvedPair c = curvedPairOf(in, pair);
  const Vec axis = c.a.rotation * toVec(found.normal), onB = c.a.rotation * toVec(found.onB);
  RawContacts raw{};
  raw.normal = toFloat4(-axis);
  const double distance = found.normal.w - c.margins;
  if (distance < c.threshold) raw.points[raw.count++] = toFloat4(onB - axis * c.b.margin, distance);
  return raw;
}

void checkCurvedContacts(Contract& contract, const PairArrays& in, const Pair& pair, const ClosestFeatures& found,
                         const RawContacts& device) {
  const CurvedPair c = curvedPairOf(in, pair);
  // Of a point: its rounding, and where faces nearly across the axis are cut.
  const double reach = c.size + length(in.bFromA(pair)), slack = 5e-5 * reach;
  const Vec axis = c.a.rotation * toVec(found.normal);
  const double closest = found.normal.w - c.margins;
  contract.near("normal", device.normal, toFloat4(-axis), 1e-6);
  contract.require(device.count >= 0 && device.count <= MANIFOLD_POINTS, "count of points");
  if (!contract.ok()) return;
  if (device.count == 0) return contract.within("how deep the missing point is", c.threshold - closest, slack);
  contract.near("depth of the last point", device.points[device.count - 1].w, closest, slack);
  for (int k = 0; k < device.count; ++k) {
    const Vec onB = toVec(device.points[k]) + axis * c.b.margin, onA = onB - axis * (device.points[k].w + c.margins);
    contract.within("how far apart a point is", device.points[k].w - c.threshold, slack);
    // The closest point is stage 44's; along a flat face's axis, which it may have taken, A's lies elsewhere.
    if (length(onB - c.a.rotation * toVec(found.onB)) <= slack) continue;
    contract.within("how far a point is from B's core", c.b.distanceTo(onB), slack);
    contract.within("how far a point is from A's core", c.a.distanceTo(onA), slack);
  }
}

namespace {

struct PlaneView {
  Vec normal;
  double constant;  // from A's position
};

PlaneView planeOf(const PairArrays& in, const Pair& pair) {
  const Shape& plane = in.shapeOf(pair.bodyB);
  const Vec normal = rotationOf(in.poses[pair.bodyB].orientation) * toVec(plane.extents);
  return {normal, plane.extents.w + dot(normal, in.bFromA(pair))};
}

PlacedCore coreOnPlane(const PairArrays& in, const Pair& pair) {
  const Shape& a = in.shapeOf(pair.bodyA);
  return {&a, &in.hulls, rotationOf(in.poses[pair.bodyA].orientation), {}, a.margin};
}

}  // namespace

RawContacts curvedPlaneReference(const PairArrays& in, const Pair& pair) {
  const PlacedCore core = coreOnPlane(in, pair);
  const PlaneView plane = planeOf(in, pair);
  const Vec lowest = core.support(-plane.normal);
  const double distance = dot(plane.normal, lowest) - plane.constant - core.margin;
  RawContacts raw{};
  raw.normal = toFloat4(plane.normal);
  if (distance < in.thresholdOf(pair)) {
    raw.points[raw.count++] = toFloat4(lowest - plane.normal * (distance + core.margin), distance);
  }
  return raw;
}

void checkCurvedPlane(Contract& contract, const PairArrays& in, const Pair& pair, const RawContacts& device) {
  const PlacedCore core = coreOnPlane(in, pair);
  const PlaneView plane = planeOf(in, pair);
  const Shape& shape = *core.shape;
  const double size = length(toVec(shape.extents)) + length(toVec(shape.centre));
  // As for the other shapes on a plane; and of points as deep within 1e-5 of the size any may be the last.
  const double error = 2e-6 * (size + length(in.bFromA(pair)) + std::fabs(double(in.shapeOf(pair.bodyB).extents.w)));
  const double lowest = dot(plane.normal, core.support(-plane.normal)) - plane.constant - core.margin;
  const double threshold = in.thresholdOf(pair);
  contract.require(device.count >= 0 && device.count <= MANIFOLD_POINTS, "count of points");
  if (!contract.ok()) return;
  if (device.count == 0) return contract.within("how deep the missing point is", threshold - lowest, error);
  contract.near("normal", device.normal, toFloat4(plane.normal), 1e-6);
  contract.near("depth of the last point", device.points[device.count - 1].w, lowest, error + 1e-5 * size);
  for (int k = 0; k < device.count; ++k) {
    const Vec onPlane = toVec(device.points[k]), inCore = onPlane + plane.normal * (device.points[k].w + core.margin);
    contract.near("height of a point over the plane", dot(plane.normal, onPlane), plane.constant, error);
    contract.within("how far apart a point is", device.points[k].w - threshold, error);
    contract.within("how far a point is from the core", core.distanceTo(inCore), error);
  }
}

}  // namespace btgpu
