// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Rays against single shapes: kernels/lib/ray_cast.h, compiled as C++, beside btCollisionWorld::rayTestSingle.
#include "kernels/lib/ray_cast.h"

#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>
#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include <memory>
#include <random>

namespace btgpu {
namespace {

struct Tested {
  std::unique_ptr<btCollisionShape> bullet;
  Shape shape{};
  std::vector<float4> vertices;
  ItemForm form{{1, 1, 1, 0}, NO_INDEX, 0, 0, 0};
  std::vector<float4> spheres;
};

float4 toFloat4(const btVector3& v) { return {v.x(), v.y(), v.z(), 0}; }

class RayCast : public testing::Test {
 protected:
  std::mt19937 random{7};
  bool straight = false;  // nothing is turned, and rays go along an axis
  float uniform(float a, float b) { return std::uniform_real_distribution<float>(a, b)(random); }
  btVector3 uniform3(float a) { return {uniform(-a, a), uniform(-a, a), uniform(-a, a)}; }

  Tested sphere(float radius) {
    Tested t;
    t.bullet = std::make_unique<btSphereShape>(radius);
    t.shape.type = SHAPE_SPHERE;
    t.shape.extents.x = t.shape.margin = radius;
    return t;
  }
  Tested box(const btVector3& half) {
    auto shape = std::make_unique<btBoxShape>(half);
    Tested t;
    t.shape.type = SHAPE_BOX;
    t.shape.margin = shape->getMargin();
    t.shape.extents = toFloat4(shape->getHalfExtentsWithMargin());
    t.bullet = std::move(shape);
    return t;
  }
  Tested capsule(float radius, float height) {
    Tested t;
    t.bullet = std::make_unique<btCapsuleShapeZ>(radius, height);
    t.shape.type = SHAPE_CAPSULE;
    t.shape.margin = radius;
    t.shape.extents.z = height / 2;
    return t;
  }
  Tested hull(int count, float size, float margin) {
    auto shape = std::make_unique<btConvexHullShape>();
    Tested t;
    for (int i = 0; i < count; ++i) {
      shape->addPoint(uniform3(size), false);
      t.vertices.push_back(toFloat4(shape->getUnscaledPoints()[i]));
    }
    shape->setMargin(margin);
    shape->recalcLocalAabb();
    btVector3 lower, upper;
    shape->getAabb(btTransform::getIdentity(), lower, upper);
    t.shape.type = SHAPE_HULL;
    t.shape.margin = margin;
    t.shape.vertexCount = count;
    t.shape.extents = toFloat4((upper - lower) * 0.5f);
    t.shape.centre = toFloat4((upper + lower) * 0.5f);
    t.bullet = std::move(shape);
    return t;
  }
  Tested plane() {
    auto shape = std::make_unique<btStaticPlaneShape>(uniform3(1).normalized(), uniform(-0.3f, 0.3f));
    Tested t;
    t.shape.type = SHAPE_PLANE;
    t.shape.extents = toFloat4(shape->getPlaneNormal());
    t.shape.extents.w = shape->getPlaneConstant();
    t.bullet = std::move(shape);
    return t;
  }

