// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "convex_core.h"

#include <BulletCollision/CollisionShapes/btBox2dShape.h>
#include <BulletCollision/CollisionShapes/btConvex2dShape.h>
#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btMinkowskiSumShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>

#include <algorithm>
#include <cmath>

#include "convert.h"
#include "exact_type.h"

BTGPU_TRANSLATION_BEGIN
namespace {

// The shape that a scaled or a flat one is made of; btConvex2dShape hands everything on to its child.
const btConvexShape& innermost(const btConvexShape& shape, btScalar& scale) {
  if (isExactly<btUniformScalingShape>(shape)) {
    const auto& scaled = static_cast<const btUniformScalingShape&>(shape);
    scale *= scaled.getUniformScalingFactor();
    return innermost(*scaled.getChildShape(), scale);
  }
  if (isExactly<btConvex2dShape>(shape)) {
    return innermost(*static_cast<const btConvex2dShape&>(shape).getChildShape(), scale);
  }
  return shape;
}

void addPoint(CorePoints& out, const btVector3& p, btScalar scale) {
  out.points.push_back(btVector3(p.x() * scale, p.y() * scale, p.z() * scale));
}

// Extents below zero, of shapes that are thinner than their margins, have no inside.
void addBox(CorePoints& out, const btVector3& half, btScalar scale) {
  out.isBox = true;
  const btVector3 h(btMax(half.x(), btScalar(0)), btMax(half.y(), btScalar(0)), btMax(half.z(), btScalar(0)));
  for (int i = 0; i < 8; ++i) {
    addPoint(out, btVector3(i & 1 ? h.x() : -h.x(), i & 2 ? h.y() : -h.y(), i & 4 ? h.z() : -h.z()), scale);
  }
}

// Those that a triangle uses; the interface scales them.
class VertexCollector : public btInternalTriangleIndexCallback {
 public:
  VertexCollector(CorePoints& out, btScalar scale) : m_out(out), m_scale(scale) {}
  void internalProcessTriangleIndex(btVector3* triangle, int, int) override {
    for (int k = 0; k < 3; ++k) addPoint(m_out, triangle[k], m_scale);
  }

 private:
  CorePoints& m_out;
  btScalar m_scale;
};

// Radii and margin of a btMultiSphereShape: the same surface, with as much of it in the margin as all spheres have.
void addSpheres(CorePoints& out, const btMultiSphereShape& shape, btScalar scale) {
  const btVector3 stretch = shape.getLocalScaling();
  const bool even = stretch.x() == stretch.y() && stretch.y() == stretch.z() && stretch.x() > btScalar(0);
  btScalar least = BT_LARGE_FLOAT, most = 0;
  for (int i = 0; i < shape.getSphereCount(); ++i) {
    addPoint(out, shape.getSpherePosition(i) * stretch, scale);
    least = btMin(least, btFabs(shape.getSphereRadius(i)));
    most = btMax(most, btFabs(shape.getSphereRadius(i)));
  }
  const btScalar size = btFabs(scale) * (even ? stretch.x() : btScalar(1));
  out.margin = even ? least * size : btScalar(0);
  if (even && most == least) return;
  if (!even) out.stretch = btVector3(btFabs(stretch.x()), btFabs(stretch.y()), btFabs(stretch.z()));
  for (int i = 0; i < shape.getSphereCount(); ++i) {
    out.radii.push_back(static_cast<float>(btFabs(shape.getSphereRadius(i)) * size - out.margin));
  }
}

bool addPoints(const btConvexShape& shape, btScalar scale, bool scaled, CorePoints& out) {
  if (isExactly<btConvexHullShape>(shape)) {
    const auto& hull = static_cast<const btConvexHullShape&>(shape);
    for (int i = 0; i < hull.getNumPoints(); ++i) addPoint(out, hull.getScaledPoint(i), scale);
  } else if (isExactly<btConvexPointCloudShape>(shape)) {
    const auto& cloud = static_cast<const btConvexPointCloudShape&>(shape);
    for (int i = 0; i < cloud.getNumPoints(); ++i) addPoint(out, cloud.getScaledPoint(i), scale);
  } else if (isExactly<btConvexTriangleMeshShape>(shape)) {
    VertexCollector collector(out, scale);
    const btVector3 large(btScalar(BT_LARGE_FLOAT), btScalar(BT_LARGE_FLOAT), btScalar(BT_LARGE_FLOAT));
    const auto& mesh = static_cast<const btConvexTriangleMeshShape&>(shape);
    mesh.getMeshInterface()->InternalProcessAllTriangles(&collector, -large, large);
  } else if (isExactly<btTriangleShape>(shape)) {
    for (int i = 0; i < 3; ++i) addPoint(out, static_cast<const btTriangleShape&>(shape).getVertexPtr(i), scale);
  } else if (isExactly<btBU_Simplex1to4>(shape)) {
    const auto& simplex = static_cast<const btBU_Simplex1to4&>(shape);
    for (int i = 0; i < simplex.getNumVertices(); ++i) {
      btVector3 p;
      simplex.getVertex(i, p);
      addPoint(out, p, scale);
    }
  } else if (isExactly<btBox2dShape>(shape)) {
    addBox(out, static_cast<const btBox2dShape&>(shape).getHalfExtentsWithoutMargin(), scale);
  } else if (scaled && isExactly<btBoxShape>(shape)) {
    // Not a box to Bullet any more, which collides it with its edges rounded by the margin.
    addBox(out, static_cast<const btBoxShape&>(shape).getHalfExtentsWithoutMargin(), scale);
  } else if (scaled && isExactly<btSphereShape>(shape)) {
    addPoint(out, btVector3(0, 0, 0), scale);
  } else if (scaled && isExactly<btCapsuleShape, btCapsuleShapeX, btCapsuleShapeZ>(shape)) {
    const auto& capsule = static_cast<const btCapsuleShape&>(shape);
    btVector3 end(0, 0, 0);
    end[capsule.getUpAxis()] = capsule.getHalfHeight();
    addPoint(out, end, scale);
    addPoint(out, -end, scale);
  } else {
    return false;
  }
  // Bullet takes the origin for the farthest of no points.
  if (out.points.empty()) addPoint(out, btVector3(0, 0, 0), scale);
  return true;
}

// Each point of the one shape less each of the other, which is what btMinkowskiSumShape's support function finds the
// farthest of. False where one of them is not points: no shape of ours is a cylinder with another shape around it.
bool addDifference(const btMinkowskiSumShape& sum, btScalar scale, CorePoints& out) {
  CorePoints a, b;
  const auto read = [](const btConvexShape& shape, CorePoints& of) {
    btScalar own = 1;
    return addPoints(innermost(shape, own), own, true, of);
  };
  if (!read(*sum.getShapeA(), a) || !read(*sum.getShapeB(), b)) return false;
  for (const btVector3& p : a.points) {
    for (const btVector3& q : b.points) addPoint(out, sum.getTransformA() * p - sum.getTransformB() * q, scale);
  }
  return true;
}

float positive(btScalar v) { return static_cast<float>(v > btScalar(0) ? v : btScalar(0)); }

// btCylinderShape takes the extent along its first axis for the radius.
void readCylinder(const btCylinderShape& cylinder, btScalar scale, Shape& out) {
  const btVector3 core = cylinder.getHalfExtentsWithoutMargin() * btFabs(scale);
  out.type = SHAPE_CYLINDER;
  out.variant = cylinder.getUpAxis();
  out.radius = positive(core[out.variant == 0 ? 1 : 0]);
  out.halfLength = positive(core[out.variant]);
}

void readCone(const btConeShape& cone, btScalar scale, Shape& out) {
  out.type = SHAPE_CONE;
  out.variant = cone.getConeUpIndex();
  out.radius = static_cast<float>(btFabs(cone.getRadius() * scale));
  out.halfLength = static_cast<float>(cone.getHeight() * scale * btScalar(0.5));  // below zero: the tip points down
}

}  // namespace

