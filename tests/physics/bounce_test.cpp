// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Balls with restitution rebound as stock's do.
#include <cmath>

#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

constexpr double kRestitutions[] = {0, 0.5, 0.9};

template <typename World>
struct Balls {
  WorldOf<World> w;
  std::vector<btRigidBody*> balls;
  std::vector<double> rebound;  // greatest height after the first contact

  explicit Balls(bool onBox) {
    w.world.setGravity(btVector3(0, -10, 0));
    btRigidBody* ground = onBox ? w.objects.add(0, w.objects.box(btVector3(50, 5, 50)), btVector3(0, -5, 0))
                                : w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    ground->setRestitution(1);
    btSphereShape* ball = w.objects.sphere(btScalar(0.5));
    for (const double restitution : kRestitutions) {
      balls.push_back(w.objects.add(1, ball, btVector3(btScalar(4.0 * double(balls.size())), btScalar(2.5), 0)));
      balls.back()->setRestitution(btScalar(restitution));
    }
    rebound.assign(balls.size(), 0);
  }
  void run(double timeStep) {
    std::vector<bool> touched(balls.size(), false);
    for (int i = 0; i < static_cast<int>(std::lround(1.5 / timeStep)); ++i) {
      w.run(1, timeStep);
      for (size_t b = 0; b < balls.size(); ++b) {
        if (balls[b]->getLinearVelocity().y() > btScalar(-0.1)) touched[b] = touched[b] || i > 2;
        if (touched[b]) rebound[b] = std::max(rebound[b], double(balls[b]->getWorldTransform().getOrigin().y()));
      }
    }
  }
};

class Bounce : public ::testing::TestWithParam<std::tuple<int, bool>> {};

TEST_P(Bounce, ReboundsAsStock) {
  const double timeStep = 1.0 / std::get<0>(GetParam());
  Balls<btGpuDynamicsWorld> gpu(std::get<1>(GetParam()));
  Balls<btDiscreteDynamicsWorld> stock(std::get<1>(GetParam()));
  gpu.run(timeStep);
  stock.run(timeStep);
  for (size_t b = 0; b < gpu.balls.size(); ++b) {
    EXPECT_NEAR(gpu.rebound[b], stock.rebound[b], 0.02 * stock.rebound[b]) << "restitution " << kRestitutions[b];
  }
  EXPECT_GT(stock.rebound[2], 1.0) << "the bouncy ball should have bounced";
  expectAllOnDevice(gpu.w.world);
}

std::string nameOf(const ::testing::TestParamInfo<std::tuple<int, bool>>& test) {
  return (std::get<1>(test.param) ? "Box" : "Plane") + std::to_string(std::get<0>(test.param));
}

INSTANTIATE_TEST_SUITE_P(Steps, Bounce, ::testing::Combine(::testing::Values(30, 60, 120, 240), ::testing::Bool()),
                         nameOf);

}  // namespace
}  // namespace btgpu::test
