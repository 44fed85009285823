// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The world of a .bullet file as the tool builds it, from the copy that its child process wrote, is the file's: nothing
// is lost on the way. Files are what Bullet's serializer writes, and single precision, so equal is equal.
#include "tools/btgpu/bullet_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/subprocess.h"
#include "tests/support/world_of.h"

namespace btgpu::test {
namespace {

using Stock = tool::TestWorld<btDiscreteDynamicsWorld>;

void expectSameBody(const btRigidBody& a, const btRigidBody& b) {
  const btCollisionShape &shapeA = *a.getCollisionShape(), &shapeB = *b.getCollisionShape();
  EXPECT_EQ(shapeA.getShapeType(), shapeB.getShapeType());
  EXPECT_EQ(shapeA.getMargin(), shapeB.getMargin());
  if (shapeA.getShapeType() != STATIC_PLANE_PROXYTYPE) {
    btVector3 lower[2], upper[2];
    shapeA.getAabb(a.getWorldTransform(), lower[0], upper[0]);
    shapeB.getAabb(b.getWorldTransform(), lower[1], upper[1]);
    // Convex shapes with implicit dimensions come back within rounding of their margin.
    EXPECT_LT((lower[0] - lower[1]).length() + (upper[0] - upper[1]).length(), 1e-5);
  }
  EXPECT_EQ(a.getInvMass(), b.getInvMass());
  EXPECT_LT((a.getInvInertiaDiagLocal() - b.getInvInertiaDiagLocal()).length(), 1e-5);
  EXPECT_EQ(a.getWorldTransform().getOrigin(), b.getWorldTransform().getOrigin());
  EXPECT_EQ(a.getWorldTransform().getBasis(), b.getWorldTransform().getBasis());
  EXPECT_EQ(a.getFriction(), b.getFriction());
  EXPECT_EQ(a.getRestitution(), b.getRestitution());
  EXPECT_EQ(a.getLinearFactor(), b.getLinearFactor());
  EXPECT_EQ(a.getAngularFactor(), b.getAngularFactor());
}

TEST(BulletFile, NothingIsLost) {
  btCapsuleShape capsule(1, 2);
  btCylinderShape cylinder(btVector3(1, 2, 1));
  btConeShape cone(1, 2);
  btConvexHullShape hull;
  for (int i = 0; i < 8; ++i) hull.addPoint(btVector3(i & 1 ? 1 : -1, i & 2 ? 2 : -2, i & 4 ? 3 : -3));
  const btVector3 centres[] = {btVector3(0, 0, 0), btVector3(1, 0, 0)};
  const btScalar radii[] = {1, 0.5f};
  btMultiSphereShape spheres(centres, radii, 2);
  btCompoundShape compound;
  compound.addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(3, 0, 0)), &capsule);
  compound.addChildShape(btTransform(btQuaternion(0.3f, 0, 0), btVector3(-3, 0, 0)), &cylinder);
  btTriangleMesh triangles;
  triangles.addTriangle(btVector3(0, 0, 0), btVector3(5, 0, 0), btVector3(0, 1, 5));
  triangles.addTriangle(btVector3(5, 0, 0), btVector3(5, 2, 5), btVector3(0, 1, 5));
  btBvhTriangleMeshShape mesh(&triangles, true);
  btScaledBvhTriangleMeshShape scaled(&mesh, btVector3(2, 1, 3));

  WorldOf<btDiscreteDynamicsWorld> w;
  w.world.setGravity(btVector3(1, -9.81f, 2));
  w.world.getSolverInfo().m_numIterations = 17;
  w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), -5), btVector3(0, 0, 0));
  btScalar x = 0;
  for (btCollisionShape* shape :
       std::vector<btCollisionShape*>{w.objects.box(btVector3(1, 2, 3)), w.objects.sphere(2), &capsule, &cylinder,
                                      &cone, &hull, &spheres, &compound}) {
    btRigidBody* body = w.objects.add(2, shape, btTransform(btQuaternion(0.1f, 0.2f, 0.3f), btVector3(x += 10, 1, 2)));
    body->setFriction(0.3f);
    body->setRestitution(0.7f);
    body->setLinearFactor(btVector3(1, 1, 0));
    body->setAngularFactor(btVector3(0, 1, 1));
  }
  for (btCollisionShape* shape : std::vector<btCollisionShape*>{&mesh, &scaled}) {
    w.objects.add(0, shape, btVector3(x += 20, 0, 0));
  }
  btPoint2PointConstraint joint(*w.objects.bodies()[1], *w.objects.bodies()[2], btVector3(5, 0, 0),
                                btVector3(-5, 0, 0));
  w.world.addConstraint(&joint);

  const TemporaryFolder folder;
  const std::string path = folder.file("all.bullet");
  writeFile(path, serialized(w.world));
  Stock built(tool::builderOfFile(path));
  const btDiscreteDynamicsWorld& world = built.world();
  ASSERT_EQ(world.getNumCollisionObjects(), w.world.getNumCollisionObjects());
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    SCOPED_TRACE(i);
    expectSameBody(*btRigidBody::upcast(w.world.getCollisionObjectArray()[i]),
                   *btRigidBody::upcast(world.getCollisionObjectArray()[i]));
  }
  EXPECT_EQ(world.getNumConstraints(), 1);
  EXPECT_EQ(world.getGravity(), w.world.getGravity());
  EXPECT_EQ(built.world().getSolverInfo().m_numIterations, 17);
  w.world.removeConstraint(&joint);
}

// Each world is built from the same bytes: one step is the same in all.
TEST(BulletFile, EachBuildIsTheSame) {
  const tool::Builder build = tool::builderOfFile(BTGPU_SOURCE_DIR "/samples/scenes/mixed.bullet");
  Stock a(build), b(build);
  ASSERT_EQ(a.world().getNumCollisionObjects(), 65);
  for (Stock* s : {&a, &b}) {
    for (int step = 0; step < 30; ++step) s->world().stepSimulation(1.0f / 60, 0);
  }
  for (int i = 0; i < 65; ++i) {
    EXPECT_EQ(a.world().getCollisionObjectArray()[i]->getWorldTransform(),
              b.world().getCollisionObjectArray()[i]->getWorldTransform());
  }
}

// Reading from a pipe would wait for ever.
TEST(BulletFile, PipesAndFoldersAreNoFiles) {
  const TemporaryFolder folder;
  const std::string pipe = folder.file("pipe.bullet");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(tool::builderOfFile(pipe), tool::InputError);
  EXPECT_THROW(tool::builderOfFile(folder.path().string()), tool::InputError);
  EXPECT_THROW(tool::builderOfFile(folder.file("none.bullet")), tool::InputError);
}

}  // namespace
}  // namespace btgpu::test
