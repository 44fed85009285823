// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "read_joints.h"

#include <BulletDynamics/ConstraintSolver/btHinge2Constraint.h>
#include <BulletDynamics/ConstraintSolver/btSolverConstraint.h>

#include <LinearMath/btTransformUtil.h>

#include <algorithm>
#include <cfloat>
#include <cstring>
#include <unordered_map>

#include "../gpu_engine/zone.h"
#include "../kernels/lib/motion.h"
#include "convert.h"
#include "damped_bodies.h"
#include "exact_type.h"
#include "virtual_table.h"

BTGPU_TRANSLATION_BEGIN
namespace {

bool isBulletsOwn(const btTypedConstraint& constraint) {
  return isExactly<btPoint2PointConstraint, btHingeConstraint, btSliderConstraint, btConeTwistConstraint,
                   btGeneric6DofConstraint, btGeneric6DofSpringConstraint, btUniversalConstraint,
                   btGeneric6DofSpring2Constraint, btHinge2Constraint, btFixedConstraint, btGearConstraint,
                   btHingeAccumulatedAngleConstraint>(constraint);
}

// btSequentialImpulseConstraintSolver calls solveConstraintObsolete in every iteration. Bullet's classes do nothing
// there any more; true if the application's own class does.
bool takesPartInSolver(btTypedConstraint& constraint) {
  if (isBulletsOwn(constraint)) return false;
  const auto entryOf = [](const btTypedConstraint& joint) {
    return virtualEntry(virtualTableOf(&joint), &btTypedConstraint::solveConstraintObsolete);
  };
  // One of Bullet's own library: what it inherits is the same function there and in the application's classes.
  const btPoint2PointConstraint plain(constraint.getRigidBodyA(), btVector3(0, 0, 0));
  if (entryOf(constraint) == entryOf(plain)) return false;
  const auto* cone = dynamic_cast<const btConeTwistConstraint*>(&constraint);
  if (!cone) return true;
  const btConeTwistConstraint own(constraint.getRigidBodyA(), btTransform::getIdentity());
  return entryOf(constraint) != entryOf(own);
}

// Limits may be as large as a double: the device's largest float is without a limit too.
float toFinite(btScalar v) { return static_cast<float>(btMax(btScalar(-FLT_MAX), btMin(v, btScalar(FLT_MAX)))); }

// Bodies where they will be after `ahead`, if nothing stops them; they get their poses back, bit by bit.
class AdvancedBodies {
 public:
  explicit AdvancedBodies(btScalar ahead) : m_ahead(ahead) {}
  ~AdvancedBodies() {
    for (const Saved& s : m_saved) s.body->getWorldTransform() = s.pose;
  }
  AdvancedBodies(const AdvancedBodies&) = delete;
  AdvancedBodies& operator=(const AdvancedBodies&) = delete;

  void reserve(std::uint32_t slots) { m_done.assign(slots, false); }
  void advance(btRigidBody& body, std::uint32_t slot) {
    if (m_ahead == btScalar(0) || slot == kNoSlot || m_done[slot] || body.isStaticObject()) return;
    m_done[slot] = true;
    m_saved.push_back({&body, body.getWorldTransform()});
    btTransform next;
    btTransformUtil::integrateTransform(body.getWorldTransform(), body.getLinearVelocity(), body.getAngularVelocity(),
                                        m_ahead, next);
    body.getWorldTransform() = next;
  }

 private:
  struct Saved {
    btRigidBody* body;
    btTransform pose;
  };
  btScalar m_ahead;
  std::vector<Saved> m_saved;
  std::vector<bool> m_done;
};

btScalar speedAlong(const btRigidBody& body, const btVector3& linear, const btVector3& angular) {
  return linear.dot(body.getLinearVelocity()) + angular.dot(body.getAngularVelocity());
}

bool isDamped(const WorldReader& reader, std::uint32_t slot, const btRigidBody& body) {
  return slot != kNoSlot && reader.isIntegrated(slot) && !body.isStaticOrKinematicObject();
}

}  // namespace

