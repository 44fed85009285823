// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "shadow_world.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>

#include <algorithm>

#include "../convert.h"
#include "../private_access.h"
#include "../read_queries.h"

BTGPU_TRANSLATION_BEGIN
namespace {

// A copy of an object's base part that stays in its own world and keeps nothing of the application's.
template <typename Base>
class Copy : public Base {
 public:
  using Base::Base;

  void copy(const Base& from) {
    btBroadphaseProxy* proxy = this->m_broadphaseHandle;
    const int position = this->m_worldArrayIndex;
    Base::operator=(from);
    this->m_broadphaseHandle = proxy;
    this->m_worldArrayIndex = position;
    this->m_companionId = -1;
    this->m_userObjectPointer = nullptr;
    this->m_extensionPointer = nullptr;
    this->m_collisionFlags &= ~btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK;
    this->m_objectsWithoutCollisionCheck.clear();
    this->m_checkCollideWith = 0;
  }
};

class PlainCopy : public Copy<btCollisionObject> {
 public:
  void follow(const btCollisionObject& from) {
    copy(from);
    m_internalType = CO_COLLISION_OBJECT;  // also of a ghost
  }
};

class BodyCopy : public Copy<btRigidBody> {
 public:
  BodyCopy() : Copy(btRigidBodyConstructionInfo(0, nullptr, nullptr)) {}
  void follow(const btRigidBody& from) {
    copy(from);
    setMotionState(nullptr);
    (this->*memberPointer(ConstraintRefs())).clear();
  }
};

void copyTo(btCollisionObject& clone, const btCollisionObject& from) {
  if (const btRigidBody* body = btRigidBody::upcast(&from)) {
    static_cast<BodyCopy&>(clone).follow(*body);
  } else {
    static_cast<PlainCopy&>(clone).follow(from);
  }
}

}  // namespace

// Gives the solver the rows that were recorded in place of a joint's own.
class ReplayJoint : public btTypedConstraint {
 public:
  ReplayJoint(btRigidBody& a, btRigidBody& b, const Joint& joint, const JointRow* rows)
      : btTypedConstraint(POINT2POINT_CONSTRAINT_TYPE, a, b), m_joint(joint), m_rows(rows, rows + joint.rowCount) {
    setOverrideNumSolverIterations(joint.iterations);
    setEnabled(joint.enabled != 0);
  }

  void getInfo1(btConstraintInfo1* info) override {
    info->m_numConstraintRows = static_cast<int>(m_joint.rowCount);
    info->nub = 0;
  }
  void getInfo2(btConstraintInfo2* info) override;
  void setParam(int, btScalar, int) override {}
  btScalar getParam(int, int) const override { return 0; }

 private:
  Joint m_joint;
  std::vector<JointRow> m_rows;
};

void ReplayJoint::getInfo2(btConstraintInfo2* info) {
  const auto store = [](const float4& from, btScalar* to) {
    to[0] = btScalar(from.x);
    to[1] = btScalar(from.y);
    to[2] = btScalar(from.z);
  };
  const auto speed = [](const btRigidBody& body, const float4& linear, const float4& angular) {
    return toBullet(linear).dot(body.getLinearVelocity()) + toBullet(angular).dot(body.getAngularVelocity());
  };
  info->m_damping = btScalar(m_joint.damping);
  for (std::size_t r = 0; r < m_rows.size(); ++r) {
    const JointRow& row = m_rows[r];
    const std::size_t at = r * static_cast<std::size_t>(info->rowskip);
    store(row.linearA, info->m_J1linearAxis + at);
    store(row.angularA, info->m_J1angularAxis + at);
    store(row.linearB, info->m_J2linearAxis + at);
    store(row.angularB, info->m_J2angularAxis + at);
    // What ends that the solver holds move with was taken off when the row was recorded, and stock does so again.
    btScalar held = 0;
    if (m_joint.bodyA == NO_INDEX) held += speed(getRigidBodyA(), row.linearA, row.angularA);
    if (m_joint.bodyB == NO_INDEX) held += speed(getRigidBodyB(), row.linearB, row.angularB);
    info->m_constraintError[at] = btScalar(row.linearA.w) + held * info->m_damping;
    info->cfm[at] = btScalar(row.angularA.w);
    info->m_lowerLimit[at] = btScalar(row.linearB.w);
    info->m_upperLimit[at] = btScalar(row.angularB.w);
  }
}

