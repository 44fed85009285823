// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "convex_gap.h"

BTGPU_TRANSLATION_BEGIN
namespace {

// `number`: what contacts call the shape, that in the innermost compound.
void collectShapes(const btCollisionShape& shape, const btTransform& at, int number, int wanted,
                   std::vector<PlacedShape>& found) {
  if (!shape.isCompound()) {
    if (number == wanted && shape.isConvex()) found.push_back({static_cast<const btConvexShape*>(&shape), at});
    return;
  }
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    collectShapes(*compound.getChildShape(i), at * compound.getChildTransform(i), i, wanted, found);
  }
}

double dot(const btVector3& u, const btVector3& v) {
  return double(u.x()) * double(v.x()) + double(u.y()) * double(v.y()) + double(u.z()) * double(v.z());
}

// From the shape's position.
double reach(const PlacedShape& of, const btVector3& direction) {
  const btMatrix3x3& turn = of.at.getBasis();
  const btVector3 p = of.shape->localGetSupportingVertexWithoutMargin(direction * turn);
  double along = double(of.shape->getMargin());
  for (int row = 0; row < 3; ++row) along += dot(turn[row], p) * double(direction[row]);
  return along;
}

}  // namespace

std::vector<PlacedShape> placedShapes(const btCollisionShape& shape, const btTransform& at, int child) {
  std::vector<PlacedShape> found;
  collectShapes(shape, at, -1, child, found);
  return found;
}

double gapAlong(const PlacedShape& a, const PlacedShape& b, const btVector3& normal) {
  return dot(a.at.getOrigin() - b.at.getOrigin(), normal) - reach(a, -normal) - reach(b, normal);
}

BTGPU_TRANSLATION_END
