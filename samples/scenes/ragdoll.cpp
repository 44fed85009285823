// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <algorithm>

#include "parts.h"

namespace scenes {
namespace {

struct Point {
  double x, y, z;
  btVector3 vector() const { return {s(x), s(y), s(z)}; }
};

// The largest capsule in a box, along its longest axis.
btCollisionShape* capsuleIn(Objects& o, const Point& half) {
  const double longest = std::max({half.x, half.y, half.z}), radius = std::min({half.x, half.y, half.z});
  const btScalar r = s(radius), height = s(2 * (longest - radius));
  if (half.y == longest) return o.capsule(r, height);
  if (half.x == longest) return o.shape<btCapsuleShapeX>(r, height);
  return o.shape<btCapsuleShapeZ>(r, height);
}

class Ragdoll {
 public:
  Ragdoll(Objects& o, const btVector3& at, const btQuaternion& turn, Limbs limbs)
      : m_objects(o), m_place(btTransform(turn, at + btVector3(0, s(0.85), 0))), m_limbs(limbs) {
    const btVector3 x(1, 0, 0), y(0, 1, 0);
    btRigidBody* pelvis = addLimb(10, {0.15, 0.1, 0.1}, {0, 1.0, 0});
    btRigidBody* chest = addLimb(15, {0.18, 0.18, 0.1}, {0, 1.3, 0});
    btRigidBody* head = add(4, o.sphere(s(0.11)), {0, 1.62, 0});
    cone(chest, head, y, {0, 1.5, 0}, 0.4, 0.4, 0.6);
    hinge(pelvis, chest, x, {0, 1.11, 0}, -0.3, 0.6);
    for (const double side : {-1.0, 1.0}) {
      btRigidBody* upperArm = addLimb(2.5, {0.13, 0.05, 0.05}, {side * 0.33, 1.42, 0});
      btRigidBody* lowerArm = addLimb(1.5, {0.13, 0.04, 0.04}, {side * 0.61, 1.42, 0});
      cone(chest, upperArm, x * s(side), {side * 0.19, 1.42, 0}, 1.2, 1.2, 0.5);
      hinge(upperArm, lowerArm, y, {side * 0.47, 1.42, 0}, side < 0 ? 0 : -2.0, side < 0 ? 2.0 : 0);
      btRigidBody* thigh = addLimb(6, {0.07, 0.2, 0.07}, {side * 0.1, 0.68, 0});
      btRigidBody* shin = addLimb(4, {0.05, 0.2, 0.06}, {side * 0.1, 0.24, 0});
      cone(pelvis, thigh, -y, {side * 0.1, 0.89, 0}, 0.9, 0.6, 0.3);
      hinge(thigh, shin, x, {side * 0.1, 0.46, 0}, 0, 2.0);
    }
  }

 private:
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
  btRigidBody* addLimb(double mass, const Point& halfExtents, const Point& p) {
    const bool box = m_limbs == Limbs::Boxes;
    return add(mass, box ? m_objects.box(halfExtents.vector()) : capsuleIn(m_objects, halfExtents), p);
  }
  void cone(btRigidBody* a, btRigidBody* b, const btVector3& axis, const Point& p, double swing1, double swing2,
            double twist) {
    const btTransform at = placed(p) * frameAlong(btVector3(1, 0, 0), axis, btVector3(0, 0, 0));
    auto* joint = m_objects.joint<btConeTwistConstraint>(true, *a, *b, inFrameOf(*a, at), inFrameOf(*b, at));
    joint->setLimit(s(swing1), s(swing2), s(twist));
  }
  void hinge(btRigidBody* a, btRigidBody* b, const btVector3& axis, const Point& p, double low, double high) {
    addHinge(m_objects, *a, *b, placed(p) * frameAlong(btVector3(0, 0, 1), axis, btVector3(0, 0, 0)))
        ->setLimit(s(low), s(high));
  }

  Objects& m_objects;
  btTransform m_place;
  Limbs m_limbs;
};

}  // namespace

void addRagdoll(Objects& o, const btVector3& at, const btQuaternion& turn, Limbs limbs) { Ragdoll(o, at, turn, limbs); }

}  // namespace scenes