ShadowWorld::ShadowWorld() : m_fixed(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, nullptr)) {}

ShadowWorld::~ShadowWorld() {
  m_constraints.clear();
  m_nonStaticRigidBodies.resize(0);
  // Nothing here looks at shapes: the application may have destroyed them by now.
  for (Clone& clone : m_clones) {
    if (clone.object) btDiscreteDynamicsWorld::removeCollisionObject(clone.object.get());
  }
}

ShadowWorld::Clone ShadowWorld::describe(const btCollisionObject& original) {
  const btBroadphaseProxy& proxy = *original.getBroadphaseHandle();
  Clone clone;
  clone.original = &original;
  clone.shape = original.getCollisionShape();
  clone.flags = original.getCollisionFlags();
  clone.type = original.getInternalType();
  clone.group = clone.ownGroup = proxy.m_collisionFilterGroup;
  clone.mask = clone.ownMask = proxy.m_collisionFilterMask;
  clone.uniqueId = proxy.m_uniqueId;
  return clone;
}

bool ShadowWorld::sameObject(const Clone& a, const Clone& b) {
  return a.original == b.original && a.shape == b.shape && a.flags == b.flags && a.type == b.type &&
         a.group == b.group && a.mask == b.mask && a.uniqueId == b.uniqueId;
}

void ShadowWorld::follow(btDiscreteDynamicsWorld& world, const WorldReader& reader) {
  followSettings(world);
  const WorldInput& input = reader.input();
  const std::vector<BodySlot>& slots = reader.slots();
  std::vector<Clone> wanted(input.bodyCount);
  m_onHost.assign(input.bodyCount, false);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!slots[i].object || (input.infos.values[i].flags & BODY_QUARANTINED)) continue;
    wanted[i] = describe(*slots[i].object);
    if (input.onlyListedPairs) wanted[i].group = wanted[i].mask = -1;  // as leavesOut() says
    m_onHost[i] = slots[i].onHost;
  }
  m_listedPairs = input.listedPairs;
  m_onlyListed = input.onlyListedPairs;
  m_constraints.clear();
  m_joints.clear();
  // Made anew below; empty, so that nothing that is removed is looked for in it.
  m_nonStaticRigidBodies.resize(0);
  removeStale(wanted);
  m_clones.resize(wanted.size());
  std::vector<btCollisionObject*> objects(wanted.size(), nullptr);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!wanted[i].original) continue;
    if (m_clones[i].object) {
      m_clones[i].ownGroup = wanted[i].ownGroup;
      m_clones[i].ownMask = wanted[i].ownMask;
      copyTo(*m_clones[i].object, *wanted[i].original);
    } else {
      m_clones[i] = std::move(wanted[i]);
      add(m_clones[i]);
    }
    objects[i] = m_clones[i].object.get();
    btRigidBody* body = btRigidBody::upcast(objects[i]);
    if (body && reader.isIntegrated(static_cast<std::uint32_t>(i))) m_nonStaticRigidBodies.push_back(body);
  }
  setObjects(std::move(objects));
  followAabbs(world, input);
}

void ShadowWorld::removeStale(const std::vector<Clone>& wanted) {
  for (std::size_t i = 0; i < m_clones.size(); ++i) {
    Clone& clone = m_clones[i];
    if (!clone.object || (i < wanted.size() && wanted[i].original && sameObject(clone, wanted[i]))) continue;
    btDiscreteDynamicsWorld::removeCollisionObject(clone.object.get());
    clone = Clone();
  }
}

void ShadowWorld::add(Clone& clone) {
  if (btRigidBody::upcast(clone.original)) {
    clone.object = std::make_unique<BodyCopy>();
  } else {
    clone.object = std::make_unique<PlainCopy>();
  }
  copyTo(*clone.object, *clone.original);
  // The order of two bodies in a manifold is that of their proxies' ids.
  pairFinder().m_gid = clone.uniqueId - 1;
  btDiscreteDynamicsWorld::addCollisionObject(clone.object.get(), clone.group, clone.mask);
}

