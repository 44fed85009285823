// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "40_cull_triangles_reference.h"

#include "shape_bounds.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kRounding = 1e-5;

// Of shape A in B's axes: Bullet's getAabb of the relative transform, grown by the mesh's margin.
struct BoundsInMesh : Bounds {
  double error;
};

BoundsInMesh boundsInMesh(const TriangleInput& in, const Pair& p) {
  const Shape &a = in.arrays.shapeOf(p.bodyA), &b = in.arrays.shapeOf(p.bodyB);
  const Matrix toMesh = transposed(rotationOf(in.arrays.poses[p.bodyB].orientation));
  const Matrix turn = toMesh * rotationOf(in.arrays.poses[p.bodyA].orientation);
  const Vec centre = toMesh * -in.arrays.bFromA(p);
  const Bounds box = shapeBounds(a, centre, turn, in.arrays.hulls.vertices);
  const Vec by{b.margin, b.margin, b.margin};
  return {{box.lower - by, box.upper + by}, kRounding * (length(centre) + length(box.upper - box.lower))};
}

// How far the two boxes are apart along the axis where they are most; negative: overlap.
double gapTo(const BoundsInMesh& box, const MeshTriangle& t) {
  const Vec a = toVec(t.a), b = toVec(t.b), c = toVec(t.c);
  double gap = -INFINITY;
  for (int k = 0; k < 3; ++k) {
    const double lower = std::min({a[k], b[k], c[k]}), upper = std::max({a[k], b[k], c[k]});
    gap = std::max({gap, lower - box.upper[k], box.lower[k] - upper});
  }
  return gap;
}

}  // namespace

TriangleHits cullTrianglesReference(const TriangleInput& in) {
  TriangleHits out{1, {}, {}, {}};
  for (uint k = 0; k < in.pairCount(); ++k) {
    const BoundsInMesh box = boundsInMesh(in, in.pair(k));
    const auto first = static_cast<uint>(in.meshOf(k).firstTriangle);
    out.first.push_back(static_cast<uint>(out.hits.size()));
    for (uint t = first; t < first + static_cast<uint>(in.meshOf(k).triangleCount); ++t) {
      if (gapTo(box, in.meshes.triangles[t]) <= 0) out.hits.push_back({k, t});
    }
    out.found.push_back(static_cast<uint>(out.hits.size()) - out.first.back());
  }
  return out;
}

void checkTriangleHits(Contract& contract, const TriangleInput& in, const TriangleHits& device, uint counted) {
  contract.same("triangles counted", counted, static_cast<double>(device.hits.size()));
  size_t at = 0;
  for (uint k = 0; k < in.pairCount() && contract.ok(); ++k) {
    const Pair& p = in.pair(k);
    contract.at("pair of bodies {} and {}, position {}", p.bodyA, p.bodyB, k);
    const size_t search = size_t{k} * device.groups;
    contract.same("first triangle", device.first[search], static_cast<double>(at));
    size_t end = at;
    for (uint group = 0; group < device.groups; ++group) end += device.found[search + group];
    contract.require(end <= device.hits.size(), "no more triangles than there are");
    const BoundsInMesh box = boundsInMesh(in, p);
    const auto first = static_cast<uint>(in.meshOf(k).firstTriangle);
    for (uint t = first; t < first + static_cast<uint>(in.meshOf(k).triangleCount) && contract.ok(); ++t) {
      const double gap = gapTo(box, in.meshes.triangles[t]);
      const bool there = at < end && device.hits[at].triangle == t && device.hits[at].pair == k;
      at += there;
      if (there) {
        contract.within("how far a triangle of the list is away", gap, box.error);
      } else {
        contract.within("how far a triangle overlaps that is not in the list", -gap, box.error);
      }
    }
    contract.same("triangles in order", static_cast<double>(at), static_cast<double>(end));
  }
  contract.same("triangles in all", static_cast<double>(at), static_cast<double>(device.hits.size()));
}

}  // namespace btgpu
