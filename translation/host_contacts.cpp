// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "host_contacts.h"

#include <algorithm>

#include "contact_algorithm.h"
#include "contacts.h"
#include "convert.h"
#include "kept_aabbs.h"

BTGPU_TRANSLATION_BEGIN
namespace {

const btCollisionObject& objectOf(const btBroadphaseProxy* proxy) {
  return *static_cast<const btCollisionObject*>(proxy->m_clientObject);
}

// What Bullet takes from a point whose friction directions the application has set.
void readMotion(const btManifoldPoint& from, ContactPoint& to, FallbackList& missing) {
  if (!(from.m_contactPointFlags & BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED)) return;
  if (from.m_frictionCFM != btScalar(0)) missing.add("m_frictionCFM", "of a contact point: not on the device");
  if (from.m_contactMotion1 == btScalar(0) && from.m_contactMotion2 == btScalar(0)) return;
  to.flags |= POINT_MOTION;
  to.normalWorldOnB.w = static_cast<float>(from.m_contactMotion1);
  to.lateralFrictionDir1.w = static_cast<float>(from.m_contactMotion2);
}

void writeFrictionImpulses(const ContactPoint& before, const ContactPoint& after, bool twoDirections,
                           btManifoldPoint& p) {
  // Of a point with a motion that was not solved it is still there, and Bullet leaves the impulses alone.
  const bool motion = (before.flags & POINT_MOTION) != 0;
  if (motion && before.normalWorldOnB.w == after.normalWorldOnB.w) return;
  p.m_appliedImpulseLateral1 = btScalar(after.normalWorldOnB.w);
  if (!motion || twoDirections) p.m_appliedImpulseLateral2 = btScalar(after.lateralFrictionDir1.w);
}

// What the fast mode's rows do not have.
bool hasOwnRows(const ContactPoint& p) {
  return (p.flags & (POINT_CFM | POINT_ERP | POINT_FRICTION_ANCHOR | POINT_MOTION)) != 0;
}

}  // namespace

PairSlots slotsOf(const WorldReader& reader, const btBroadphasePair& pair) {
  return {reader.slotOf(objectOf(pair.m_pProxy0)), reader.slotOf(objectOf(pair.m_pProxy1))};
}

bool collidesOnHost(const WorldReader& reader, PairSlots slots) {
  const auto isHosts = [&reader](std::uint32_t slot) { return slot != kNoSlot && reader.slots()[slot].onHost; };
  return isHosts(slots.a) || isHosts(slots.b);
}

void HostContacts::find(btDiscreteDynamicsWorld& world, const WorldReader& reader) {
  m_found.clear();
  m_manifoldCount = 0;
  auto& dispatcher = static_cast<btCollisionDispatcher&>(*world.getDispatcher());
  btBroadphasePairArray& pairs = world.getPairCache()->getOverlappingPairArray();
  btManifoldArray manifolds;
  for (int i = 0; i < pairs.size(); ++i) {
    btBroadphasePair& pair = pairs[i];
    const auto [a, b] = slotsOf(reader, pair);
    if (!collidesOnHost(reader, {a, b})) continue;
    if (a == kNoSlot || b == kNoSlot || reader.slots()[a].quarantined || reader.slots()[b].quarantined) continue;
    dispatcher.getNearCallback()(pair, dispatcher, world.getDispatchInfo());
    if (!pair.m_algorithm) continue;
    manifolds.resize(0);
    pair.m_algorithm->getAllContactManifolds(manifolds);
    if (!DeviceContactAlgorithm::isOurs(pair)) m_manifoldCount += static_cast<std::size_t>(manifolds.size());
    for (int k = 0; k < manifolds.size(); ++k) {
      if (manifolds[k]->getNumContacts() == 0) continue;
      const bool inOrder = manifolds[k]->getBody0() == &objectOf(pair.m_pProxy0);
      m_found.push_back({manifolds[k], inOrder ? a : b, inOrder ? b : a});
    }
  }
  // The order of the pairs in the cache tells how they came there, which depends on what else has gone on (DbvtUpdater,
  // RestWatch); what is solved does not.
  std::stable_sort(m_found.begin(), m_found.end(), [](const Found& x, const Found& y) {
    return pairKeyOf(x.bodyA, x.bodyB) < pairKeyOf(y.bodyA, y.bodyB);
  });
}

void HostContacts::add(const btAlignedObjectArray<btPersistentManifold*>& predictive, const WorldReader& reader) {
  m_manifoldCount += static_cast<std::size_t>(predictive.size());
  for (int i = 0; i < predictive.size(); ++i) {
    const std::uint32_t a = reader.findSlot(predictive[i]->getBody0()), b = reader.findSlot(predictive[i]->getBody1());
    if (a == kNoSlot || b == kNoSlot || reader.slots()[a].quarantined || reader.slots()[b].quarantined) continue;
    m_found.push_back({predictive[i], a, b});
  }
}

void HostContacts::fill(WorldInput& input, const WorldReader& reader, int solverMode, bool fast,
                        FallbackList& missing) {
  m_twoDirections = (solverMode & SOLVER_USE_2_FRICTION_DIRECTIONS) != 0;
  input.hostManifolds.clear();
  for (const Found& found : m_found) {
    input.hostManifolds.push_back(readManifold(*found.manifold, found.bodyA, found.bodyB));
    for (int k = 0; k < found.manifold->getNumContacts(); ++k) {
      ContactPoint& point = input.hostManifolds.back().points[k];
      if (solverMode & SOLVER_ENABLE_FRICTION_DIRECTION_CACHING)
        readMotion(found.manifold->getContactPoint(k), point, missing);
      if (fast && hasOwnRows(point)) {
        missing.add("contact point flags", "CFM, ERP, anchor or motion of a point: not in the fast mode");
      }
    }
  }
  input.hostAabbs.clear();
  for (std::uint32_t i = 0; i < input.bodyCount; ++i) {
    const BodySlot& slot = reader.slots()[i];
    const int shape = input.infos.values[i].shapeIndex;
    if (!slot.object || input.shapes.values[static_cast<std::size_t>(shape)].type != SHAPE_HOST) continue;
    input.hostAabbs.resize(input.bodyCount);
    input.hostAabbs[i] = aabbOf(*slot.object->getBroadphaseHandle(), input.regionOrigin);
  }
}

void HostContacts::writeBack(const WorldInput& input, const StepResults& results) {
  for (std::size_t i = 0; i < m_found.size(); ++i) {
    const Manifold &before = input.hostManifolds[i], &from = results.hostManifolds[i];
    btPersistentManifold& manifold = *m_found[i].manifold;
    for (int k = 0; k < from.pointCount && k < manifold.getNumContacts(); ++k) {
      btManifoldPoint& p = manifold.getContactPoint(k);
      const ContactPoint& c = from.points[k];
      p.m_appliedImpulse = btScalar(c.localPointB.w);
      writeFrictionImpulses(before.points[k], c, m_twoDirections, p);
      p.m_lateralFrictionDir1 = toBullet(c.lateralFrictionDir1);
      p.m_lateralFrictionDir2 = toBullet(c.lateralFrictionDir2);
      p.m_contactPointFlags = c.flags & POINT_BULLET_FLAGS;
    }
  }
}

void HostContacts::clear(WorldInput& input) {
  m_found.clear();
  m_manifoldCount = 0;
  input.hostManifolds.clear();
  input.hostAabbs.clear();
}

BTGPU_TRANSLATION_END