void JointReader::read(btDiscreteDynamicsWorld& world, btScalar timeStep, WorldReader& reader, FallbackList& missing,
                       btScalar ahead) {
  WorldInput& input = reader.input();
  m_last.constraints.swap(m_constraints);
  m_last.joints.swap(input.joints);
  m_last.impulses.swap(m_impulses);
  m_impulses.clear();
  input.joints.clear();
  input.jointRows.clear();
  input.jointImpulses.clear();
  m_constraints.clear();
  m_evaluated.clear();
  for (int i = 0; i < world.getNumConstraints(); ++i) readJoint(*world.getConstraint(i), reader, missing);
  if (!missing.empty() || m_constraints.empty()) return;

  const Zone zone("convertJoints");
  const btContactSolverInfo& info = world.getSolverInfo();
  DampedBodies damped(timeStep);
  damped.reserve(input.bodyCount);
  AdvancedBodies advanced(ahead);
  advanced.reserve(input.bodyCount);
  for (btTypedConstraint* constraint : m_constraints) {
    for (btRigidBody* body : {&constraint->getRigidBodyA(), &constraint->getRigidBodyB()}) {
      const std::uint32_t slot = reader.slotOf(*body);
      if (isDamped(reader, slot, *body)) damped.damp(*body, slot);
      advanced.advance(*body, slot);
    }
  }
  // In the order of stock's convertJoints.
  for (std::size_t i = 0; i < m_constraints.size(); ++i) {
    if (!m_evaluated[i]) continue;
    // Some joints forget their impulse here; whether stock would have come here at all, the device knows after the
    // step.
    const btScalar impulse = m_constraints[i]->internalGetAppliedImpulse();
    m_constraints[i]->buildJacobian();
    m_constraints[i]->internalSetAppliedImpulse(impulse);
  }
  for (std::size_t i = 0; i < m_constraints.size(); ++i) {
    Joint& joint = input.joints[i];
    if (!m_evaluated[i] || !joint.enabled) continue;
    btTypedConstraint::btConstraintInfo1 info1;
    m_constraints[i]->getInfo1(&info1);
    joint.rowCount = static_cast<uint>(btMax(0, info1.m_numConstraintRows));
  }
  m_out = &input.jointRows;
  for (std::size_t i = 0; i < m_constraints.size(); ++i) {
    if (input.joints[i].rowCount > 0) makeRows(*m_constraints[i], info, timeStep, input.joints[i]);
  }
  recallImpulses(input);
}

// Rows are those of the last step if a joint's are as many and of the same kinds.
void JointReader::recallImpulses(WorldInput& input) {
  if (m_last.impulses.empty()) return;
  const std::size_t none = m_last.constraints.size();
  input.jointImpulses.assign(input.jointRows.size(), 0.0f);
  std::unordered_map<const btTypedConstraint*, std::size_t> places;
  bool looked = false;
  const auto placeOf = [&](std::size_t i) {  // in the last step: usually the same
    if (i < m_last.constraints.size() && m_last.constraints[i] == m_constraints[i]) return i;
    for (std::size_t k = 0; !looked && k < m_last.constraints.size(); ++k) places.emplace(m_last.constraints[k], k);
    looked = true;
    const auto found = places.find(m_constraints[i]);
    return found == places.end() ? none : found->second;
  };
  for (std::size_t i = 0; i < m_constraints.size(); ++i) {
    const Joint& now = input.joints[i];
    const std::size_t place = now.rowCount > 0 ? placeOf(i) : none;
    if (place == none) continue;
    const Joint& then = m_last.joints[place];
    if (then.rowCount != now.rowCount || then.equalRows != now.equalRows || then.boundRows != now.boundRows) continue;
    std::copy_n(m_last.impulses.begin() + then.firstRow, now.rowCount, input.jointImpulses.begin() + now.firstRow);
  }
}