  static void setBounds(Tested& t) {
    btVector3 lower, upper;
    t.bullet->getAabb(btTransform::getIdentity(), lower, upper);
    t.shape.extents = toFloat4((upper - lower) * 0.5f);
    t.shape.centre = toFloat4((upper + lower) * 0.5f);
  }
  Tested cylinder(int axis, float radius, float half) {
    // The third extent is nothing that Bullet's support function would look at.
    btVector3 extents(uniform(0.1f, 1), uniform(0.1f, 1), uniform(0.1f, 1));
    extents[axis == 0 ? 1 : 0] = radius;
    extents[axis] = half;
    Tested t;
    std::unique_ptr<btCylinderShape> shape;
    if (axis == 0) shape = std::make_unique<btCylinderShapeX>(extents);
    if (axis == 1) shape = std::make_unique<btCylinderShape>(extents);
    if (axis == 2) shape = std::make_unique<btCylinderShapeZ>(extents);
    const btVector3 core = shape->getHalfExtentsWithoutMargin();
    t.shape.type = SHAPE_CYLINDER;
    t.shape.variant = axis;
    t.shape.margin = shape->getMargin();
    t.shape.radius = core[axis == 0 ? 1 : 0];
    t.shape.halfLength = core[axis];
    t.bullet = std::move(shape);
    setBounds(t);
    return t;
  }
  Tested cone(int axis, float radius, float height) {
    Tested t;
    if (axis == 0) t.bullet = std::make_unique<btConeShapeX>(radius, height);
    if (axis == 1) t.bullet = std::make_unique<btConeShape>(radius, height);
    if (axis == 2) t.bullet = std::make_unique<btConeShapeZ>(radius, height);
    t.shape.type = SHAPE_CONE;
    t.shape.variant = axis;
    t.shape.margin = t.bullet->getMargin();
    t.shape.radius = radius;
    t.shape.halfLength = height / 2;
    setBounds(t);
    return t;
  }
  Tested spheres(int count, const btVector3& scaling) {
    std::vector<btVector3> centres;
    std::vector<float> radii;
    for (int i = 0; i < count; ++i) {
      centres.push_back(uniform3(1));
      radii.push_back(uniform(0.1f, 0.8f));
    }
    auto shape = std::make_unique<btMultiSphereShape>(centres.data(), radii.data(), count);
    shape->setLocalScaling(scaling);
    Tested t;
    t.shape.type = SHAPE_MULTI_SPHERE;
    t.form.firstSphere = 1;
    t.form.sphereCount = count;
    t.spheres.push_back(toFloat4(scaling));
    t.spheres.back().w = shape->getMargin();
    for (int i = 0; i < count; ++i) {
      t.spheres.push_back(toFloat4(centres[static_cast<size_t>(i)] * scaling));
      t.spheres.back().w = radii[static_cast<size_t>(i)];
    }
    t.bullet = std::move(shape);
    setBounds(t);
    return t;
  }
  // A shape around another one, which has to live.
  Tested scaled(Tested inner, float factor) {
    inside.push_back(std::move(inner.bullet));
    inner.bullet = std::make_unique<btUniformScalingShape>(static_cast<btConvexShape*>(inside.back().get()), factor);
    inner.form.scaling = {factor, factor, factor, 0};
    return inner;
  }
  std::vector<std::unique_ptr<btCollisionShape>> inside;

  struct Counts {
    int rays = 0, hits = 0, others = 0, farOff = 0, turned = 0;
  };

  // One ray of a length of some shapes: aimed near the surface, through, from inside, or past.
  void castOne(const Tested& t, Counts& counts, unsigned flags = 0) {
    btTransform pose(btQuaternion(uniform3(1).normalized(), uniform(-3, 3)), uniform3(20));
    btCollisionObject object;
    object.setCollisionShape(t.bullet.get());
    object.setWorldTransform(pose);
    btVector3 from = pose * uniform3(uniform(0.1f, 8)), to = pose * uniform3(uniform(0.1f, 8));
    if (straight) {
      const int axis = counts.rays % 3;
      pose.setBasis(btMatrix3x3::getIdentity());
      object.setWorldTransform(pose);
      from = pose * uniform3(2);
      to = from;
      from[axis] = pose.getOrigin()[axis] - 5;
      to[axis] = pose.getOrigin()[axis] + 4;
    }
    btCollisionWorld::ClosestRayResultCallback stock(from, to);
    stock.m_flags = flags;
    btCollisionWorld::rayTestSingle(btTransform(btQuaternion::getIdentity(), from),
                                    btTransform(btQuaternion::getIdentity(), to), &object, t.bullet.get(), pose, stock);
    Ray ray{toFloat4(from), toFloat4(to), 1, -1, flags, NO_INDEX};
    ItemPose p;
    for (int k = 0; k < 3; ++k) {
      (&p.row0)[k] = toFloat4(pose.getBasis()[k]);
      (&p.row0)[k].w = pose.getOrigin()[k];
    }
    RayHit hit = noRayHit();
    const QueryShapes q = queryShapes(nullptr, t.vertices.data(), t.spheres.data(), nullptr, nullptr, nullptr);
    const bool isHit = castShape(t.shape, t.form, p, q, ray, 0, 1, &hit) != 0;
    ++counts.rays;
    if (stock.hasHit()) ++counts.hits;
    if (isHit != stock.hasHit()) {
      ++counts.others;
    } else if (isHit) {
      if (std::fabs(hit.normal.w - stock.m_closestHitFraction) > 1e-4f) ++counts.farOff;
      if (btVector3(hit.normal.x, hit.normal.y, hit.normal.z).dot(stock.m_hitNormalWorld) < 0.999f) ++counts.turned;
    }
  }

