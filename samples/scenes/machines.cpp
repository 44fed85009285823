// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Joints and vehicles.
#include "parts.h"

namespace scenes {
namespace {

btTransform inFrameOf(const btRigidBody& body, const btTransform& world) {
  return body.getWorldTransform().inverse() * world;
}

// A frame whose x axis points along `axis` (about which a cone twists), or whose z axis does (about which a hinge
// turns).
btTransform frameAlong(const btVector3& from, const btVector3& axis, const btVector3& at) {
  return btTransform(shortestArcQuat(from, axis), at);
}

// One figure of eleven bodies and ten joints, 1.7 high, upright at `at` (between its feet), then turned by `turn`.
class Ragdoll {
 public:
  Ragdoll(Objects& o, const btVector3& at, const btQuaternion& turn)
      : m_objects(o), m_place(btTransform(turn, at + btVector3(0, s(0.85), 0))) {
    const btVector3 x(1, 0, 0), y(0, 1, 0);
    btRigidBody* pelvis = addBox(10, {0.15, 0.1, 0.1}, {0, 1.0, 0});
    btRigidBody* chest = addBox(15, {0.18, 0.18, 0.1}, {0, 1.3, 0});
    btRigidBody* head = add(4, o.sphere(s(0.11)), {0, 1.62, 0});
    cone(chest, head, y, {0, 1.5, 0}, 0.4, 0.4, 0.6);
    hinge(pelvis, chest, x, {0, 1.11, 0}, -0.3, 0.6);
    for (const double side : {-1.0, 1.0}) {
      btRigidBody* upperArm = addBox(2.5, {0.13, 0.05, 0.05}, {side * 0.33, 1.42, 0});
      btRigidBody* lowerArm = addBox(1.5, {0.13, 0.04, 0.04}, {side * 0.61, 1.42, 0});
      cone(chest, upperArm, x * s(side), {side * 0.19, 1.42, 0}, 1.2, 1.2, 0.5);
      hinge(upperArm, lowerArm, y, {side * 0.47, 1.42, 0}, side < 0 ? 0 : -2.0, side < 0 ? 2.0 : 0);
      btRigidBody* thigh = addBox(6, {0.07, 0.2, 0.07}, {side * 0.1, 0.68, 0});
      btRigidBody* shin = addBox(4, {0.05, 0.2, 0.06}, {side * 0.1, 0.24, 0});
      cone(pelvis, thigh, -y, {side * 0.1, 0.89, 0}, 0.9, 0.6, 0.3);
      hinge(thigh, shin, x, {side * 0.1, 0.46, 0}, 0, 2.0);
    }
  }

 private:
  struct Point {
    double x, y, z;
    btVector3 vector() const { return {s(x), s(y), s(z)}; }
  };
  // Places are given from the feet; the figure turns about its middle.
  btTransform placed(const Point& p) const {
    return m_place * btTransform(btQuaternion::getIdentity(), p.vector() - btVector3(0, s(0.85), 0));
  }
  btRigidBody* add(double mass, btCollisionShape* shape, const Point& p) {
    btRigidBody* body = m_objects.add(s(mass), shape, placed(p));
    body->setDamping(s(0.05), s(0.85));  // as in Bullet's own ragdoll demo
    body->setFriction(s(0.8));
    body->setRollingFriction(s(0.05));
    body->setSpinningFriction(s(0.05));
    body->setSleepingThresholds(s(1.6), s(2.5));
    return body;
  }
  btRigidBody* addBox(double mass, const Point& halfExtents, const Point& p) {
    return add(mass, m_objects.box(halfExtents.vector()), p);
  }
  void cone(btRigidBody* a, btRigidBody* b, const btVector3& axis, const Point& p, double swing1, double swing2,
            double twist) {
    const btTransform at = placed(p) * frameAlong(btVector3(1, 0, 0), axis, btVector3(0, 0, 0));
    auto* joint = m_objects.joint<btConeTwistConstraint>(true, *a, *b, inFrameOf(*a, at), inFrameOf(*b, at));
    joint->setLimit(s(swing1), s(swing2), s(twist));
  }
  void hinge(btRigidBody* a, btRigidBody* b, const btVector3& axis, const Point& p, double low, double high) {
    const btTransform at = placed(p) * frameAlong(btVector3(0, 0, 1), axis, btVector3(0, 0, 0));
    auto* joint = m_objects.joint<btHingeConstraint>(true, *a, *b, inFrameOf(*a, at), inFrameOf(*b, at));
    joint->setLimit(s(low), s(high));
  }

  Objects& m_objects;
  btTransform m_place;
};

void buildRagdoll(Objects& o, Size n) {
  addFloor(o);
  std::mt19937 random(2);
  for (int y = 0; y < n.y; ++y) {
    for (int x = 0; x < n.x; ++x) {
      for (int z = 0; z < n.z; ++z) {
        const btVector3 at(s(2.2 * (x - n.x / 2)), s(0.6 + 2.2 * y), s(2.2 * (z - n.z / 2)));
        Ragdoll(o, at, randomRotation(random));
      }
    }
  }
}

// X cars drive a curve through rows of Z boxes.
void buildVehicle(Objects& o, Size n) {
  addFloor(o);
  btBoxShape* body = o.box(btVector3(1, s(0.5), 2));
  btBoxShape* crate = o.box(btVector3(s(0.4), s(0.4), s(0.4)));
  for (int x = 0; x < n.x; ++x) {
    const btScalar left = s(12.0 * x);
    btRigidBody* chassis = o.add(800, body, btVector3(left, s(1.5), 0));
    chassis->setActivationState(DISABLE_DEACTIVATION);
    btRaycastVehicle* vehicle = o.vehicle(chassis, s(0.9));
    for (int wheel = 2; wheel < 4; ++wheel) vehicle->applyEngineForce(s(1500), wheel);
    for (int wheel = 0; wheel < 2; ++wheel) vehicle->setSteeringValue(s(0.03 * (x + 1)), wheel);
    for (int z = 0; z < n.z; ++z) {
      for (int y = 0; y < n.y; ++y)
        o.add(20, crate, btVector3(left + s(1.2 * (z % 3)), s(0.4 + 0.8 * y), s(8 + 3.0 * z)));
    }
  }
}

}  // namespace

std::vector<Scene> machineScenes() {
  return {
      // Boxes that slide and tumble have old points in their manifolds. Of the new ones on top Bullet keeps those that
      // span the largest area together with the old ones, which it then drops: the deepest may be lost, in either
      // world, and which one depends on the order of the points. 0.2 to 0.9 % of the pairs in these two scenes, all in
      // motion.
      {"ragdoll",
       "ragdolls of boxes, spheres, cone twist joints and hinges, dropped on the ground",
       {3, 2, 3},
       400,
       kStep,
       {10, 0, Rest::AsStock, 0.05, 0.01, {"joints"}},
       buildRagdoll,
       {{8, 4, 8}, 120, nullptr}},
      {"vehicle",
       "X raycast vehicles that drive through Z stacks of Y crates",
       {2, 2, 4},
       240,
       kStep,
       {30, 0, Rest::No, 0, 0.01, {"actions"}},
       buildVehicle,
       {{4, 8, 12}, 120, nullptr}},
  };
}

}  // namespace scenes
