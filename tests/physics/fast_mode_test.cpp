// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The fast mode against what physics says (docs/fast_mode.md).
#include <cmath>

#include "tests/support/test_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }
btVector3 vec(double x, double y, double z) { return {s(x), s(y), s(z)}; }

btGpuSettings fast() {
  btGpuSettings settings;
  settings.m_solver = btGpuSolver::Fast;
  return settings;
}
btGpuSettings parity() {
  btGpuSettings settings;
  settings.m_solver = btGpuSolver::Parity;
  return settings;
}

struct FastWorld : WorldOf<btGpuDynamicsWorld> {
  explicit FastWorld(const btGpuSettings& settings = fast()) : WorldOf<btGpuDynamicsWorld>(settings) {
    world.setGravity(vec(0, -10, 0));
  }
  btRigidBody* ground() { return objects.add(0, objects.box(vec(50, 5, 50)), vec(0, -5, 0)); }
};

double height(const btRigidBody* b) { return double(b->getWorldTransform().getOrigin().y()); }

// What nothing touches moves as in parity mode, to the bit.
TEST(FastMode, FreeFallIsThatOfParity) {
  FastWorld a, b(parity());
  std::vector<btRigidBody*> bodies;
  for (FastWorld* w : {&a, &b}) {
    bodies.push_back(w->objects.add(2, w->objects.box(vec(0.5, 1, 1.5)), vec(0, 100, 0)));
    bodies.back()->setLinearVelocity(vec(1, 2, 3));
    bodies.back()->setAngularVelocity(vec(3, -2, 1));
    w->run(60);
    expectAllOnDevice(w->world);
  }
  EXPECT_TRUE(bodies[0]->getWorldTransform() == bodies[1]->getWorldTransform());
  EXPECT_TRUE(bodies[0]->getLinearVelocity() == bodies[1]->getLinearVelocity());
  EXPECT_TRUE(bodies[0]->getAngularVelocity() == bodies[1]->getAngularVelocity());
}

TEST(FastMode, ABoxAtRestStaysPut) {
  FastWorld w;
  w.ground();
  btRigidBody* box = w.objects.add(1, w.objects.box(vec(0.5, 0.5, 0.5)), vec(0, 0.5, 0));
  box->setActivationState(DISABLE_DEACTIVATION);
  w.run(500);
  expectAllOnDevice(w.world);
  const btVector3 at = box->getWorldTransform().getOrigin();
  EXPECT_NEAR(double(at.x()), 0, 1e-4);
  EXPECT_NEAR(double(at.z()), 0, 1e-4);
  // A spring of 60 Hz carries 1 kg at g / omega^2 = 7e-5.
  EXPECT_NEAR(double(at.y()), 0.5, 2e-4);
}

// On a slope of angle a, a box stays if its friction is above tan a, else it slides with g (sin a - mu cos a).
TEST(FastMode, SlopeIsCoulombs) {
  for (const double ratio : {0.8, 0.95, 1.05, 1.5}) {
    FastWorld w;
    const double angle = 0.4, mu = ratio * std::tan(angle);
    const btQuaternion tilt(vec(0, 0, 1), s(-angle));
    const btTransform slope(tilt, vec(0, 0, 0));
    w.objects.add(0, w.objects.box(vec(50, 1, 50)), slope)->setFriction(1);
    btRigidBody* slab = w.objects.add(1, w.objects.box(vec(0.5, 0.1, 0.5)), btTransform(tilt, slope * vec(0, 1.1, 0)));
    slab->setFriction(s(mu));
    slab->setActivationState(DISABLE_DEACTIVATION);
    w.run(30);  // until it lies
    const btVector3 at = slab->getWorldTransform().getOrigin(), speed = slab->getLinearVelocity();
    w.run(60);
    expectAllOnDevice(w.world);
    const double gain = length(slab->getLinearVelocity()) - length(speed);
    const double sliding = std::max(0.0, 10 * (std::sin(angle) - mu * std::cos(angle)));
    EXPECT_NEAR(gain, sliding, 0.01 * 10 * std::sin(angle)) << "friction over the slope " << ratio;
    if (ratio > 1) { EXPECT_LT(length(slab->getWorldTransform().getOrigin() - at), 1e-3); }
  }
}