void ShadowWorld::followSettings(btDiscreteDynamicsWorld& world) {
  getSolverInfo() = world.getSolverInfo();
  getDispatchInfo() = world.getDispatchInfo();
  getDispatchInfo().m_debugDraw = nullptr;
  setForceUpdateAllAabbs(world.getForceUpdateAllAabbs());
  setApplySpeculativeContactRestitution(world.getApplySpeculativeContactRestitution());
  // The pool of contacts is the shadow's own.
  static_cast<btCollisionDispatcher*>(getDispatcher())
      ->setDispatcherFlags(static_cast<btCollisionDispatcher*>(world.getDispatcher())->getDispatcherFlags() &
                           ~btCollisionDispatcher::CD_DISABLE_CONTACTPOOL_DYNAMIC_ALLOCATION);
}

btRigidBody& ShadowWorld::end(const WorldReader& reader, const btRigidBody& original) {
  const std::uint32_t slot = reader.slotOf(original);
  btRigidBody* clone = slot == kNoSlot ? nullptr : body(slot);
  return clone ? *clone : m_fixed;
}

void ShadowWorld::followJoints(const WorldReader& reader, const JointReader& joints) {
  m_constraints.clear();
  m_joints.clear();
  const WorldInput& input = reader.input();
  for (std::size_t i = 0; i < input.joints.size(); ++i) {
    const Joint& joint = input.joints[i];
    const btTypedConstraint& original = *joints.constraints()[i];
    m_joints.push_back(std::make_unique<ReplayJoint>(end(reader, original.getRigidBodyA()),
                                                     end(reader, original.getRigidBodyB()), joint,
                                                     input.jointRows.data() + joint.firstRow));
    m_constraints.push_back(m_joints.back().get());
  }
}

// Objects that are not active keep the AABBs that they have, wherever they are moved. Where the host's are not kept
// current, the device takes those anew that the application has changed something of.
void ShadowWorld::followAabbs(const btDiscreteDynamicsWorld& world, const WorldInput& input) {
  if (world.getForceUpdateAllAabbs()) return;
  const LeafOf leafOf = leafFinderOf(*world.getBroadphase());
  const auto isIn = [](const std::vector<std::uint32_t>& list, std::size_t slot) {
    return std::binary_search(list.begin(), list.end(), static_cast<std::uint32_t>(slot));
  };
  const bool all = !input.shapes.changed.empty() || input.replaceManifolds;
  for (std::size_t i = 0; i < m_clones.size(); ++i) {
    Clone& clone = m_clones[i];
    if (!clone.object || clone.object->isActive()) continue;
    if (input.hostAabbsCurrent) {
      const btBroadphaseProxy& kept = *leafOf(*clone.original->getBroadphaseHandle());
      pairFinder().setAabb(clone.object->getBroadphaseHandle(), kept.m_aabbMin, kept.m_aabbMax, getDispatcher());
    } else if (all || isIn(input.poses.changed, i) || isIn(input.infos.changed, i)) {
      updateSingleAabb(clone.object.get());
    }
  }
}

bool ShadowWorld::ignores(uint a, uint b) const {
  const ulong key = pairKeyOf(a, b) | (m_onlyListed ? PAIR_KEEPS_CONTACTS : 0);
  return std::binary_search(m_listedPairs.begin(), m_listedPairs.end(), key);
}

bool ShadowWorld::leavesOut(const btCollisionObject& a, const btCollisionObject& b) const {
  const uint slotA = slotOf(a), slotB = slotOf(b);
  return slotA == NO_INDEX || slotB == NO_INDEX || m_onHost[slotA] || m_onHost[slotB] || !mayCollide(slotA, slotB);
}

bool ShadowWorld::passes(const btCollisionObject& a, const btCollisionObject& b) const {
  const uint slotA = slotOf(a), slotB = slotOf(b);
  if (slotA == NO_INDEX || slotB == NO_INDEX) return true;
  const Clone &x = m_clones[slotA], &y = m_clones[slotB];
  const bool matches = (x.ownGroup & y.ownMask) && (y.ownGroup & x.ownMask);
  return !matches || !mayCollide(slotA, slotB);
}

// As far as the application has a say in it.
bool ShadowWorld::mayCollide(uint slotA, uint slotB) const {
  return std::binary_search(m_listedPairs.begin(), m_listedPairs.end(), pairKeyOf(slotA, slotB)) == m_onlyListed;
}

BTGPU_TRANSLATION_END
