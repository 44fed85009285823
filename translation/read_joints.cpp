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
#include "parallel.h"
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
  // Unless the application hides its inline functions (-fvisibility-inlines-hidden): then its classes have a copy of
  // their own of what they inherit.
  if (returnsAtOnce(entryOf(constraint))) return false;
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

// Damping would change something.
bool isDamped(const WorldInput& input, std::uint32_t slot) {
  const BodyDamping& d = input.dampings.values[slot];
  return d.linear != 0.0f || d.angular != 0.0f || (input.infos.values[slot].flags & BODY_ADDITIONAL_DAMPING);
}

// Some joints forget their impulse here; whether stock would have come here at all, the device knows after the step.
// With point to point joints that would be all: what else they write nobody reads.
void buildJacobian(btTypedConstraint& constraint) {
  if (isExactly<btPoint2PointConstraint>(constraint)) return;
  const btScalar impulse = constraint.internalGetAppliedImpulse();
  constraint.buildJacobian();
  constraint.internalSetAppliedImpulse(impulse);
}

bool areDifferent(std::vector<btTypedConstraint*> constraints) {
  std::sort(constraints.begin(), constraints.end());
  return std::adjacent_find(constraints.begin(), constraints.end()) == constraints.end();
}

constexpr std::size_t kGrain = 128;  // joints

// The rows of a joint, as getInfo2 gets them; used again from joint to joint.
class RowMaker {
 public:
  RowMaker(const btContactSolverInfo& info, btScalar timeStep) : m_info(info), m_timeStep(timeStep) {}
  // joint.rowCount rows, the first one at `out`.
  void make(btTypedConstraint& constraint, Joint& joint, JointRow* out);

 private:
  const btContactSolverInfo& m_info;
  btScalar m_timeStep;
  btAlignedObjectArray<btSolverConstraint> m_rows;
};

}  // namespace

void JointReader::read(btDiscreteDynamicsWorld& world, btScalar timeStep, WorldReader& reader, FallbackList& missing,
                       btScalar ahead) {
  WorldInput& input = reader.input();
  m_last.constraints.swap(m_constraints);
  m_last.joints.swap(input.joints);
  m_last.impulses.swap(m_impulses);
  m_impulses.clear();
  input.jointImpulses.clear();
  readJoints(world, reader, missing);
  if (!missing.empty() || m_constraints.empty()) {
    input.jointRows.clear();
    return;
  }

  const Zone zone("convertJoints");
  DampedBodies damped(timeStep);
  damped.damp(dampedBodies(reader));
  AdvancedBodies advanced(ahead);
  advanced.reserve(input.bodyCount);
  for (std::size_t i = 0; i < m_constraints.size() && ahead != btScalar(0); ++i) {
    for (btRigidBody* body : {&m_constraints[i]->getRigidBodyA(), &m_constraints[i]->getRigidBodyB()}) {
      advanced.advance(*body, reader.slotOf(*body));
    }
  }
  // In the order of stock's convertJoints, where the application's own classes could see it.
  forEachJoint([&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      if (!m_evaluated[i]) continue;
      buildJacobian(*m_constraints[i]);
      if (m_atOnce) countRows(i, input.joints[i]);
    }
  });
  for (std::size_t i = 0; i < m_constraints.size() && !m_atOnce; ++i) countRows(i, input.joints[i]);
  placeRows(input);
  const btContactSolverInfo& info = world.getSolverInfo();
  forEachJoint([&](std::size_t first, std::size_t last) {
    RowMaker rows(info, timeStep);
    for (std::size_t i = first; i < last; ++i) {
      Joint& joint = input.joints[i];
      if (joint.rowCount > 0) rows.make(*m_constraints[i], joint, &input.jointRows[joint.firstRow]);
    }
  });
  recallImpulses(input);
}

// work(first, last): on several threads if the joints allow it, else all in their order.
template <typename Work>
void JointReader::forEachJoint(const Work& work) {
  if (m_atOnce) {
    parallelFor(m_constraints.size(), kGrain, work);
  } else {
    work(0, m_constraints.size());
  }
}

void JointReader::countRows(std::size_t i, Joint& joint) const {
  if (!m_evaluated[i] || !joint.enabled) return;
  btTypedConstraint::btConstraintInfo1 info1{};  // btContactConstraint leaves it as it is
  m_constraints[i]->getInfo1(&info1);
  joint.rowCount = static_cast<uint>(btMax(0, info1.m_numConstraintRows));
}

void JointReader::placeRows(WorldInput& input) const {
  std::size_t count = 0;
  for (Joint& joint : input.joints) {
    if (joint.rowCount > 0) joint.firstRow = static_cast<uint>(count);
    count += joint.rowCount;
  }
  input.jointRows.resize(count);  // all written below; those of the last step are not cleared, which would take as long
}

// Those of the joints' bodies whose velocities damping changes, each once.
std::vector<btRigidBody*> JointReader::dampedBodies(const WorldReader& reader) {
  const WorldInput& input = reader.input();
  std::vector<btRigidBody*> bodies;
  m_isLinked.assign(input.bodyCount, 0);
  for (const Joint& joint : input.joints) {
    for (const uint slot : {joint.islandA, joint.islandB}) {
      if (slot == NO_INDEX || m_isLinked[slot]) continue;
      m_isLinked[slot] = 1;
      if (reader.isIntegrated(slot) && isDamped(input, slot))
        bodies.push_back(static_cast<btRigidBody*>(reader.objectOf(slot)));
    }
  }
  return bodies;
}