// e^2 of the height, less or more what a step's fall on is worth: v dt.
TEST(FastMode, RestitutionGivesBackItsShare) {
  for (const double e : {0.3, 0.7, 1.0}) {
    FastWorld w;
    w.ground()->setRestitution(1);
    btRigidBody* ball = w.objects.add(1, w.objects.sphere(s(0.5)), vec(0, 3.5, 0));
    ball->setRestitution(s(e));
    w.run(50);  // it hits the ground after 0.77 s
    double top = 0;
    for (int i = 0; i < 80; ++i) {
      w.run(1);
      top = std::max(top, height(ball) - 0.5);
    }
    EXPECT_NEAR(top, e * e * 3, e * std::sqrt(60.0) / 60) << "restitution " << e;
  }
}

TEST(FastMode, AStackHoldsItsHeight) {
  FastWorld w;
  w.ground();
  std::vector<btRigidBody*> boxes;
  for (int i = 0; i < 10; ++i) {
    boxes.push_back(w.objects.add(1, w.objects.box(vec(0.5, 0.5, 0.5)), vec(0, 0.5 + i, 0)));
    boxes.back()->setActivationState(DISABLE_DEACTIVATION);
  }
  w.run(500);
  expectAllOnDevice(w.world);
  // Each contact gives way by at most (load / mass that yields) / omega^2, omega = 2 pi 60: 10 boxes, four points that
  // each see at least an eighth of a box: 800 / 142,000, and less for those above; together not a box's 50th.
  EXPECT_NEAR(height(boxes.back()), 9.5, 0.03);
  EXPECT_LT(std::fabs(double(boxes.back()->getWorldTransform().getOrigin().x())), 0.05);
}

TEST(FastMode, HeavyOverLightStands) {
  FastWorld w;
  w.ground();
  w.objects.add(1, w.objects.box(vec(0.5, 0.5, 0.5)), vec(0, 0.5, 0));
  btRigidBody* heavy = w.objects.add(10, w.objects.box(vec(0.5, 0.5, 0.5)), vec(0, 1.5, 0));
  w.run(300);
  EXPECT_NEAR(height(heavy), 1.5, 0.02);
}

// The largest gap of two swinging joints and the speed of a motor that turns at 2.
template <typename World>
void swing(WorldOf<World>& w, double& gap, double& motorSpeed) {
  w.world.setGravity(vec(0, -10, 0));
  btSphereShape* ball = w.objects.sphere(s(0.2));
  btRigidBody* post = w.objects.add(0, ball, vec(0, 0, 0));
  btRigidBody* bob = w.objects.add(1, ball, vec(1, 0, 0));
  btRigidBody* door = w.objects.add(1, ball, vec(0, 0, 1));
  btRigidBody* wheel = w.objects.add(1, ball, vec(5, 0, 0));
  w.objects.template joint<btPoint2PointConstraint>(true, *post, *bob, vec(0, 0, 0), vec(-1, 0, 0));
  w.objects.template joint<btHingeConstraint>(true, *post, *door, vec(0, 0, 0), vec(0, 0, -1), vec(1, 0, 0),
                                              vec(1, 0, 0));
  const btTransform none = btTransform::getIdentity();
  auto* motor = w.objects.template joint<btGeneric6DofConstraint>(
      true, *post, *wheel, btTransform(none.getBasis(), vec(5, 0, 0)), none, true);
  for (int axis = 0; axis < 6; ++axis) motor->setLimit(axis, 0, 0);
  motor->setLimit(3, 1, -1);  // turns freely, driven
  motor->getRotationalLimitMotor(0)->m_enableMotor = true;
  motor->getRotationalLimitMotor(0)->m_targetVelocity = 2;
  motor->getRotationalLimitMotor(0)->m_maxMotorForce = 10;
  for (btRigidBody* b : w.objects.bodies()) b->setActivationState(DISABLE_DEACTIVATION);
  gap = 0;
  for (int i = 0; i < 300; ++i) {
    w.run(1);
    gap = std::max(gap, length(bob->getWorldTransform() * vec(-1, 0, 0)));
    gap = std::max(gap, length(door->getWorldTransform() * vec(0, 0, -1)));
    gap = std::max(gap, length(wheel->getWorldTransform().getOrigin() - vec(5, 0, 0)));
  }
  motorSpeed = std::fabs(double(wheel->getAngularVelocity().x()));
}

