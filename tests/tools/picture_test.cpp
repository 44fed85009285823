// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The report's pictures: every shape is drawn where it is, and the picture is as large, opaque and stable as it says.
#include "tools/btgpu/report/picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/world_of.h"
#include "tools/btgpu/report/shape_mesh.h"

namespace btgpu::test {
namespace {

using namespace tool;

constexpr int kWidth = 96, kHeight = 64;

int alphaAt(const Image& image, int x, int y) { return image.rgba[static_cast<size_t>(4 * (y * image.width + x) + 3)]; }

int opaquePixels(const Image& image) {
  int count = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) count += alphaAt(image, x, y) > 250;
  }
  return count;
}

struct Pictured : WorldOf<btDiscreteDynamicsWorld> {
  Pictured() { world.setGravity(btVector3(0, -10, 0)); }
  Camera camera() const { return cameraFor({&world}, kWidth, kHeight); }
  Image draw() const { return drawWorld(world, camera(), kWidth, kHeight); }
};

TEST(Picture, OneBoxInTheMiddle) {
  Pictured w;
  w.objects.add(1, w.objects.box(btVector3(1, 1, 1)), btVector3(3, 4, 5));
  const Image image = w.draw();
  ASSERT_EQ(image.rgba.size(), size_t(4 * kWidth * kHeight));
  EXPECT_EQ(alphaAt(image, kWidth / 2, kHeight / 2), 255);
  EXPECT_EQ(alphaAt(image, 0, 0), 0);
  EXPECT_EQ(alphaAt(image, kWidth - 1, kHeight - 1), 0);
  // The bounding sphere fills the height but for the margin; the box about 40 % of a disc of 59 pixels.
  EXPECT_GT(opaquePixels(image), 700);
  EXPECT_LT(opaquePixels(image), 59 * 59);
}

TEST(Picture, EmptyWorldIsEmpty) {
  Pictured w;
  EXPECT_EQ(opaquePixels(w.draw()), 0);
}

TEST(Picture, SameWorldSamePixels) {
  Pictured a, b;
  for (Pictured* w : {&a, &b}) scenes::find("mixed")->build(w->objects, {3, 3, 3});
  const Image first = a.draw();
  EXPECT_GT(opaquePixels(first), 500);
  EXPECT_EQ(first.rgba, b.draw().rgba);
  b.objects.bodies().back()->getWorldTransform().getOrigin() += btVector3(0, 1, 0);
  EXPECT_NE(first.rgba, drawWorld(b.world, a.camera(), kWidth, kHeight).rgba);
}

// A body that flew away does not make the others small.
TEST(Picture, StraysAreNotLookedAt) {
  Pictured w;
  scenes::find("stack")->build(w.objects, {5, 5, 5});
  const btScalar radius = w.camera().radius;
  w.objects.bodies().back()->getWorldTransform().getOrigin() = btVector3(1e9f, 0, 0);
  EXPECT_LT(w.camera().radius, 1.2f * radius);
  EXPECT_GT(opaquePixels(w.draw()), 500);
}

TEST(Picture, BodiesThatAreNotFiniteAreLeftOut) {
  Pictured w;
  w.objects.add(1, w.objects.sphere(1), btVector3(0, 0, 0));
  w.objects.add(1, w.objects.sphere(1), btVector3(std::numeric_limits<float>::quiet_NaN(), 0, 0));
  EXPECT_GT(opaquePixels(w.draw()), 500);
}

// Triangles of each of Bullet's shapes: finite, and as large as the shape's bounds.
TEST(ShapeMesh, FillsTheBounds) {
  btBoxShape box(btVector3(1, 2, 3));
  btSphereShape sphere(2);
  btCapsuleShape capsule(1, 2);
  btCylinderShape cylinder(btVector3(1, 2, 1));
  btConeShape cone(1, 2);
  btConvexHullShape hull;
  for (int i = 0; i < 8; ++i) hull.addPoint(btVector3(i & 1 ? 1 : -1, i & 2 ? 2 : -2, i & 4 ? 3 : -3));
  hull.setMargin(0);
  btCompoundShape compound;
  compound.addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(3, 0, 0)), &box);
  compound.addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(-3, 0, 0)), &sphere);
  btTriangleMesh triangles;
  triangles.addTriangle(btVector3(0, 0, 0), btVector3(5, 0, 0), btVector3(0, 1, 5));
  btBvhTriangleMeshShape mesh(&triangles, true);
  for (const btCollisionShape* shape :
       std::vector<const btCollisionShape*>{&box, &sphere, &capsule, &cylinder, &cone, &hull, &compound, &mesh}) {
    SCOPED_TRACE(shape->getName());
    const std::vector<Corner> corners = meshOf(*shape, 3, 0, btVector3(0, 0, 0));
    ASSERT_GE(corners.size(), 3u);
    EXPECT_EQ(corners.size() % 3, 0u);
    btVector3 lower = corners[0].position, upper = lower, boundLower, boundUpper;
    for (const Corner& c : corners) {
      lower.setMin(c.position);
      upper.setMax(c.position);
      ASSERT_NEAR(c.normal.length(), 1, 1e-4);
    }
    shape->getAabb(btTransform::getIdentity(), boundLower, boundUpper);
    for (int axis = 0; axis < 3; ++axis) {
      // Bounds include margins of 0.04 and more; round shapes are cut into 256 directions.
      EXPECT_NEAR(lower[axis], boundLower[axis], 0.15) << axis;
      EXPECT_NEAR(upper[axis], boundUpper[axis], 0.15) << axis;
    }
  }
}

TEST(ShapeMesh, PlaneLiesWhereItIs) {
  const btStaticPlaneShape plane(btVector3(0, 1, 0), 2);
  const std::vector<Corner> corners = meshOf(plane, 1, 10, btVector3(7, 5, 3));
  ASSERT_EQ(corners.size(), 6u);
  for (const Corner& c : corners) {
    EXPECT_NEAR(c.position.y(), 2, 1e-5);
    EXPECT_NEAR(std::fabs(c.position.x() - 7), 10, 1e-4);
    EXPECT_NEAR(std::fabs(c.position.z() - 3), 10, 1e-4);
  }
}

}  // namespace
}  // namespace btgpu::test
