// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Joints of the application's own classes, in a program that is optimized and hides its inline functions
// (tests/CMakeLists.txt), so that it has copies of its own of those of Bullet's headers.
#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

class Marked : public btPoint2PointConstraint {
 public:
  using btPoint2PointConstraint::btPoint2PointConstraint;
  int mark = 0;
};

class Counting : public btPoint2PointConstraint {
 public:
  using btPoint2PointConstraint::btPoint2PointConstraint;
  void solveConstraintObsolete(btSolverBody&, btSolverBody&, btScalar) override { ++calls; }
  int calls = 0;
};

// A ball on a joint to the world, which it swings about for ten steps.
template <typename World, typename Joint>
btVector3 swing(World& w, Joint*& joint) {
  btRigidBody* ball = w.objects.add(1, w.objects.sphere(btScalar(0.5)), btVector3(0, 0, 0));
  joint = w.objects.template joint<Joint>(true, *ball, btVector3(1, 0, 0));
  w.run(10);
  return ball->getWorldTransform().getOrigin();
}

TEST(JointClasses, OneThatOverridesNothingIsTheDevices) {
  GpuWorld gpu;
  StockWorld stock;
  Marked* joint;
  const btVector3 ours = swing(gpu, joint), theirs = swing(stock, joint);
  // Ten iterations of three rows, whose impulses round the velocity by half a unit of 10 m/s each, over 1/6 s.
  EXPECT_LT(length(ours - theirs), 10 * 10 * 3 * 0.5 * 1.2e-7 * 10);
  expectAllOnDevice(gpu.world, {"joints"});
}

TEST(JointClasses, OneThatOverridesIsCalled) {
  GpuWorld gpu;
  Counting* joint;
  swing(gpu, joint);
  EXPECT_GT(joint->calls, 0);
  EXPECT_EQ(gpu.world.statistics().m_stockSteps, 10u);
}

}  // namespace
}  // namespace btgpu::test