TEST(FastMode, JointsHoldBetterThanStocks) {
  FastWorld w;
  StockWorld stock;
  double gap = 0, stockGap = 0, speed = 0, stockSpeed = 0;
  swing(w, gap, speed);
  swing(stock, stockGap, stockSpeed);
  expectAllOnDevice(w.world, {"joints"});
  EXPECT_LT(gap, stockGap);
  EXPECT_NEAR(speed, stockSpeed, 0.02);
}

// A breakable joint breaks at its impulse, not before.
TEST(FastMode, AJointBreaks) {
  for (const double weight : {1.0, 3.0}) {
    FastWorld w;
    btSphereShape* ball = w.objects.sphere(s(0.2));
    btRigidBody* post = w.objects.add(0, ball, vec(0, 0, 0));
    btRigidBody* bob = w.objects.add(s(weight), ball, vec(0, -1, 0));
    auto* joint = w.objects.joint<btPoint2PointConstraint>(true, *post, *bob, vec(0, 0, 0), vec(0, 1, 0));
    joint->setBreakingImpulseThreshold(s(2 * 10.0 / 60));  // the weight of 2 kg
    w.run(60);
    EXPECT_EQ(joint->isEnabled(), weight < 2) << weight;
  }
}

TEST(FastMode, ABodyThatTouchesNothingElseSleeps) {
  FastWorld w;
  w.ground();
  btRigidBody* box = w.objects.add(1, w.objects.box(vec(0.5, 0.5, 0.5)), vec(0, 0.5, 0));
  w.run(300);
  EXPECT_FALSE(box->isActive());
}

// A belt carries what lies on it.
TEST(FastMode, KinematicBodiesCarry) {
  FastWorld w;
  btRigidBody* belt = w.objects.add(0, w.objects.box(vec(50, 1, 5)), vec(0, -1, 0));
  belt->setCollisionFlags(belt->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  belt->setActivationState(DISABLE_DEACTIVATION);
  btRigidBody* box = w.objects.add(1, w.objects.box(vec(0.5, 0.5, 0.5)), vec(0, 0.5, 0));
  double at = 0;
  for (int i = 0; i < 120; ++i) {
    at += 1.0 / 60;
    btTransform next(btQuaternion::getIdentity(), vec(at, -1, 0));
    belt->setWorldTransform(next);
    w.run(1);
  }
  EXPECT_NEAR(double(box->getLinearVelocity().x()), 1, 0.02);
  EXPECT_NEAR(height(box), 0.5, 0.01);
}

TEST(FastMode, TheSameTwice) {
  std::vector<btTransform> ends;
  for (int run = 0; run < 2; ++run) {
    FastWorld w;
    w.ground();
    std::vector<btRigidBody*> bodies;
    for (int i = 0; i < 60; ++i) {
      bodies.push_back(
          w.objects.add(1, w.objects.box(vec(0.5, 0.4, 0.3)), vec(0.3 * (i % 3), 1 + 0.9 * i, 0.2 * (i % 4))));
    }
    w.run(200);
    for (const btRigidBody* b : bodies) ends.push_back(b->getWorldTransform());
  }
  for (size_t i = 0; i < ends.size() / 2; ++i) EXPECT_TRUE(ends[i] == ends[i + ends.size() / 2]) << "body " << i;
}

}  // namespace
}  // namespace btgpu::test
