// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Flat boxes on slopes below and above the angle of friction.
#include <cmath>

#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

constexpr double kSeconds = 5, kGravity = 10;

enum class Ground { Plane, Box };

// One flat box for each coefficient of friction from 0.1 to 1.0, each on a slope of its own, steep in proportion.
template <typename World>
struct Slopes {
  WorldOf<World> w;
  struct Slab {
    btRigidBody* body;
    btVector3 down;  // unit vector down the slope
    btVector3 start;
    double friction, angle;
  };
  std::vector<Slab> slabs;

  Slopes(double steepness, Ground kind) {
    w.world.setGravity(btVector3(0, btScalar(-kGravity), 0));
    btBoxShape* flat = w.objects.box(btVector3(btScalar(0.5), btScalar(0.1), btScalar(0.5)));
    for (int i = 1; i <= 10; ++i) {
      const double friction = 0.1 * i, angle = std::atan(steepness * friction);
      const btQuaternion tilt(btVector3(0, 0, 1), btScalar(-angle));
      // Far apart, so that slopes and sliding boxes don't meet; each slope collides with its own box only.
      const btVector3 origin(0, 0, btScalar(1000.0 * i));
      btCollisionShape* shape = nullptr;
      if (kind == Ground::Plane) {
        shape = w.objects.plane(btVector3(0, 1, 0), 0);
      } else {
        shape = w.objects.box(btVector3(400, 1, 2));
      }
      btRigidBody* ground = w.objects.add(0, shape, btTransform(tilt, origin));
      ground->setFriction(1);
      const btScalar height = btScalar(kind == Ground::Plane ? 0.1 : 1.1);
      Slab slab;
      slab.start = btTransform(tilt, origin) * btVector3(0, height, 0);
      slab.body = w.objects.add(1, flat, btTransform(tilt, slab.start));
      slab.body->setFriction(btScalar(friction));
      // Slow sliders would fall asleep after two seconds, which is not what this is about.
      slab.body->setActivationState(DISABLE_DEACTIVATION);
      slab.down = btMatrix3x3(tilt) * btVector3(1, 0, 0);
      slab.friction = friction;
      slab.angle = angle;
      setGroup(ground, i);
      setGroup(slab.body, i);
      slabs.push_back(slab);
    }
  }
  static void setGroup(btRigidBody* body, int i) {
    body->getBroadphaseProxy()->m_collisionFilterGroup = 1 << i;
    body->getBroadphaseProxy()->m_collisionFilterMask = 1 << i;
  }
  double slid(size_t i) const {
    return double((slabs[i].body->getWorldTransform().getOrigin() - slabs[i].start).dot(slabs[i].down));
  }
};

struct Case {
  double timeStep;
  Ground ground;
};

class Slope : public ::testing::TestWithParam<Case> {};

TEST_P(Slope, HoldsBelowTheAngleOfFriction) {
  Slopes<btGpuDynamicsWorld> gpu(0.8, GetParam().ground);
  Slopes<btDiscreteDynamicsWorld> stock(0.8, GetParam().ground);
  const int steps = static_cast<int>(std::lround(kSeconds / GetParam().timeStep));
  gpu.w.run(steps, GetParam().timeStep);
  stock.w.run(steps, GetParam().timeStep);
  for (size_t i = 0; i < gpu.slabs.size(); ++i) {
    // Stock creeps up to 7 mm at large steps; ours by the same amount, within rounding.
    EXPECT_LE(std::fabs(gpu.slid(i)), std::max(1e-3, 1.001 * std::fabs(stock.slid(i))))
        << "friction " << gpu.slabs[i].friction;
  }
  expectAllOnDevice(gpu.w.world);
}

TEST_P(Slope, SlidesAboveTheAngleOfFriction) {
  Slopes<btGpuDynamicsWorld> gpu(1.3, GetParam().ground);
  Slopes<btDiscreteDynamicsWorld> stock(1.3, GetParam().ground);
  const int steps = static_cast<int>(std::lround(kSeconds / GetParam().timeStep));
  gpu.w.run(steps, GetParam().timeStep);
  stock.w.run(steps, GetParam().timeStep);
  for (size_t i = 0; i < gpu.slabs.size(); ++i) {
    const auto& s = gpu.slabs[i];
    const double theory = 0.5 * kGravity * (std::sin(s.angle) - s.friction * std::cos(s.angle)) * kSeconds * kSeconds;
    const double ours = gpu.slid(i), theirs = stock.slid(i);
    const bool asTheory = std::fabs(ours - theory) <= 0.03 * theory;
    const bool asStock = std::fabs(ours - theirs) <= 0.03 * theirs;
    EXPECT_TRUE(asTheory || asStock) << "friction " << s.friction << ": slid " << ours << ", theory " << theory
                                     << ", stock " << theirs;
  }
  expectAllOnDevice(gpu.w.world);
}

std::vector<Case> cases() {
  std::vector<Case> list;
  for (const double step : {1.0 / 30, 1.0 / 60, 1.0 / 120, 1.0 / 240}) {
    for (const Ground ground : {Ground::Plane, Ground::Box}) list.push_back({step, ground});
  }
  return list;
}

std::string nameOf(const ::testing::TestParamInfo<Case>& test) {
  return (test.param.ground == Ground::Plane ? "Plane" : "Box") + std::to_string(std::lround(1 / test.param.timeStep));
}

INSTANTIATE_TEST_SUITE_P(Steps, Slope, ::testing::ValuesIn(cases()), nameOf);

}  // namespace
}  // namespace btgpu::test