// Everything of the joints but their rows.
void JointReader::readJoints(btDiscreteDynamicsWorld& world, WorldReader& reader, FallbackList& missing) {
  const auto count = static_cast<std::size_t>(world.getNumConstraints());
  m_constraints.clear();
  for (int i = 0; i < world.getNumConstraints(); ++i) m_constraints.push_back(world.getConstraint(i));
  if (m_constraints != m_last.constraints) m_distinct = areDifferent(m_constraints);
  m_evaluated.resize(count);
  reader.input().joints.resize(count);
  m_chunks.resize(chunkCount(count, kGrain));
  parallelChunks(count, kGrain, [&](std::size_t c, std::size_t first, std::size_t last) {
    Chunk& chunk = m_chunks[c];
    chunk.missing.clear();
    chunk.bulletsOwn = true;
    for (std::size_t i = first; i < last; ++i) {
      chunk.bulletsOwn = chunk.bulletsOwn && isBulletsOwn(*m_constraints[i]);
      readJoint(i, reader, chunk.missing);
    }
  });
  m_atOnce = m_distinct;
  for (const Chunk& chunk : m_chunks) {
    m_atOnce = m_atOnce && chunk.bulletsOwn;
    missing.addAll(chunk.missing);
  }
  for (std::size_t i = 0; i < count && !m_atOnce; ++i) {
    if (takesPartInSolver(*m_constraints[i]))
      missing.add("joint that overrides solveConstraintObsolete", "called in the solver");
  }
}

// Rows are those of the last step if a joint's are as many and of the same kinds.
void JointReader::recallImpulses(WorldInput& input) {
  if (m_last.impulses.empty()) return;
  input.jointImpulses.assign(input.jointRows.size(), 0.0f);
  const auto recall = [&](const Joint& now, const Joint& then) {
    if (then.rowCount != now.rowCount || then.equalRows != now.equalRows || then.boundRows != now.boundRows) return;
    std::copy_n(m_last.impulses.begin() + then.firstRow, now.rowCount, input.jointImpulses.begin() + now.firstRow);
  };
  if (m_last.constraints == m_constraints) {  // as mostly
    parallelFor(m_constraints.size(), kGrain, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) recall(input.joints[i], m_last.joints[i]);
    });
    return;
  }
  std::unordered_map<const btTypedConstraint*, std::size_t> places;
  for (std::size_t k = 0; k < m_last.constraints.size(); ++k) places.emplace(m_last.constraints[k], k);
  for (std::size_t i = 0; i < m_constraints.size(); ++i) {
    const auto found = places.find(m_constraints[i]);
    if (found != places.end()) recall(input.joints[i], m_last.joints[found->second]);
  }
}

void JointReader::readJoint(std::size_t i, WorldReader& reader, FallbackList& missing) {
  const btTypedConstraint& constraint = *m_constraints[i];
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
  m_evaluated[i] = !quarantined && (joint.islandA != NO_INDEX || joint.islandB != NO_INDEX);
  reader.input().joints[i] = joint;
}

// btSequentialImpulseConstraintSolver::convertJoint, up to where it needs the solver's bodies.
void RowMaker::make(btTypedConstraint& constraint, Joint& joint, JointRow* out) {
  m_rows.resizeNoInitialize(static_cast<int>(joint.rowCount));
  std::memset(static_cast<void*>(&m_rows[0]), 0, sizeof(btSolverConstraint) * joint.rowCount);
  for (int r = 0; r < m_rows.size(); ++r) {
    m_rows[r].m_lowerLimit = -SIMD_INFINITY;
    m_rows[r].m_upperLimit = SIMD_INFINITY;
  }
  btSolverConstraint& first = m_rows[0];
  first.m_cfm = m_info.m_globalCfm;
  btTypedConstraint::btConstraintInfo2 info2;
  info2.fps = btScalar(1) / m_timeStep;
  info2.erp = m_info.m_erp;
  info2.m_J1linearAxis = first.m_contactNormal1;
  info2.m_J1angularAxis = first.m_relpos1CrossNormal;
  info2.m_J2linearAxis = first.m_contactNormal2;
  info2.m_J2angularAxis = first.m_relpos2CrossNormal;
  info2.rowskip = sizeof(btSolverConstraint) / sizeof(btScalar);
  info2.m_constraintError = &first.m_rhs;
  info2.cfm = &first.m_cfm;
  info2.m_lowerLimit = &first.m_lowerLimit;
  info2.m_upperLimit = &first.m_upperLimit;
  info2.m_numIterations = m_info.m_numIterations;
  info2.m_damping = m_info.m_damping;
  constraint.getInfo2(&info2);

  const btScalar breaking = constraint.getBreakingImpulseThreshold();
  joint.damping = static_cast<float>(info2.m_damping);
  if (joint.iterations <= 0) joint.iterations = m_info.m_numIterations;
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
    out[r] = {toFloat4(row.m_contactNormal1, static_cast<float>(row.m_rhs - held * info2.m_damping)),
              toFloat4(row.m_relpos1CrossNormal, static_cast<float>(row.m_cfm)),
              toFloat4(row.m_contactNormal2, toFinite(lower)), toFloat4(row.m_relpos2CrossNormal, toFinite(upper))};
  }
}

BTGPU_TRANSLATION_END
