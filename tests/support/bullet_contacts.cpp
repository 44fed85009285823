// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/support/bullet_contacts.h"

namespace btgpu {
namespace {

btVector3 toBullet(float4 v) { return {v.x, v.y, v.z}; }

btContactSolverInfo infoOf(const StepSettings& s) {
  btContactSolverInfo info;
  info.m_timeStep = s.timeStep;
  info.m_numIterations = s.iterations;
  info.m_erp2 = s.erp2;
  info.m_globalCfm = s.globalCfm;
  info.m_sor = s.sor;
  info.m_splitImpulse = s.splitImpulse;
  info.m_splitImpulsePenetrationThreshold = s.splitImpulsePenetrationThreshold;
  info.m_splitImpulseTurnErp = s.splitImpulseTurnErp;
  info.m_linearSlop = s.linearSlop;
  info.m_warmstartingFactor = s.warmStartingFactor;
  info.m_restitutionVelocityThreshold = s.restitutionVelocityThreshold;
  info.m_maxGyroscopicForce = s.maxGyroscopicForce;
  info.m_frictionERP = s.frictionErp;
  info.m_solverMode = (s.warmStarting ? SOLVER_USE_WARMSTARTING : 0) |
                      (s.twoFrictionDirections ? SOLVER_USE_2_FRICTION_DIRECTIONS : 0) |
                      (s.frictionDirectionCaching ? SOLVER_ENABLE_FRICTION_DIRECTION_CACHING : 0) |
                      (s.velocityDependentFriction ? 0 : SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION) |
                      (s.interleaveContactAndFriction ? SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS : 0);
  return info;
}

int collisionFlags(uint flags) {
  return (flags & BODY_STATIC ? btCollisionObject::CF_STATIC_OBJECT : 0) |
         (flags & BODY_KINEMATIC ? btCollisionObject::CF_KINEMATIC_OBJECT : 0);
}

}  // namespace

BulletContacts::BulletContacts(const ContactScene& scene) : m_info(infoOf(scene.settings)) {
  const WorldInput in = scene.builder.finish();
  for (uint i = 0; i < in.bodyCount; ++i) addBody(in, i);
  for (const Manifold& m : scene.manifolds) addManifold(m);
}

void BulletContacts::addBody(const WorldInput& in, uint i) {
  const uint flags = in.infos.values[i].flags;
  const BodyPose& pose = in.poses.values[i];
  const btTransform transform({pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w},
                              toBullet(pose.position));
  if (flags & BODY_RIGID) {
    const BodyMass& mass = in.masses.values[i];
    const float inverseMass = mass.inverseInertiaLocal.w;
    auto body = std::make_unique<btRigidBody>(inverseMass != 0 ? 1 / inverseMass : 0.0f, nullptr, &m_shape);
    body->setWorldTransform(transform);
    body->setInvInertiaDiagLocal(toBullet(mass.inverseInertiaLocal));
    body->updateInertiaTensor();
    body->setLinearVelocity(toBullet(in.velocities.values[i].linear));
    body->setAngularVelocity(toBullet(in.velocities.values[i].angular));
    // The scene's forces have the factors applied, so they come first.
    body->applyCentralForce(toBullet(in.forces.values[i].force));
    body->applyTorque(toBullet(in.forces.values[i].torque));
    body->setLinearFactor(toBullet(mass.linearFactor));
    body->setAngularFactor(toBullet(mass.angularFactor));
    body->setFlags(flags & BODY_GYRO_IMPLICIT_BODY ? BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY : 0);
    m_objects.push_back(std::move(body));
  } else {
    m_objects.push_back(std::make_unique<btCollisionObject>());
    m_objects.back()->setWorldTransform(transform);
  }
  btCollisionObject& object = *m_objects.back();
  object.setCollisionFlags(collisionFlags(flags));
  object.setWorldArrayIndex(static_cast<int>(i));
  const int anisotropic = (flags & BODY_ANISOTROPIC ? btCollisionObject::CF_ANISOTROPIC_FRICTION : 0) |
                          (flags & BODY_ANISOTROPIC_ROLLING ? btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION : 0);
  object.setAnisotropicFriction(toBullet(in.materials.values[i].anisotropicFriction), anisotropic);
  if (!object.isStaticOrKinematicObject()) m_bodies.push_back(&object);
}

void BulletContacts::addManifold(const Manifold& from) {
  const btCollisionObject &a = *m_objects[from.bodyA], &b = *m_objects[from.bodyB];
  m_manifolds.push_back(
      std::make_unique<btPersistentManifold>(&a, &b, 0, from.breakingThreshold, from.processingThreshold));
  m_list.push_back(m_manifolds.back().get());
  for (int k = 0; k < from.pointCount; ++k) {
    const ContactPoint& c = from.points[k];
    btManifoldPoint p(toBullet(c.localPointA), toBullet(c.localPointB), toBullet(c.normalWorldOnB), c.localPointA.w);
    p.m_positionWorldOnA = a.getWorldTransform() * p.m_localPointA;
    p.m_positionWorldOnB = b.getWorldTransform() * p.m_localPointB;
    p.m_combinedFriction = c.combined.x;
    p.m_combinedRestitution = c.combined.y;
    p.m_combinedRollingFriction = c.combined.z;
    p.m_combinedSpinningFriction = c.combined.w;
    p.m_combinedContactStiffness1 = c.combinedStiffness;
    p.m_combinedContactDamping1 = c.combinedDamping;
    p.m_contactPointFlags = c.flags & POINT_BULLET_FLAGS;
    if (c.flags & POINT_MOTION) {
      p.m_contactMotion1 = c.normalWorldOnB.w;
      p.m_contactMotion2 = c.lateralFrictionDir1.w;
    }
    p.m_lateralFrictionDir1 = toBullet(c.lateralFrictionDir1);
    p.m_lateralFrictionDir2 = toBullet(c.lateralFrictionDir2);
    p.m_appliedImpulse = c.localPointB.w;
    p.m_appliedImpulseLateral1 = c.normalWorldOnB.w;
    p.m_appliedImpulseLateral2 = c.lateralFrictionDir1.w;
    m_manifolds.back()->addManifoldPoint(p, true);
  }
}

void BulletContacts::setup() {
  m_solver.solveGroupCacheFriendlySetup(m_bodies.data(), static_cast<int>(m_bodies.size()), m_list.data(),
                                        static_cast<int>(m_list.size()), nullptr, 0, m_info, nullptr);
}

void BulletContacts::solve() {
  m_solver.solveGroupCacheFriendlyIterations(m_bodies.data(), static_cast<int>(m_bodies.size()), m_list.data(),
                                             static_cast<int>(m_list.size()), nullptr, 0, m_info, nullptr);
  m_solver.solveGroupCacheFriendlyFinish(m_bodies.data(), static_cast<int>(m_bodies.size()), m_info);
}

int BulletContacts::rowOf(size_t manifold, int k) {
  const void* wanted = &point(manifold, k);
  for (int r = 0; r < m_solver.contacts().size(); ++r) {
    if (m_solver.contacts()[r].m_originalContactPoint == wanted) return r;
  }
  return -1;
}

}  // namespace btgpu