  // The bound: one in 1000 may be a tie. Rounding decides whether Bullet's cast takes another step where it
  // is just about near enough, and the next step may be anywhere within 0.01 of the surface.
  void expectSame(const Counts& c, const char* what) {
    EXPECT_GT(c.hits, c.rays / 50) << what;
    EXPECT_LE(c.others, c.rays / 1000) << what << ": hits that the other has not";
    EXPECT_LE(c.farOff, c.rays / 1000) << what << ": fractions more than 1e-4 off";
    EXPECT_LE(c.turned, c.rays / 1000) << what << ": normals that differ";
    printf("%s: %d rays, %d hits, %d others, %d far off, %d turned\n", what, c.rays, c.hits, c.others, c.farOff,
           c.turned);
  }
};

constexpr int kRays = 20000;

TEST_F(RayCast, Spheres) {
  Counts c;
  for (int i = 0; i < kRays; ++i) castOne(sphere(uniform(0.1f, 2)), c);
  expectSame(c, "spheres");
}
TEST_F(RayCast, Boxes) {
  Counts c;
  for (int i = 0; i < kRays; ++i) castOne(box({uniform(0.1f, 2), uniform(0.1f, 2), uniform(0.1f, 2)}), c);
  expectSame(c, "boxes");
}
TEST_F(RayCast, Capsules) {
  Counts c;
  for (int i = 0; i < kRays; ++i) castOne(capsule(uniform(0.1f, 1), uniform(0.1f, 2)), c);
  expectSame(c, "capsules");
}
TEST_F(RayCast, Hulls) {
  Counts c;
  for (int i = 0; i < kRays; ++i) castOne(hull(4 + i % 30, uniform(0.3f, 2), i % 3 == 0 ? 0.0f : 0.04f), c);
  expectSame(c, "hulls");
}
TEST_F(RayCast, Cylinders) {
  Counts c;
  for (int i = 0; i < kRays; ++i) castOne(cylinder(i % 3, uniform(0.1f, 1), uniform(0.1f, 2)), c);
  expectSame(c, "cylinders");
}
TEST_F(RayCast, Cones) {
  Counts c;
  for (int i = 0; i < kRays; ++i) castOne(cone(i % 3, uniform(0.1f, 1), uniform(0.1f, 2)), c);
  expectSame(c, "cones");
}
TEST_F(RayCast, MultiSpheres) {
  Counts c;
  for (int i = 0; i < kRays; ++i) {
    const bool isEven = i % 3 != 0;
    castOne(spheres(1 + i % 5, isEven ? btVector3(1, 1, 1) : btVector3(uniform(0.5f, 2), uniform(0.5f, 2), 1)), c);
  }
  expectSame(c, "multi-spheres");
}
TEST_F(RayCast, ScaledShapes) {
  Counts c;
  for (int i = 0; i < kRays; ++i) {
    Tested inner = i % 4 == 0   ? box({uniform(0.1f, 2), uniform(0.1f, 2), uniform(0.1f, 2)})
                   : i % 4 == 1 ? capsule(uniform(0.1f, 1), uniform(0.1f, 2))
                   : i % 4 == 2 ? cylinder(i % 3, uniform(0.1f, 1), uniform(0.1f, 2))
                                : hull(12, 1, 0.04f);
    castOne(scaled(std::move(inner), uniform(0.3f, 2)), c);
    inside.clear();
  }
  expectSame(c, "scaled shapes");
}
// Along the axes of shapes that are not turned there is more than one farthest point.
TEST_F(RayCast, AlongTheAxes) {
  straight = true;
  Counts c;
  for (int i = 0; i < kRays; ++i) {
    castOne(
        i % 2 ? cylinder(i % 3, uniform(0.1f, 1), uniform(0.1f, 2)) : cone(i % 3, uniform(0.1f, 1), uniform(0.1f, 2)),
        c);
  }
  expectSame(c, "cylinders and cones along their axes");
}
TEST_F(RayCast, Planes) {
  for (const unsigned flags : {0u, RAY_FILTER_BACKFACES, RAY_KEEP_UNFLIPPED_NORMAL, 3u}) {
    Counts c;
    for (int i = 0; i < kRays; ++i) castOne(plane(), c, flags);
    expectSame(c, "planes");
  }
}

}  // namespace
}  // namespace btgpu