// Everything of a joint but its rows.
void JointReader::readJoint(btTypedConstraint& constraint, WorldReader& reader, FallbackList& missing) {
  if (takesPartInSolver(constraint))
    missing.add("joint that overrides solveConstraintObsolete", "called in the solver");
  const WorldInput& input = reader.input();
  Joint joint{};
  joint.enabled = constraint.isEnabled() ? 1u : 0u;
  joint.iterations = constraint.getOverrideNumSolverIterations();
  joint.damping = 1.0f;
  joint.leastMobility = static_cast<float>(SIMD_EPSILON);
  bool quarantined = false;
  const auto readEnd = [&](const btRigidBody& body, uint& moved, uint& island) {
    moved = island = NO_INDEX;
    const std::uint32_t slot = reader.slotOf(body);
    if (slot == kNoSlot) {
      if (joint.enabled && (!body.isStaticOrKinematicObject() || body.getInvMass() != btScalar(0))) {
        missing.add("joint to a body outside the world", "the stock path decides what to do with it");
      }
      return;
    }
    const uint flags = input.infos.values[slot].flags;
    quarantined = quarantined || (flags & BODY_QUARANTINED);
    if (solverMoves(flags, input.masses.values[slot].inverseInertiaLocal)) moved = slot;
    if (!body.isStaticOrKinematicObject()) island = slot;
  };
  readEnd(constraint.getRigidBodyA(), joint.bodyA, joint.islandA);
  readEnd(constraint.getRigidBodyB(), joint.bodyB, joint.islandB);
  if (quarantined) joint.enabled = 0;
  m_constraints.push_back(&constraint);
  m_evaluated.push_back(!quarantined && (joint.islandA != NO_INDEX || joint.islandB != NO_INDEX));
  reader.input().joints.push_back(joint);
}

// btSequentialImpulseConstraintSolver::convertJoint, up to where it needs the solver's bodies.
void JointReader::makeRows(btTypedConstraint& constraint, const btContactSolverInfo& info, btScalar timeStep,
                           Joint& joint) {
  m_rows.resizeNoInitialize(static_cast<int>(joint.rowCount));
  std::memset(static_cast<void*>(&m_rows[0]), 0, sizeof(btSolverConstraint) * joint.rowCount);
  for (int r = 0; r < m_rows.size(); ++r) {
    m_rows[r].m_lowerLimit = -SIMD_INFINITY;
    m_rows[r].m_upperLimit = SIMD_INFINITY;
  }
  btSolverConstraint& first = m_rows[0];
  first.m_cfm = info.m_globalCfm;
  btTypedConstraint::btConstraintInfo2 info2;
  info2.fps = btScalar(1) / timeStep;
  info2.erp = info.m_erp;
  info2.m_J1linearAxis = first.m_contactNormal1;
  info2.m_J1angularAxis = first.m_relpos1CrossNormal;
  info2.m_J2linearAxis = first.m_contactNormal2;
  info2.m_J2angularAxis = first.m_relpos2CrossNormal;
  info2.rowskip = sizeof(btSolverConstraint) / sizeof(btScalar);
  info2.m_constraintError = &first.m_rhs;
  info2.cfm = &first.m_cfm;
  info2.m_lowerLimit = &first.m_lowerLimit;
  info2.m_upperLimit = &first.m_upperLimit;
  info2.m_numIterations = info.m_numIterations;
  info2.m_damping = info.m_damping;
  constraint.getInfo2(&info2);

  const btScalar breaking = constraint.getBreakingImpulseThreshold();
  joint.firstRow = static_cast<uint>(m_out->size());
  joint.damping = static_cast<float>(info2.m_damping);
  if (joint.iterations <= 0) joint.iterations = info.m_numIterations;
  for (int r = 0; r < m_rows.size(); ++r) {
    const btSolverConstraint& row = m_rows[r];
    // The device has no velocity for ends that the solver holds.
    btScalar held = 0;
    if (joint.bodyA == NO_INDEX) {
      held += speedAlong(constraint.getRigidBodyA(), row.m_contactNormal1, row.m_relpos1CrossNormal);
    }
    if (joint.bodyB == NO_INDEX) {
      held += speedAlong(constraint.getRigidBodyB(), row.m_contactNormal2, row.m_relpos2CrossNormal);
    }
    const bool noLower = row.m_lowerLimit <= -SIMD_INFINITY, noUpper = row.m_upperLimit >= SIMD_INFINITY;
    if (r < 32 && noLower && noUpper) joint.equalRows |= 1u << r;
    if (r < 32 && noLower != noUpper) joint.boundRows |= 1u << r;
    const btScalar upper = row.m_upperLimit >= breaking ? breaking : row.m_upperLimit;
    const btScalar lower = row.m_lowerLimit <= -breaking ? -breaking : row.m_lowerLimit;
    m_out->push_back({toFloat4(row.m_contactNormal1, static_cast<float>(row.m_rhs - held * info2.m_damping)),
                      toFloat4(row.m_relpos1CrossNormal, static_cast<float>(row.m_cfm)),
                      toFloat4(row.m_contactNormal2, toFinite(lower)),
                      toFloat4(row.m_relpos2CrossNormal, toFinite(upper))});
  }
}

BTGPU_TRANSLATION_END