int boundsMargins(const btCollisionShape& shape) {
  if (isExactly<btUniformScalingShape>(shape)) return 1;
  if (isExactly<btConvex2dShape>(shape)) {
    return boundsMargins(*static_cast<const btConvex2dShape&>(shape).getChildShape());
  }
  // btConvexInternalShape::getAabbSlow adds the margin to points that have it already.
  const bool slow = isExactly<btConeShape, btConeShapeX, btConeShapeZ, btTriangleShape, btMinkowskiSumShape>(shape);
  return slow ? 2 : 0;
}

bool readRoundShape(const btCollisionShape& shape, Shape& out) {
  if (!shape.isConvex()) return false;
  btScalar scale = 1;
  const btConvexShape& inner = innermost(static_cast<const btConvexShape&>(shape), scale);
  if (isExactly<btCylinderShape, btCylinderShapeX, btCylinderShapeZ>(inner)) {
    readCylinder(static_cast<const btCylinderShape&>(inner), scale, out);
  } else if (isExactly<btConeShape, btConeShapeX, btConeShapeZ>(inner)) {
    readCone(static_cast<const btConeShape&>(inner), scale, out);
  } else {
    return false;
  }
  out.boundsMargins = boundsMargins(shape);
  btVector3 lower, upper;
  shape.getAabb(btTransform::getIdentity(), lower, upper);
  out.extents = toFloat4((upper - lower) * btScalar(0.5));
  return true;
}

bool readCorePoints(const btCollisionShape& shape, CorePoints& out) {
  out.points.clear();
  out.radii.clear();
  out.stretch = btVector3(1, 1, 1);
  out.isBox = false;
  if (!shape.isConvex()) return false;
  btScalar scale = 1;
  const auto& convex = static_cast<const btConvexShape&>(shape);
  const btConvexShape& inner = innermost(convex, scale);
  out.margin = shape.getMargin();
  if (isExactly<btMultiSphereShape>(inner)) {
    const auto& spheres = static_cast<const btMultiSphereShape&>(inner);
    if (spheres.getSphereCount() > 0) {
      addSpheres(out, spheres, scale);
    } else {
      addPoint(out, btVector3(0, 0, 0), scale);
    }
    return true;
  }
  if (isExactly<btMinkowskiSumShape>(inner)) {
    return addDifference(static_cast<const btMinkowskiSumShape&>(inner), scale, out);
  }
  return addPoints(inner, scale, &inner != &convex, out);
}

BTGPU_TRANSLATION_END
