// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "residuals.h"

#include <cmath>

#include "../convert.h"

BTGPU_TRANSLATION_BEGIN
namespace {

bool moves(const btRigidBody* body) { return body && body->getInvMass() != btScalar(0); }

btVector3 velocityAt(const Velocity& v, const btVector3& r) { return v.linear + v.angular.cross(r); }

// Velocity along the normal that the row wants: Bullet's setupContactConstraint without the effective mass.
btScalar wantedSpeed(const btContactSolverInfo& info, const ContactPoint& p, btScalar approach, btScalar timeStep) {
  const btScalar distance = btScalar(p.localPointA.w) + info.m_linearSlop;
  btScalar wanted = 0;
  if (btFabs(approach) >= info.m_restitutionVelocityThreshold) {
    wanted = btMax(btScalar(0), -approach * btScalar(p.combined.y));
  }
  if (distance > 0) return wanted - distance / timeStep;
  const bool split = info.m_splitImpulse && distance <= info.m_splitImpulsePenetrationThreshold;
  return split ? wanted : wanted - distance * info.m_erp2 / timeStep;
}

}  // namespace

double Residual::rms() const { return rows ? std::sqrt(sumOfSquares / static_cast<double>(rows)) : 0; }

Residual measureResidual(const OracleWorld& world, const std::vector<Manifold>& contacts,
                         const std::vector<Manifold>& solved, const std::vector<BodyState>& before,
                         const std::vector<Velocity>& predicted, const std::vector<Velocity>& velocities,
                         btScalar timeStep) {
  const btContactSolverInfo& info = const_cast<OracleWorld&>(world).getSolverInfo();
  Residual residual;
  for (size_t i = 0; i < contacts.size(); ++i) {
    const Manifold& m = contacts[i];
    if (!moves(world.body(m.bodyA)) && !moves(world.body(m.bodyB))) continue;
    const btMatrix3x3& ra = before[m.bodyA].transform.getBasis();
    const btMatrix3x3& rb = before[m.bodyB].transform.getBasis();
    for (int k = 0; k < m.pointCount; ++k) {
      const ContactPoint& p = m.points[k];
      const btVector3 n = toBullet(p.normalWorldOnB);
      const btVector3 onA = ra * toBullet(p.localPointA), onB = rb * toBullet(p.localPointB);
      const btVector3 start = velocityAt(predicted[m.bodyA], onA) - velocityAt(predicted[m.bodyB], onB);
      const btVector3 end = velocityAt(velocities[m.bodyA], onA) - velocityAt(velocities[m.bodyB], onB);
      const double impulse = solved[i].points[k].localPointB.w;
      const double slip1 = solved[i].points[k].normalWorldOnB.w;
      const double error = double(wantedSpeed(info, p, n.dot(start), timeStep) - n.dot(end));
      const double normalError = impulse > 0 ? error : btMax(error, 0.0);
      residual.sumOfSquares += normalError * normalError;
      ++residual.rows;
      if (impulse <= 0) continue;
      const btVector3 t = toBullet(solved[i].points[k].lateralFrictionDir1);
      const bool insideCone = std::fabs(slip1) < 0.999 * double(p.combined.x) * impulse;
      const double slip = insideCone ? double(t.dot(end)) : 0;
      residual.sumOfSquares += slip * slip;
      ++residual.rows;
    }
  }
  return residual;
}

Residual measureJointResidual(const Joint& joint, const std::vector<JointRow>& rows,
                              const std::vector<Velocity>& velocities) {
  constexpr float kUnlimited = 1e30f;
  Residual residual;
  for (uint r = joint.firstRow; r < joint.firstRow + joint.rowCount; ++r) {
    const JointRow& row = rows[r];
    const bool below = row.linearB.w > -kUnlimited, above = row.angularB.w < kUnlimited;
    if (row.angularA.w != 0 || (below && above)) continue;
    btScalar error = btScalar(row.linearA.w);
    if (joint.bodyA != NO_INDEX) {
      const Velocity& v = velocities[joint.bodyA];
      error -= toBullet(row.linearA).dot(v.linear) + toBullet(row.angularA).dot(v.angular);
    }
    if (joint.bodyB != NO_INDEX) {
      const Velocity& v = velocities[joint.bodyB];
      error -= toBullet(row.linearB).dot(v.linear) + toBullet(row.angularB).dot(v.angular);
    }
    if (below) error = btMax(error, btScalar(0));
    if (above) error = btMin(error, btScalar(0));
    residual.sumOfSquares += double(error) * double(error);
    ++residual.rows;
  }
  return residual;
}

Residual measureJointResidual(const std::vector<Joint>& joints, const std::vector<JointRow>& rows,
                              const std::vector<uint>& solved, const std::vector<Velocity>& velocities) {
  Residual residual;
  for (size_t i = 0; i < joints.size(); ++i) {
    if (solved[i]) residual.add(measureJointResidual(joints[i], rows, velocities));
  }
  return residual;
}

double velocityDistance(const OracleWorld& world, const std::vector<Velocity>& a, const std::vector<Velocity>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const btRigidBody* body = world.body(i);
    if (!moves(body)) continue;
    const btVector3 linear = a[i].linear - b[i].linear;
    const btVector3 angular = (a[i].angular - b[i].angular) * body->getWorldTransform().getBasis();
    const btVector3 inertia = body->getLocalInertia();
    sum += double(linear.length2() / body->getInvMass() + angular.dot(angular * inertia));
  }
  return std::sqrt(sum);
}

double kineticEnergy(const OracleWorld& world, const std::vector<Velocity>& velocities) {
  const std::vector<Velocity> rest(velocities.size(), {btVector3(0, 0, 0), btVector3(0, 0, 0)});
  const double distance = velocityDistance(world, velocities, rest);
  return 0.5 * distance * distance;
}

BTGPU_TRANSLATION_END
