// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A world with a shape of every type that Bullet has: what is not on the device is named, and nothing else is.
#include <BulletCollision/CollisionShapes/btBox2dShape.h>
#include <BulletCollision/CollisionShapes/btConvex2dShape.h>
#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btEmptyShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMinkowskiSumShape.h>
#include <BulletCollision/CollisionShapes/btMultimaterialTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btSdfCollisionShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <array>
#include <set>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }
btVector3 v(double x, double y, double z) { return {s(x), s(y), s(z)}; }

// A class of the application's own may override anything.
class OwnBox : public btBoxShape {
 public:
  using btBoxShape::btBoxShape;
};

btTriangleMesh* triangles(scenes::Objects& o) {
  auto* mesh = o.keep(std::make_unique<btTriangleMesh>());
  mesh->addTriangle(v(-1, 0, -1), v(-1, 0, 1), v(1, 0, -1));
  mesh->addTriangle(v(1, 0, -1), v(-1, 0, 1), v(1, 0, 1));
  return mesh;
}

btTriangleMesh* tetrahedron(scenes::Objects& o) {
  const btVector3 p[] = {v(0, 0.6, 0), v(0.5, -0.3, 0.3), v(-0.5, -0.3, 0.3), v(0, -0.3, -0.6)};
  auto* mesh = o.keep(std::make_unique<btTriangleMesh>());
  mesh->addTriangle(p[0], p[1], p[2]);
  mesh->addTriangle(p[0], p[2], p[3]);
  mesh->addTriangle(p[0], p[3], p[1]);
  mesh->addTriangle(p[1], p[3], p[2]);
  return mesh;
}

std::vector<btConvexShape*> convexShapes(scenes::Objects& o) {
  auto* points = o.keep(std::make_unique<std::array<btVector3, 4>>(
      std::array<btVector3, 4>{v(0, 0.5, 0), v(0.5, -0.3, 0.3), v(-0.5, -0.3, 0.3), v(0, -0.3, -0.5)}));
  const btVector3 centres[] = {v(-0.2, 0, 0), v(0.2, 0, 0)};
  const btScalar even[] = {s(0.3), s(0.3)}, uneven[] = {s(0.3), s(0.2)};
  return {o.box(v(0.4, 0.4, 0.4)),
          o.sphere(s(0.4)),
          o.capsule(s(0.3), s(0.4)),
          o.shape<btCapsuleShapeX>(s(0.3), s(0.4)),
          o.shape<btCapsuleShapeZ>(s(0.3), s(0.4)),
          o.hull(scenes::prism(5, 0.5, 0.3)),
          o.shape<btCylinderShape>(v(0.4, 0.3, 0.4)),
          o.shape<btCylinderShapeX>(v(0.3, 0.4, 0.4)),
          o.shape<btCylinderShapeZ>(v(0.4, 0.4, 0.3)),
          o.shape<btConeShape>(s(0.4), s(0.8)),
          o.shape<btConeShapeX>(s(0.4), s(0.8)),
          o.shape<btConeShapeZ>(s(0.4), s(0.8)),
          o.shape<btMultiSphereShape>(centres, even, 2),
          o.shape<btMultiSphereShape>(centres, uneven, 2),
          o.shape<btTriangleShape>((*points)[0], (*points)[1], (*points)[2]),
          o.shape<btBU_Simplex1to4>((*points)[0], (*points)[1], (*points)[2], (*points)[3]),
          o.shape<btConvexPointCloudShape>(points->data(), 4, v(1, 1, 1)),
          o.shape<btConvexTriangleMeshShape>(tetrahedron(o)),
          o.shape<btBox2dShape>(v(0.4, 0.4, 0.1)),
          o.shape<btConvex2dShape>(o.hull(scenes::prism(4, 0.4, 0.2))),
          o.shape<btUniformScalingShape>(o.shape<btConeShape>(s(0.3), s(0.5)), s(1.3)),
          o.shape<btUniformScalingShape>(o.box(v(0.3, 0.3, 0.3)), s(0.8)),
          o.shape<btMinkowskiSumShape>(o.box(v(0.3, 0.3, 0.3)), o.sphere(s(0.1))),
          o.shape<btMinkowskiSumShape>(o.box(v(0.2, 0.2, 0.2)), o.shape<btCylinderShape>(v(0.2, 0.2, 0.2))),
          o.shape<btMinkowskiSumShape>(o.shape<btConeShape>(s(0.3), s(0.3)), o.sphere(s(0.1)))};
}

std::vector<btCollisionShape*> fixedShapes(scenes::Objects& o) {
  auto* heights = o.keep(std::make_unique<std::array<float, 9>>());
  auto* mesh = o.shape<btBvhTriangleMeshShape>(triangles(o), true);
  auto* field = o.own(std::make_unique<btHeightfieldTerrainShape>(3, 3, heights->data(), s(0), s(1), 1, false));
  return {o.plane(v(0, 1, 0), 0),
          mesh,
          o.own(std::make_unique<btScaledBvhTriangleMeshShape>(mesh, v(2, 1, 2))),
          o.own(std::make_unique<btMultimaterialTriangleMeshShape>(triangles(o), true)),
          field,
          o.shape<btEmptyShape>()};
}

