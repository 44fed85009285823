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
// farthest of. False where one of them is not points.
bool addDifference(const btMinkowskiSumShape& sum, btScalar scale, CorePoints& out) {
  CorePoints a, b;
  const auto read = [](const btConvexShape& shape, CorePoints& of) {
    btScalar own = 1;
    return addPoints(innermostShape(shape, own), own, true, of);
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

bool readRound(const btConvexShape& shape, btScalar scale, Shape& out) {
  if (isExactly<btCylinderShape, btCylinderShapeX, btCylinderShapeZ>(shape)) {
    readCylinder(static_cast<const btCylinderShape&>(shape), scale, out);
  } else if (isExactly<btConeShape, btConeShapeX, btConeShapeZ>(shape)) {
    readCone(static_cast<const btConeShape&>(shape), scale, out);
  } else {
    return false;
  }
  return true;
}

// Adds the terms of a sum, or the one that a shape is: `scale` times it, below zero of what is taken away. False for
// shapes of the application's own.
bool addTerms(const btConvexShape& shape, const btMatrix3x3& turn, btScalar scale, CorePoints& out) {
  const btConvexShape& inner = innermostShape(shape, scale);
  if (isExactly<btMinkowskiSumShape>(inner)) {
    const auto& sum = static_cast<const btMinkowskiSumShape&>(inner);
    const btTransform &a = sum.getTransformA(), &b = sum.getTransformB();
    out.terms[0] += toFloat4(turn * (a.getOrigin() - b.getOrigin()) * scale);
    return addTerms(*sum.getShapeA(), turn * a.getBasis(), scale, out) &&
           addTerms(*sum.getShapeB(), turn * b.getBasis(), -scale, out);
  }
  btQuaternion q;
  turn.getRotation(q);
  out.terms.push_back(toFloat4(btVector3(q.x(), q.y(), q.z()), static_cast<float>(q.w())));
  Shape round{};
  if (readRound(inner, scale, round)) {
    out.terms.push_back({float(round.type), float(round.variant), round.radius, round.halfLength});
    return true;
  }
  CorePoints list;
  if (isExactly<btMultiSphereShape>(inner)) {
    const auto& spheres = static_cast<const btMultiSphereShape&>(inner);
    addSpheres(list, spheres, scale);
    // Here all of their radii is in the terms.
    if (list.radii.empty()) list.radii.assign(list.points.size(), 0);
    for (float& radius : list.radii) radius += static_cast<float>(list.margin);
    out.margin -= spheres.getMargin() * btFabs(scale);
  } else if (!addPoints(inner, scale, true, list)) {
    return false;
  }
  if (list.points.empty()) addPoint(list, btVector3(0, 0, 0), scale);
  out.terms.push_back({float(SHAPE_MULTI_SPHERE), float(list.points.size()), 0, 0});
  for (std::size_t i = 0; i < list.points.size(); ++i) {
    out.terms.push_back(toFloat4(list.points[i], list.radii.empty() ? 0 : list.radii[i]));
  }
  out.terms.push_back(toFloat4(list.stretch));
  return true;
}

// A sum: points, if there is nothing round in it.
bool addSum(const btMinkowskiSumShape& sum, btScalar scale, CorePoints& out) {
  if (addDifference(sum, scale, out)) return true;
  out.terms.assign(1, float4{0, 0, 0, 0});
  return addTerms(sum, btMatrix3x3::getIdentity(), scale, out);
}

}  // namespace

// btConvex2dShape hands everything on to its child.
const btConvexShape& innermostShape(const btConvexShape& shape, btScalar& scale) {
  if (isExactly<btUniformScalingShape>(shape)) {
    const auto& scaled = static_cast<const btUniformScalingShape&>(shape);
    scale *= scaled.getUniformScalingFactor();
    return innermostShape(*scaled.getChildShape(), scale);
  }
  if (isExactly<btConvex2dShape>(shape)) {
    return innermostShape(*static_cast<const btConvex2dShape&>(shape).getChildShape(), scale);
  }
  return shape;
}

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
  const btConvexShape& inner = innermostShape(static_cast<const btConvexShape&>(shape), scale);
  if (!readRound(inner, scale, out)) return false;
  out.boundsMargins = boundsMargins(shape);
  btVector3 lower, upper;
  shape.getAabb(btTransform::getIdentity(), lower, upper);
  out.extents = toFloat4((upper - lower) * btScalar(0.5));
  return true;
}

bool readCorePoints(const btCollisionShape& shape, CorePoints& out) {
  out.points.clear();
  out.radii.clear();
  out.terms.clear();
  out.stretch = btVector3(1, 1, 1);
  out.isBox = false;
  if (!shape.isConvex()) return false;
  btScalar scale = 1;
  const auto& convex = static_cast<const btConvexShape&>(shape);
  const btConvexShape& inner = innermostShape(convex, scale);
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
    return addSum(static_cast<const btMinkowskiSumShape&>(inner), scale, out);
  }
  return addPoints(inner, scale, &inner != &convex, out);
}

BTGPU_TRANSLATION_END
