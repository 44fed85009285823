// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Poses in a float of their own region, far from the origin of a double world.
#include <limits>

#include "tests/translation/reader_world.h"
#include "translation/write_back_bodies.h"

namespace btgpu::test {
namespace {

[[maybe_unused]] constexpr double kGrid = 1024;  // WorldReader::chooseRegion

// Around (far, 100, -2 far), one unit apart.
struct FarBodies : ReaderWorld {
  explicit FarBodies(double far) {
    for (int i = 0; i < 5; ++i) bodies.push_back(add(1, box, btVector3(s(far + 3 * i), s(100 + i / 7.0), s(-2 * far))));
  }
  btBoxShape* box = shape<btBoxShape>(btVector3(s(0.5), s(0.5), s(0.5)));
  std::vector<btRigidBody*> bodies;
};

void expectOrigin(const ReaderWorld& w, double x, double y, double z) {
  EXPECT_EQ(w.reader.input().regionOrigin[0], x);
  EXPECT_EQ(w.reader.input().regionOrigin[1], y);
  EXPECT_EQ(w.reader.input().regionOrigin[2], z);
}

TEST(Region, NearTheOriginItIsTheOrigin) {
  FarBodies w(0);
  w.step();
  expectOrigin(w, 0, 0, 0);
}

#ifdef BT_USE_DOUBLE_PRECISION

TEST(Region, OriginIsTheGridPointNextToTheBodies) {
  for (const double far : {5e3, 1e6, 1e9, -3e7}) {
    SCOPED_TRACE(far);
    FarBodies w(far);
    w.step();
    expectOrigin(w, std::round((far + 6) / kGrid) * kGrid, 0, std::round(-2 * far / kGrid) * kGrid);
    // Half a grid length at most: floats there are 3e-5 apart (ulp(512) = 2^-14).
    for (const BodyPose& pose : w.device.poses.values) {
      EXPECT_LE(std::fabs(pose.position.x), kGrid);
      EXPECT_LE(std::fabs(pose.position.z), kGrid / 2);
    }
    const double distance = double(w.device.poses.values[4].position.x) - double(w.device.poses.values[0].position.x);
    EXPECT_EQ(distance, 12) << "bodies one float apart in the world would be at distance 0 or 64";
  }
}

// Static bodies alone choose nothing: the level may be anywhere. When the first moving bodies come, all poses
// go up.
TEST(Region, ChosenWhenTheFirstMovingBodiesCome) {
  ReaderWorld w;
  auto* box = w.shape<btBoxShape>(btVector3(1, 1, 1));
  w.add(0, box, btVector3(s(1e6), 0, 0));
  w.step();
  expectOrigin(w, 0, 0, 0);
  btRigidBody* moving = w.add(1, box, btVector3(s(1e6 + 0.125), 5, 0));
  EXPECT_EQ(w.step().at("poses"), (Slots{0, 1}));
  expectOrigin(w, std::round(1e6 / kGrid) * kGrid, 0, 0);
  EXPECT_EQ(w.device.poses.values[1].position.x - w.device.poses.values[0].position.x, 0.125f);
  // What stays within the region moves nothing; the level may be anywhere.
  moving->getWorldTransform().setOrigin(btVector3(s(1e6 + 8000), 0, 0));
  w.add(0, box, btVector3(s(-1e7), 0, 0));
  EXPECT_EQ(w.step().at("poses"), (Slots{1, 2}));
  expectOrigin(w, std::round(1e6 / kGrid) * kGrid, 0, 0);
  w.reader.clear();
  w.device = WorldInput();
  w.step();
  expectOrigin(w, std::round((1e6 + 8000) / kGrid) * kGrid, 0, 0);
}

// A body that leaves the region takes it along.
TEST(Region, FollowsTheBodies) {
  FarBodies w(0);
  w.step();
  for (btRigidBody* body : w.bodies) body->getWorldTransform().getOrigin() += btVector3(s(1e6), 0, 0);
  EXPECT_EQ(w.step().at("poses"), (Slots{0, 1, 2, 3, 4}));
  expectOrigin(w, std::round(1e6 / kGrid) * kGrid, 0, 0);
  EXPECT_EQ(w.step(), Upload{});
}

// Farther apart than a region is wide: not for the device, and said by name; together again they are.
TEST(Region, BodiesFarApart) {
  FarBodies w(0);
  w.step();
  EXPECT_TRUE(w.missing.empty());
  w.bodies[3]->getWorldTransform().setOrigin(btVector3(s(2e4), 0, 0));
  w.read();
  ASSERT_EQ(w.missing.entries().size(), 1u);
  EXPECT_EQ(w.missing.entries()[0].what, "bodies far apart");
  w.bodies[3]->getWorldTransform().setOrigin(btVector3(s(1e4), 0, 0));
  w.step();
  EXPECT_TRUE(w.missing.empty());
  expectOrigin(w, std::round(5e3 / kGrid) * kGrid, 0, 0);
}

TEST(Region, BodiesThatAreNotFiniteDoNotCount) {
  FarBodies w(1e6);
  btRigidBody* bad = w.bodies[2];
  const btVector3 place = bad->getWorldTransform().getOrigin();
  bad->getWorldTransform().setOrigin(btVector3(std::numeric_limits<btScalar>::quiet_NaN(), 0, 0));
  w.step();
  expectOrigin(w, std::round(1e6 / kGrid) * kGrid, 0, std::round(-2e6 / kGrid) * kGrid);
  EXPECT_TRUE(w.quarantined(bad));
  bad->getWorldTransform().setOrigin(place);
  EXPECT_EQ(w.step().at("poses"), (Slots{2}));
  EXPECT_FALSE(w.quarantined(bad));
}

TEST(Region, NoFiniteBodyChoosesNone) {
  ReaderWorld w;
  btRigidBody* body = w.add(1, w.shape<btSphereShape>(s(1)), btVector3(0, 0, 0));
  body->getWorldTransform().setOrigin(btVector3(0, std::numeric_limits<btScalar>::infinity(), 0));
  w.step();
  expectOrigin(w, 0, 0, 0);
  body->getWorldTransform().setOrigin(btVector3(0, s(1e6), 0));
  w.step();
  expectOrigin(w, 0, std::round(1e6 / kGrid) * kGrid, 0);
}

// What comes back is the origin plus the device's float, in double; who did not move keeps every bit.
TEST(Region, WriteBackIsExact) {
  FarBodies w(1e9);
  w.read();
  const double x = double(w.bodies[0]->getWorldTransform().getOrigin().x());
  const btTransform resting = w.bodies[1]->getWorldTransform();
  StepResults results = w.unchangedResults();
  results.poses[0].position.x += 0.0625f;
  writeBackBodies(w.reader, results, s(1.0 / 60));
  w.reader.acceptResults(results);
  w.device.poses.values = results.poses;
  EXPECT_EQ(double(w.bodies[0]->getWorldTransform().getOrigin().x()), x + 0.0625);
  EXPECT_TRUE(sameBytes(w.bodies[1]->getWorldTransform().getOrigin(), resting.getOrigin()));
  EXPECT_EQ(w.step(), Upload{});
}

#else

TEST(Region, FloatWorldsCountFromTheirOwnOrigin) {
  FarBodies w(1e6);
  w.step();
  expectOrigin(w, 0, 0, 0);
  EXPECT_EQ(w.device.poses.values[1].position.x, 1000003.0f);
}

#endif

}  // namespace
}  // namespace btgpu::test
