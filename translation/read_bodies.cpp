// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "read_bodies.h"

#include <cmath>

#include "convert.h"
#include "private_access.h"

BTGPU_TRANSLATION_BEGIN
namespace {

uint flagsOf(const btCollisionObject& object, const btRigidBody* rigid, bool integrated) {
  const int flags = object.getCollisionFlags();
  uint out = BODY_PRESENT;
  if (flags & btCollisionObject::CF_STATIC_OBJECT) out |= BODY_STATIC;
  if (flags & btCollisionObject::CF_KINEMATIC_OBJECT) out |= BODY_KINEMATIC;
  if (flags & btCollisionObject::CF_NO_CONTACT_RESPONSE) out |= BODY_NO_RESPONSE;
  if (flags & btCollisionObject::CF_HAS_CONTACT_STIFFNESS_DAMPING) out |= BODY_STIFFNESS;
  if (flags & btCollisionObject::CF_HAS_FRICTION_ANCHOR) out |= BODY_FRICTION_ANCHOR;
  if (object.hasAnisotropicFriction(btCollisionObject::CF_ANISOTROPIC_FRICTION)) out |= BODY_ANISOTROPIC;
  if (object.hasAnisotropicFriction(btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION))
    out |= BODY_ANISOTROPIC_ROLLING;
  if (!rigid) return out;
  out |= BODY_RIGID;
  if (integrated) out |= BODY_INTEGRATED;
  if (rigid->*memberPointer(AdditionalDamping{})) out |= BODY_ADDITIONAL_DAMPING;
  const int rigidFlags = rigid->getFlags();
  if (rigidFlags & BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT) out |= BODY_GYRO_EXPLICIT;
  if (rigidFlags & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD) out |= BODY_GYRO_IMPLICIT_WORLD;
  if (rigidFlags & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY) out |= BODY_GYRO_IMPLICIT_BODY;
  return out;
}

BodyMaterial materialOf(const btCollisionObject& object) {
  BodyMaterial m{};
  m.friction = static_cast<float>(object.getFriction());
  m.rollingFriction = static_cast<float>(object.getRollingFriction());
  m.spinningFriction = static_cast<float>(object.getSpinningFriction());
  m.restitution = static_cast<float>(object.getRestitution());
  m.contactStiffness = static_cast<float>(object.getContactStiffness());
  m.contactDamping = static_cast<float>(object.getContactDamping());
  m.contactProcessingThreshold = static_cast<float>(object.getContactProcessingThreshold());
  m.anisotropicFriction = toFloat4(object.getAnisotropicFriction());
  return m;
}

BodyDamping dampingOf(const btRigidBody& body) {
  BodyDamping d{};
  d.linear = static_cast<float>(body.getLinearDamping());
  d.angular = static_cast<float>(body.getAngularDamping());
  d.additionalFactor = static_cast<float>(body.*memberPointer(AdditionalDampingFactor{}));
  d.additionalLinearThresholdSqr = static_cast<float>(body.*memberPointer(AdditionalLinearThresholdSqr{}));
  d.additionalAngularThresholdSqr = static_cast<float>(body.*memberPointer(AdditionalAngularThresholdSqr{}));
  d.linearSleepingThreshold = static_cast<float>(body.getLinearSleepingThreshold());
  d.angularSleepingThreshold = static_cast<float>(body.getAngularSleepingThreshold());
  return d;
}

// Zero for a finite number, NaN otherwise.
float probe(const float4& v) { return v.x * 0 + v.y * 0 + v.z * 0 + v.w * 0; }

}  // namespace

BodyRecord readBody(const btCollisionObject& object, int shapeIndex, bool integrated) {
  const btRigidBody* rigid = btRigidBody::upcast(&object);
  const btBroadphaseProxy* proxy = object.getBroadphaseHandle();
  BodyRecord r{};
  r.info.shapeIndex = shapeIndex;
  r.info.flags = flagsOf(object, rigid, integrated);
  r.info.filterGroup = proxy->m_collisionFilterGroup;
  r.info.filterMask = proxy->m_collisionFilterMask;
  r.info.uniqueId = proxy->m_uniqueId;
  r.material = materialOf(object);
  r.activation = {object.getActivationState(), static_cast<float>(object.getDeactivationTime())};
  if (!rigid) return r;
  r.velocity = {toFloat4(rigid->getLinearVelocity()), toFloat4(rigid->getAngularVelocity())};
  r.forces = {toFloat4(rigid->getTotalForce()), toFloat4(rigid->getTotalTorque())};
  r.mass = {toFloat4(rigid->getInvInertiaDiagLocal(), static_cast<float>(rigid->getInvMass())),
            toFloat4(rigid->getLinearFactor()), toFloat4(rigid->getAngularFactor())};
  r.damping = dampingOf(*rigid);
  return r;
}

bool isFiniteBody(const BodyRecord& r, const BodyPose& pose) {
  const BodyMaterial& m = r.material;
  const float sum = probe(pose.position) + probe(pose.orientation) + probe(r.velocity.linear) +
                    probe(r.velocity.angular) + probe(r.forces.force) + probe(r.forces.torque) +
                    probe(r.mass.inverseInertiaLocal) + probe(r.mass.linearFactor) + probe(r.mass.angularFactor) +
                    probe({m.friction, m.rollingFriction, m.spinningFriction, m.restitution}) +
                    probe({r.damping.linear, r.damping.angular, m.contactDamping, 0}) + probe(m.anisotropicFriction);
  // Infinite stiffness is a hard contact; only NaN is no number.
  return sum == 0.0f && !std::isnan(m.contactStiffness) && !std::isnan(m.contactProcessingThreshold);
}

BTGPU_TRANSLATION_END
