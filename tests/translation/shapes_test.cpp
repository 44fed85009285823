// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Shapes are read anew in each step, since applications change them after they were added; what the device
// lacks is named.
#include <BulletCollision/CollisionShapes/btBox2dShape.h>
#include <BulletCollision/CollisionShapes/btConvex2dShape.h>
#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btMinkowskiSumShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>

#include <cmath>
#include <limits>
#include <new>

#include "gpu_engine/stages/shape_bounds.h"
#include "tests/convex/shape_kinds.h"
#include "tests/translation/reader_world.h"

namespace btgpu::test {
namespace {

const Shape& shapeOf(const ReaderWorld& w, const btCollisionObject* object) {
  return w.device.shapes.values.at(static_cast<size_t>(w.device.infos.values[w.slot(object)].shapeIndex));
}

TEST(Shapes, Values) {
  ReaderWorld w;
  btRigidBody* box = w.add(1, w.shape<btBoxShape>(btVector3(1, 2, 4)), btVector3(0, 0, 0));
  btRigidBody* ball = w.add(1, w.shape<btSphereShape>(s(0.75)), btVector3(9, 0, 0));
  btRigidBody* plane = w.add(0, w.shape<btStaticPlaneShape>(btVector3(0, 0, 1), s(-1.5)), btVector3(0, 0, 0));
  box->getCollisionShape()->setMargin(s(0.25));
  w.step();
  EXPECT_EQ(shapeOf(w, box).type, SHAPE_BOX);
  EXPECT_EQ(shapeOf(w, box).extents.x, 1);
  EXPECT_EQ(shapeOf(w, box).extents.y, 2);
  EXPECT_EQ(shapeOf(w, box).extents.z, 4);
  EXPECT_EQ(shapeOf(w, box).margin, 0.25f);
  EXPECT_EQ(shapeOf(w, ball).type, SHAPE_SPHERE);
  EXPECT_EQ(shapeOf(w, ball).extents.x, 0.75f);
  EXPECT_EQ(shapeOf(w, ball).margin, 0.75f);
  EXPECT_EQ(shapeOf(w, plane).type, SHAPE_PLANE);
  EXPECT_EQ(shapeOf(w, plane).extents.z, 1);
  EXPECT_EQ(shapeOf(w, plane).extents.w, -1.5f);
}

// In proportion to the shape (btCollisionShape::getContactBreakingThreshold), or as it is.
TEST(Shapes, BreakingThreshold) {
  FourBodies w;
  const float relative = static_cast<float>(w.box->getContactBreakingThreshold(gContactBreakingThreshold));
  EXPECT_EQ(shapeOf(w, w.bodies[0]).breakingThreshold, relative);
  ASSERT_NE(relative, static_cast<float>(gContactBreakingThreshold));
  w.dispatcher.setDispatcherFlags(w.dispatcher.getDispatcherFlags() &
                                  ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
  EXPECT_EQ(w.step(), (Upload{{"shapes", {0, 1}}}));
  EXPECT_EQ(shapeOf(w, w.bodies[0]).breakingThreshold, static_cast<float>(gContactBreakingThreshold));
  EXPECT_EQ(w.step(), Upload{});
}

TEST(Shapes, ScalingUploadsTheShapeAlone) {
  FourBodies w;
  w.box->setLocalScaling(btVector3(2, 4, 8));
  EXPECT_EQ(w.step(), (Upload{{"shapes", {0}}}));
  EXPECT_FLOAT_EQ(shapeOf(w, w.bodies[1]).extents.x, 1);
  EXPECT_FLOAT_EQ(shapeOf(w, w.bodies[1]).extents.y, 2);
  EXPECT_FLOAT_EQ(shapeOf(w, w.bodies[1]).extents.z, 4);
  w.ball->setLocalScaling(btVector3(2, 2, 2));
  EXPECT_EQ(w.step(), (Upload{{"shapes", {1}}}));
  EXPECT_EQ(shapeOf(w, w.bodies[3]).extents.x, 0.5f);
  w.ball->setUnscaledRadius(3);
  EXPECT_EQ(w.step(), (Upload{{"shapes", {1}}}));
  w.box->setMargin(s(0.01));
  EXPECT_EQ(w.step(), (Upload{{"shapes", {0}}}));
  w.box->setUserPointer(&w);
  EXPECT_EQ(w.step(), Upload{});
}

TEST(Shapes, ReplacedByAKnownAndByANewOne) {
  FourBodies w;
  w.bodies[2]->setCollisionShape(w.ball);
  EXPECT_EQ(w.step(), (Upload{{"infos", {2}}}));
  EXPECT_EQ(shapeOf(w, w.bodies[2]).type, SHAPE_SPHERE);
  w.bodies[2]->setCollisionShape(w.shape<btBoxShape>(btVector3(7, 7, 7)));
  EXPECT_EQ(w.step(), (Upload{{"infos", {2}}, {"shapes", {2}}}));
  EXPECT_EQ(shapeOf(w, w.bodies[2]).extents.x, 7);
}

// A shape that was deleted, and another one, of another kind, at its address.
TEST(Shapes, AnotherShapeAtTheSameAddress) {
  ReaderWorld w;
  alignas(16) unsigned char memory[sizeof(btBoxShape) + sizeof(btSphereShape)];
  btCollisionShape* shape = new (memory) btBoxShape(btVector3(1, 1, 1));
  btRigidBody* body = w.add(1, shape, btVector3(0, 0, 0));
  w.step();
  shape->~btCollisionShape();
  shape = new (memory) btSphereShape(s(0.5));
  body->setCollisionShape(shape);
  EXPECT_EQ(w.step(), (Upload{{"shapes", {0}}}));
  EXPECT_EQ(shapeOf(w, body).type, SHAPE_SPHERE);
  w.world.removeRigidBody(body);
}

class OwnSphere : public btSphereShape {
 public:
  using btSphereShape::btSphereShape;
};

// Each kind is named once a step, however many bodies have it, and is gone when the last one is.
TEST(Shapes, WhatTheDeviceLacksGoesToTheHostByName) {
  FourBodies w;
  auto* compound = w.shape<btCompoundShape>();
  compound->addChildShape(btTransform::getIdentity(), w.shape<OwnSphere>(s(1)));
  auto* own = w.shape<OwnSphere>(s(1));
  auto* sum = w.shape<btMinkowskiSumShape>(w.shape<btConeShape>(s(1), s(1)), own);
  w.bodies[0]->setCollisionShape(compound);
  w.bodies[1]->setCollisionShape(sum);
  w.bodies[2]->setCollisionShape(compound);
  btRigidBody* fresh = w.add(1, own, btVector3(0, 9, 0));
  w.bodies[3]->setFriction(s(0.125));
  for (int i = 0; i < 2; ++i) {
    w.read();
    EXPECT_EQ(w.hostText(), "Compound shape\nMinkowskiSum shape\nSPHERE shape\n");
    EXPECT_TRUE(w.missing.empty()) << w.missingText();
    EXPECT_EQ(shapeOf(w, w.bodies[1]).type, SHAPE_HOST);
    EXPECT_TRUE(w.reader.slots()[0].onHost);
    EXPECT_FALSE(w.reader.slots()[3].onHost);
  }
  EXPECT_EQ(w.device.materials.values[3].friction, 0.125f) << "the others are read nevertheless";

  w.bodies[0]->setCollisionShape(w.box);
  w.bodies[2]->setCollisionShape(w.ball);
  w.read();
  EXPECT_EQ(w.hostText(), "MinkowskiSum shape\nSPHERE shape\n");
  EXPECT_TRUE(w.reader.hostBodiesChanged());
  w.bodies[1]->setCollisionShape(w.box);
  w.world.removeRigidBody(fresh);
  w.step();
  EXPECT_EQ(w.hostText(), "");
  EXPECT_EQ(shapeOf(w, w.bodies[2]).type, SHAPE_SPHERE);
  EXPECT_EQ(w.step(), Upload{});
}

// What is taken away is mirrored; margins add up, and those of multi-spheres are part of their radii.
TEST(Shapes, SumsAreListsOfTerms) {
  ReaderWorld w;
  const btVector3 at[] = {btVector3(1, 0, 0), btVector3(0, 1, 0)};
  const btScalar radii[] = {s(0.5), s(0.75)};
  auto* cone = w.shape<btConeShape>(s(0.5), s(2));
  auto* spheres = w.shape<btMultiSphereShape>(at, radii, 2);
  auto* sum = w.shape<btMinkowskiSumShape>(spheres, cone);
  cone->setMargin(s(0.125));
  sum->setTransformA(btTransform(btQuaternion::getIdentity(), btVector3(3, 0, 0)));
  sum->setTransformB(btTransform(btQuaternion::getIdentity(), btVector3(0, 2, 0)));
  btRigidBody* body = w.add(1, sum, btVector3(0, 0, 0));
  w.step();
  EXPECT_EQ(w.hostText(), "");
  const Shape& shape = shapeOf(w, body);
  EXPECT_EQ(shape.type, SHAPE_SUM);
  EXPECT_FLOAT_EQ(shape.margin, 0.125f);
  const std::vector<float4> expected = {
      {3, -2, 0, 0}, {0, 0, 0, 1}, {SHAPE_MULTI_SPHERE, 2, 0, 0}, {1, 0, 0, 0.5f}, {0, 1, 0, 0.75f},
      {1, 1, 1, 0},  {0, 0, 0, 1}, {SHAPE_CONE, 1, 0.5f, -1}};
  ASSERT_EQ(shape.vertexCount, static_cast<int>(expected.size()));
  for (size_t k = 0; k < expected.size(); ++k) {
    const float4 v = w.reader.input().hulls.vertices[static_cast<size_t>(shape.firstVertex) + k];
    EXPECT_TRUE(v.x == expected[k].x && v.y == expected[k].y && v.z == expected[k].z && v.w == expected[k].w)
        << k << ": " << v.x << " " << v.y << " " << v.z << " " << v.w;
  }
}

// What becomes of those on bodies that could move: compat/settings.
TEST(Shapes, PlanesOnBodiesOfAnyKind) {
  FourBodies w;
  w.bodies[0]->setCollisionShape(w.shape<btStaticPlaneShape>(btVector3(0, 1, 0), 0));
  w.read();
  EXPECT_TRUE(w.missing.empty()) << w.missingText();
  EXPECT_EQ(shapeOf(w, w.bodies[0]).type, SHAPE_PLANE);
  w.bodies[0]->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  w.step();
  EXPECT_TRUE(w.missing.empty()) << w.missingText();
}

btConvexHullShape* cube(ReaderWorld& w, double half) {
  auto* hull = w.shape<btConvexHullShape>();
  for (int i = 0; i < 8; ++i) {
    hull->addPoint(btVector3(s(i & 1 ? half : -half), s(i & 2 ? half : -half), s(i & 4 ? half : -half)));
  }
  return hull;
}

TEST(Shapes, Capsules) {
  ReaderWorld w;
  btRigidBody* x = w.add(1, w.shape<btCapsuleShapeX>(s(0.5), s(3)), btVector3(0, 0, 0));
  btRigidBody* y = w.add(1, w.shape<btCapsuleShape>(s(0.25), s(1)), btVector3(9, 0, 0));
  btRigidBody* z = w.add(1, w.shape<btCapsuleShapeZ>(s(0.5), s(2)), btVector3(18, 0, 0));
  w.step();
  for (const btRigidBody* body : {x, y, z}) EXPECT_EQ(shapeOf(w, body).type, SHAPE_CAPSULE);
  EXPECT_EQ(shapeOf(w, x).extents.x, 1.5f);
  EXPECT_EQ(shapeOf(w, x).extents.y, 0);
  EXPECT_EQ(shapeOf(w, x).margin, 0.5f);
  EXPECT_EQ(shapeOf(w, y).extents.y, 0.5f);
  EXPECT_EQ(shapeOf(w, y).margin, 0.25f);
  EXPECT_EQ(shapeOf(w, z).extents.z, 1);
  y->getCollisionShape()->setLocalScaling(btVector3(2, 4, 2));
  EXPECT_EQ(w.step(), (Upload{{"shapes", {1}}}));
  EXPECT_EQ(shapeOf(w, y).extents.y, 2);
  EXPECT_EQ(shapeOf(w, y).margin, 0.5f);
}

TEST(Shapes, Hulls) {
  ReaderWorld w;
  btConvexHullShape* small = cube(w, 0.5);
  btConvexHullShape* large = cube(w, 2);
  btRigidBody* a = w.add(1, small, btVector3(0, 0, 0));
  btRigidBody* b = w.add(1, large, btVector3(9, 0, 0));
  w.step();
  const HullArrays& hulls = w.reader.input().hulls;
  EXPECT_EQ(shapeOf(w, a).type, SHAPE_HULL);
  EXPECT_EQ(shapeOf(w, a).vertexCount, 8);
  EXPECT_EQ(shapeOf(w, a).faceCount, 6);
  EXPECT_EQ(shapeOf(w, a).edgeCount, 12);
  EXPECT_FLOAT_EQ(shapeOf(w, a).margin, 0.04f);
  EXPECT_FLOAT_EQ(shapeOf(w, a).extents.x, 0.58f) << "the margin twice, as in Bullet's AABB";
  EXPECT_EQ(shapeOf(w, b).firstVertex, 8);
  EXPECT_EQ(hulls.vertices.size(), 16u);
  EXPECT_EQ(std::fabs(hulls.vertices[8].x), 2);
  EXPECT_EQ(small->getConvexPolyhedron(), nullptr) << "the application's shape is left alone";

  // Nothing is built again unless something changed: points, scaling, margin.
  EXPECT_EQ(w.step(), Upload{});
  EXPECT_FALSE(hulls.changed);
  small->setMargin(s(0.125));
  EXPECT_EQ(w.step(), (Upload{{"shapes", {0}}}));
  EXPECT_EQ(shapeOf(w, a).margin, 0.125f);
  EXPECT_EQ(hulls.vertices.size(), 16u);
  small->setLocalScaling(btVector3(2, 1, 1));
  EXPECT_EQ(w.step(), (Upload{{"shapes", {0}}}));
  EXPECT_EQ(std::fabs(hulls.vertices[static_cast<size_t>(shapeOf(w, a).firstVertex)].x), 1);
  small->addPoint(btVector3(0, 3, 0));
  EXPECT_EQ(w.step(), (Upload{{"shapes", {0}}}));
  EXPECT_EQ(shapeOf(w, a).vertexCount, 9);
  small->getUnscaledPoints()[8] = btVector3(0, 4, 0);  // without a word to the shape
  EXPECT_EQ(w.step(), (Upload{{"shapes", {0}}}));
  EXPECT_EQ(hulls.vertices[static_cast<size_t>(shapeOf(w, b).firstVertex)].w, 0);
}

// What went away makes room again, and the others' places move with it.
TEST(Shapes, ManyHullsOneAfterTheOther) {
  ReaderWorld w;
  btRigidBody* kept = w.add(1, cube(w, 2), btVector3(0, 0, 0));
  btRigidBody* changing = w.add(1, cube(w, 1), btVector3(9, 0, 0));
  for (int i = 0; i < 1500; ++i) {
    changing->getCollisionShape()->setLocalScaling(btVector3(s(1 + 0.001 * i), 1, 1));
    w.step();
    const HullArrays& hulls = w.reader.input().hulls;
    const Shape &k = shapeOf(w, kept), &c = shapeOf(w, changing);
    ASSERT_EQ(std::fabs(hulls.vertices[static_cast<size_t>(k.firstVertex + 7)].x), 2) << i;
    ASSERT_EQ(std::fabs(hulls.vertices[static_cast<size_t>(c.firstVertex + 7)].x),
              static_cast<float>(s(1 + 0.001 * i)));
    ASSERT_LT(hulls.corners[static_cast<size_t>(hulls.faces[static_cast<size_t>(c.firstFace)].firstCorner)], 8u);
    ASSERT_LE(hulls.vertices.size(), 8300u);
  }
}

TEST(Shapes, HullsWithoutPointsOrFiniteSize) {
  ReaderWorld w;
  btConvexHullShape* hull = w.shape<btConvexHullShape>();
  btRigidBody* body = w.add(1, hull, btVector3(0, 0, 0));
  w.step();
  EXPECT_EQ(w.hostText(), "");
  EXPECT_EQ(shapeOf(w, body).vertexCount, 1) << "of no points the origin is the farthest";
  hull->addPoint(btVector3(s(std::numeric_limits<double>::quiet_NaN()), 0, 0), false);
  w.read();
  EXPECT_EQ(w.missingText(), "Convex shape: its size is not finite\n");
  hull->getUnscaledPoints()[0] = btVector3(1, 2, 3);
  hull->recalcLocalAabb();
  w.step();
  EXPECT_TRUE(w.missing.empty()) << w.missingText();
  EXPECT_EQ(shapeOf(w, body).vertexCount, 1);
  btConvexHullShape* solid = cube(w, 1);
  body->setCollisionShape(solid);
  w.step();
  EXPECT_TRUE(w.missing.empty()) << w.missingText();
  EXPECT_EQ(w.hostText(), "");
  EXPECT_EQ(shapeOf(w, body).variant, 0);
  solid->initializePolyhedralFeatures();
  w.step();
  EXPECT_EQ(w.hostText(), "");
  EXPECT_EQ(shapeOf(w, body).variant, HULL_POLYHEDRAL) << "stock collides two of them without margins";
}

// In any pose, each kind as Bullet's own getAabb has it: the islands of a world are those of its AABBs.
TEST(Shapes, BoundsAreBullets) {
  RandomSource random(3);
  ShapeStore store;
  for (const ShapeKind& kind : convexKinds()) {
    for (int n = 0; n < 30; ++n) {
      ReaderWorld w;
      btCollisionShape* shape = kind.make(store, random, 1);
      const btQuaternion turn(scalarIn(random, -1, 1), scalarIn(random, -1, 1), scalarIn(random, -1, 1),
                              scalarIn(random, -1, 1));
      const btTransform pose(turn.normalized(), btVector3(1, 2, 3));
      btRigidBody* body = w.add(1, shape, btVector3(0, 0, 0));
      w.step();
      EXPECT_EQ(w.hostText(), "");
      if (shapeOf(w, body).type == SHAPE_SUM) continue;  // bounded by its box: read_shapes.cpp says why
      const btQuaternion q = pose.getRotation();
      const float4 orientation{float(q.x()), float(q.y()), float(q.z()), float(q.w())};
      const reference::Bounds ours = reference::shapeBounds(
          shapeOf(w, body), {1, 2, 3}, reference::rotationOf(orientation), w.reader.input().hulls.vertices);
      btVector3 lower, upper;
      shape->getAabb(pose, lower, upper);
      for (int k = 0; k < 3; ++k) {
        // Some ten roundings in float of what is at most 6.
        EXPECT_NEAR(ours.lower[k], double(lower[k]), 1e-5) << kind.name;
        EXPECT_NEAR(ours.upper[k], double(upper[k]), 1e-5) << kind.name;
      }
    }
  }
}

TEST(Shapes, CylindersAndCones) {
  ReaderWorld w;
  auto* cylinder = w.shape<btCylinderShapeX>(btVector3(2, 1, 1));
  auto* cone = w.shape<btConeShapeZ>(s(0.5), s(3));
  btRigidBody* lying = w.add(1, cylinder, btVector3(0, 0, 0));
  btRigidBody* pointed = w.add(1, cone, btVector3(9, 0, 0));
  w.step();
  EXPECT_EQ(w.hostText(), "");
  EXPECT_EQ(shapeOf(w, lying).type, SHAPE_CYLINDER);
  EXPECT_EQ(shapeOf(w, lying).variant, 0);
  const float margin = static_cast<float>(cylinder->getMargin());
  EXPECT_FLOAT_EQ(shapeOf(w, lying).margin, margin);
  EXPECT_FLOAT_EQ(shapeOf(w, lying).radius, 1 - margin);
  EXPECT_FLOAT_EQ(shapeOf(w, lying).halfLength, 2 - margin);
  EXPECT_FLOAT_EQ(shapeOf(w, lying).extents.x, 2);
  EXPECT_EQ(shapeOf(w, pointed).type, SHAPE_CONE);
  EXPECT_EQ(shapeOf(w, pointed).variant, 2);
  EXPECT_FLOAT_EQ(shapeOf(w, pointed).radius, 0.5f);
  EXPECT_FLOAT_EQ(shapeOf(w, pointed).halfLength, 1.5f);
  EXPECT_EQ(w.step(), Upload{});
  cylinder->setLocalScaling(btVector3(3, 2, 2));
  EXPECT_EQ(w.step(), (Upload{{"shapes", {0}}}));
  EXPECT_FLOAT_EQ(shapeOf(w, lying).radius, 2 - margin);
  EXPECT_FLOAT_EQ(shapeOf(w, lying).halfLength, 6 - margin);
  cone->setHeight(4);
  EXPECT_EQ(w.step(), (Upload{{"shapes", {1}}}));
  EXPECT_FLOAT_EQ(shapeOf(w, pointed).halfLength, 2);
}

// What Bullet collides as points with a margin around them, however they are called.
TEST(Shapes, PointsWithAMargin) {
  ReaderWorld w;
  std::vector<btVector3> cloud = {btVector3(1, 0, 0), btVector3(-1, 0, 0), btVector3(0, 1, 0), btVector3(0, 0, 1),
                                  btVector3(0, s(0.2), s(0.2))};
  btTriangleMesh mesh;
  mesh.addTriangle(cloud[0], cloud[1], cloud[2]);
  mesh.addTriangle(cloud[0], cloud[1], cloud[3]);
  auto* points = w.shape<btConvexPointCloudShape>(cloud.data(), 5, btVector3(2, 1, 1));
  auto* triangles = w.shape<btConvexTriangleMeshShape>(&mesh);
  auto* triangle = w.shape<btTriangleShape>(cloud[0], cloud[1], cloud[2]);
  auto* simplex = w.shape<btBU_Simplex1to4>(cloud[0], cloud[1], cloud[2], cloud[3]);
  auto* flat = w.shape<btBox2dShape>(btVector3(1, 2, s(0.1)));
  auto* inner = w.shape<btBoxShape>(btVector3(1, 2, 3));
  auto* scaled = w.shape<btUniformScalingShape>(inner, s(2));
  auto* hull2d = w.shape<btConvex2dShape>(cube(w, 1));
  auto* scaledBall = w.shape<btUniformScalingShape>(w.shape<btSphereShape>(s(0.5)), s(3));
  std::vector<btRigidBody*> bodies;
  for (btCollisionShape* shape :
       std::vector<btCollisionShape*>{points, triangles, triangle, simplex, flat, scaled, hull2d, scaledBall}) {
    bodies.push_back(w.add(1, shape, btVector3(s(9.0 * double(bodies.size())), 0, 0)));
  }
  w.step();
  EXPECT_EQ(w.hostText(), "");
  EXPECT_TRUE(w.missing.empty()) << w.missingText();
  const int vertices[] = {4, 4, 3, 4, 8, 8, 8, 1};
  for (size_t i = 0; i < bodies.size(); ++i) {
    EXPECT_EQ(shapeOf(w, bodies[i]).type, SHAPE_HULL) << i;
    EXPECT_EQ(shapeOf(w, bodies[i]).vertexCount, vertices[i]) << i;
    EXPECT_FLOAT_EQ(shapeOf(w, bodies[i]).margin, static_cast<float>(bodies[i]->getCollisionShape()->getMargin())) << i;
  }
  const HullArrays& hulls = w.reader.input().hulls;
  const auto firstVertex = [&](size_t i) {
    return hulls.vertices[static_cast<size_t>(shapeOf(w, bodies[i]).firstVertex)];
  };
  EXPECT_EQ(std::fabs(firstVertex(0).x), 2);
  EXPECT_FLOAT_EQ(std::fabs(firstVertex(5).z), static_cast<float>(2 * (3 - inner->getMargin())));
  EXPECT_EQ(w.step(), Upload{});
  // Changes are noticed wherever they are made.
  cloud[0].setX(3);
  EXPECT_EQ(w.step(), (Upload{{"shapes", {0}}}));
  mesh.setScaling(btVector3(1, 2, 1));
  EXPECT_EQ(w.step(), (Upload{{"shapes", {1}}}));
  triangle->m_vertices1[1].setY(5);
  EXPECT_EQ(w.step(), (Upload{{"shapes", {2}}}));
  inner->setLocalScaling(btVector3(1, 1, 2));
  EXPECT_EQ(w.step(), (Upload{{"shapes", {5}}}));
}

TEST(Shapes, Spheres) {
  ReaderWorld w;
  const btVector3 at[] = {btVector3(-1, 0, 0), btVector3(1, 0, 0), btVector3(0, 1, 0)};
  const btScalar even[] = {s(0.5), s(0.5), s(0.5)}, uneven[] = {s(0.5), s(0.75), s(0.5)};
  auto* one = w.shape<btMultiSphereShape>(at, even, 3);
  btRigidBody* rounded = w.add(1, one, btVector3(0, 0, 0));
  btRigidBody* spheres = w.add(1, w.shape<btMultiSphereShape>(at, uneven, 3), btVector3(9, 0, 0));
  btRigidBody* none = w.add(1, w.shape<btEmptyShape>(), btVector3(18, 0, 0));
  w.step();
  EXPECT_EQ(w.hostText(), "");
  EXPECT_EQ(shapeOf(w, rounded).type, SHAPE_HULL) << "a triangle with a wide margin";
  EXPECT_EQ(shapeOf(w, rounded).margin, 0.5f);
  EXPECT_EQ(shapeOf(w, rounded).vertexCount, 3);
  EXPECT_EQ(shapeOf(w, spheres).type, SHAPE_MULTI_SPHERE);
  EXPECT_EQ(shapeOf(w, spheres).margin, 0.5f);
  EXPECT_EQ(shapeOf(w, spheres).vertexCount, 3);
  EXPECT_EQ(shapeOf(w, none).type, SHAPE_NONE);
  const auto vertex = [&](int k) {
    return w.reader.input().hulls.vertices[static_cast<size_t>(shapeOf(w, spheres).firstVertex + k)];
  };
  EXPECT_EQ(vertex(0).w, 0);
  EXPECT_EQ(vertex(1).w, 0.25f);
  EXPECT_EQ(vertex(3).x, 1) << "not stretched";
  one->setLocalScaling(btVector3(1, 2, 1));
  EXPECT_EQ(w.step(), (Upload{{"shapes", {0}}}));
  EXPECT_EQ(shapeOf(w, rounded).type, SHAPE_MULTI_SPHERE) << "stretched";
  EXPECT_EQ(shapeOf(w, rounded).margin, 0);
}

TEST(Shapes, SizesThatAreNotFinite) {
  for (const double size :
       {double(std::numeric_limits<float>::quiet_NaN()), double(std::numeric_limits<float>::infinity())}) {
    FourBodies w;
    w.ball->setUnscaledRadius(s(size));
    w.read();
    EXPECT_EQ(w.missingText(), "SPHERE shape: its size is not finite\n");
    EXPECT_EQ(shapeOf(w, w.bodies[3]).extents.x, 0.25f) << "none of it goes up";
    w.ball->setUnscaledRadius(2);
    EXPECT_EQ(w.step(), (Upload{{"shapes", {1}}}));
  }
}

// An application that makes a shape for every shot: the table is as long as what is in use asks for.
TEST(Shapes, TableDoesNotGrowWithShapesThatWent) {
  FourBodies w;
  for (int i = 0; i < 1000; ++i) {
    btSphereShape shot(s(1 + 0.001 * i));
    w.bodies[i % 4]->setCollisionShape(&shot);
    w.step();
    EXPECT_EQ(shapeOf(w, w.bodies[i % 4]).extents.x, static_cast<float>(s(1 + 0.001 * i)));
    w.bodies[i % 4]->setCollisionShape(w.box);
    if (HasFailure()) return;
  }
  EXPECT_LE(w.reader.input().shapes.values.size(), 100u);

  std::vector<std::unique_ptr<btBoxShape>> many;
  for (int i = 0; i < 1000; ++i) {
    many.push_back(std::make_unique<btBoxShape>(btVector3(s(1 + i), 1, 1)));
    w.bodies[1]->setCollisionShape(many.back().get());
    w.step();
    if (HasFailure()) return;
  }
  // At most twice the shapes in use and 64, ShapeReader::end.
  EXPECT_LE(w.reader.input().shapes.values.size(), 100u);
  w.bodies[1]->setCollisionShape(w.box);
}

}  // namespace
}  // namespace btgpu::test