btCompoundShape* compoundOf(scenes::Objects& o, const std::vector<btConvexShape*>& shapes) {
  auto* compound = o.shape<btCompoundShape>();
  for (size_t i = 0; i < shapes.size(); ++i) {
    compound->addChildShape(btTransform(btQuaternion::getIdentity(), v(0.8 * double(i), 0, 0)), shapes[i]);
  }
  return compound;
}

std::set<std::string> namesReported(const btGpuDynamicsWorld& world) {
  std::set<std::string> names;
  for (const btGpuFallback& f : world.fallbackReport()) names.insert(f.m_what);
  return names;
}

TEST(EveryShape, OfBulletsOwnIsOnTheDevice) {
  GpuWorld w;
  scenes::Objects& o = w.objects;
  o.world().setGravity(v(0, -10, 0));
  double x = -40;
  for (btCollisionShape* shape : fixedShapes(o)) o.add(0, shape, v(x += 5, shape->getShapeType() ? 0 : 0.1, 0));
  const std::vector<btConvexShape*> convex = convexShapes(o);
  x = -40;
  for (btConvexShape* shape : convex) {
    o.add(1, shape, v(x += 3, 0.8, 0));
    o.add(1, shape, v(x + 0.4, 1.5, 0.1));
  }
  btCompoundShape* compound = compoundOf(o, convex);
  o.add(20, compound, v(-10, 3, 0));
  auto* nested = o.shape<btCompoundShape>();
  nested->addChildShape(btTransform::getIdentity(), compound);
  nested->addChildShape(btTransform(btQuaternion::getIdentity(), v(0, 1, 0)), o.sphere(s(0.4)));
  o.add(20, nested, v(-10, 6, 0));
  o.add(1, o.shape<btEmptyShape>(), v(0, 9, 0));
  // A level: all that does not move in one body, in a compound of its own.
  auto* level = o.shape<btCompoundShape>();
  auto* inner = o.shape<btCompoundShape>();
  x = -20;
  for (btCollisionShape* shape : fixedShapes(o)) {
    inner->addChildShape(btTransform(btQuaternion::getIdentity(), v(x += 5, -0.5, 0)), shape);
  }
  level->addChildShape(btTransform::getIdentity(), inner);
  o.add(0, level, v(0, 0, 20));
  for (size_t i = 0; i < convex.size(); ++i) o.add(1, convex[i], v(1.2 * double(i) - 15, 0.8, 20));
  o.add(20, compound, v(-10, 3, 20));
  w.run(30);
  EXPECT_EQ(namesReported(w.world), std::set<std::string>()) << reportText(w.world);
  expectAllOnDevice(w.world);
}

// No more cells than none: it has bounds and nothing in it.
std::vector<char> emptySdf() {
  std::vector<char> data;
  const auto put = [&data](auto value) {
    const char* bytes = reinterpret_cast<const char*>(&value);
    data.insert(data.end(), bytes, bytes + sizeof value);
  };
  for (int i = 0; i < 6; ++i) put(i < 3 ? -1.0 : 1.0);                  // the domain
  for (int i = 0; i < 3; ++i) put(1u);                                  // its resolution
  for (int i = 0; i < 6; ++i) put(i < 3 ? 2.0 : 0.5);                   // a cell's size, and one over it
  for (int i = 0; i < 5; ++i) put(static_cast<unsigned long long>(0));  // cells, fields; nodes, cells, maps that follow
  return data;
}

// Contacts by Bullet's own algorithms in the middle of the device's steps.
TEST(EveryShape, WhatTheHostCollidesIsNamed) {
  GpuWorld w;
  scenes::Objects& o = w.objects;
  btGImpactCollisionAlgorithm::registerAlgorithm(&w.dispatcher);
  auto* impact = o.shape<btGImpactMeshShape>(tetrahedron(o));
  impact->updateBound();
  auto* sdf = o.shape<btSdfCollisionShape>();
  const std::vector<char> data = emptySdf();
  ASSERT_TRUE(sdf->initializeSDF(data.data(), static_cast<int>(data.size())));
  o.add(0, o.box(v(50, 1, 50)), v(0, -1, 0));
  o.add(1, impact, v(0, 0.3, 0));
  o.add(0, sdf, v(0, 30, 0));
  o.add(1, o.shape<OwnBox>(v(0.3, 0.3, 0.3)), v(5, 0.3, 0));
  // And what holds one of these.
  auto* compound = o.shape<btCompoundShape>();
  compound->addChildShape(btTransform::getIdentity(), impact);
  o.add(1, compound, v(10, 0.4, 0));
  o.add(1, o.box(v(0.3, 0.3, 0.3)), v(15, 0.3, 0));
  w.run(5);
  EXPECT_EQ(namesReported(w.world),
            (std::set<std::string>{"GImpactMesh shape", "btSdfCollisionShape shape", "Box shape", "Compound shape"}))
      << reportText(w.world);
  EXPECT_EQ(w.world.statistics().m_stockSteps, 0u);
}

}  // namespace
}  // namespace btgpu::test
