// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "shape_mesh.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btShapeHull.h>

namespace btgpu::tool {
namespace {

using Corners = std::vector<Corner>;

btScalar s(double v) { return static_cast<btScalar>(v); }

void addTriangle(Corners& to, const btVector3& a, const btVector3& b, const btVector3& c) {
  btVector3 normal = (b - a).cross(c - a);
  const btScalar length = normal.length();
  if (!(length > 0)) return;
  normal /= length;
  for (const btVector3& corner : {a, b, c}) to.push_back({corner, normal});
}

void addBox(Corners& to, const btVector3& lower, const btVector3& upper) {
  const auto corner = [&](int i) {
    return btVector3(i & 1 ? upper.x() : lower.x(), i & 2 ? upper.y() : lower.y(), i & 4 ? upper.z() : lower.z());
  };
  constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : kFaces) {
    addTriangle(to, corner(f[0]), corner(f[1]), corner(f[2]));
    addTriangle(to, corner(f[0]), corner(f[2]), corner(f[3]));
  }
}

// An octant's triangle, split `fineness` times; corners on the unit sphere.
void addSpherePart(Corners& to, const btVector3& a, const btVector3& b, const btVector3& c, btScalar radius,
                   int fineness) {
  if (fineness == 0) {
    for (const btVector3& n : {a, b, c}) to.push_back({n * radius, n});
    return;
  }
  const btVector3 ab = (a + b).normalized(), bc = (b + c).normalized(), ca = (c + a).normalized();
  addSpherePart(to, a, ab, ca, radius, fineness - 1);
  addSpherePart(to, ab, b, bc, radius, fineness - 1);
  addSpherePart(to, ca, bc, c, radius, fineness - 1);
  addSpherePart(to, ab, bc, ca, radius, fineness - 1);
}

void addSphere(Corners& to, btScalar radius, int fineness) {
  for (int octant = 0; octant < 8; ++octant) {
    const btVector3 x(octant & 1 ? s(-1) : s(1), 0, 0), y(0, octant & 2 ? s(-1) : s(1), 0),
        z(0, 0, octant & 4 ? s(-1) : s(1));
    addSpherePart(to, x, y, z, radius, fineness);
  }
}

void addPlane(Corners& to, const btStaticPlaneShape& plane, btScalar reach, const btVector3& focus) {
  const btVector3& n = plane.getPlaneNormal();
  if (!(n.length2() > s(0.5))) return;
  const btVector3 centre = focus - n * (n.dot(focus) - plane.getPlaneConstant());
  btVector3 u, v;
  btPlaneSpace1(n, u, v);
  u *= reach;
  v *= reach;
  addTriangle(to, centre - u - v, centre + u - v, centre + u + v);
  addTriangle(to, centre - u - v, centre + u + v, centre - u + v);
}

bool addHull(Corners& to, const btConvexShape& convex) {
  btShapeHull hull(&convex);
  if (!hull.buildHull(0, 1)) return false;
  const btVector3* vertices = hull.getVertexPointer();
  const unsigned* index = hull.getIndexPointer();
  for (int t = 0; t < hull.numTriangles(); ++t, index += 3) {
    addTriangle(to, vertices[index[0]], vertices[index[1]], vertices[index[2]]);
  }
  return hull.numTriangles() > 0;
}

void addConcave(Corners& to, const btConcaveShape& concave) {
  struct Collect : btTriangleCallback {
    explicit Collect(Corners& corners) : to(corners) {}
    void processTriangle(btVector3* t, int, int) override { addTriangle(to, t[0], t[1], t[2]); }
    Corners& to;
  } collect(to);
  const btVector3 far(s(1e18), s(1e18), s(1e18));
  concave.processAllTriangles(&collect, -far, far);
}

void addBounds(Corners& to, const btCollisionShape& shape) {
  btVector3 lower, upper;
  shape.getAabb(btTransform::getIdentity(), lower, upper);
  addBox(to, lower, upper);
}

}  // namespace

std::vector<Corner> meshOf(const btCollisionShape& shape, int fineness, btScalar reach, const btVector3& focus) {
  Corners corners;
  if (shape.getShapeType() == BOX_SHAPE_PROXYTYPE) {
    const btVector3 half = static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin();
    addBox(corners, -half, half);
  } else if (shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
    addSphere(corners, static_cast<const btSphereShape&>(shape).getRadius(), fineness);
  } else if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE) {
    addPlane(corners, static_cast<const btStaticPlaneShape&>(shape), reach, focus);
  } else if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int i = 0; i < compound.getNumChildShapes(); ++i) {
      const btTransform& at = compound.getChildTransform(i);
      for (const Corner& c : meshOf(*compound.getChildShape(i), fineness, reach, at.invXform(focus))) {
        corners.push_back({at * c.position, at.getBasis() * c.normal});
      }
    }
  } else if (shape.isConcave()) {
    addConcave(corners, static_cast<const btConcaveShape&>(shape));
  } else if (!shape.isConvex() || !addHull(corners, static_cast<const btConvexShape&>(shape))) {
    addBounds(corners, shape);
  }
  return corners;
}

}  // namespace btgpu::tool
