// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "host_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_algorithm.h"
#include "contacts.h"
#include "convert.h"

BTGPU_TRANSLATION_BEGIN
namespace {

const btCollisionObject& objectOf(const btBroadphaseProxy* proxy) {
  return *static_cast<const btCollisionObject*>(proxy->m_clientObject);
}

// Bounds are rounded outwards on their way to the region's floats.
float below(double value) {
  const float f = static_cast<float>(value);
  return double(f) > value ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}
float above(double value) { return -below(-value); }

Aabb aabbOf(const btBroadphaseProxy& proxy, const double (&origin)[3]) {
  const btVector3 &lower = proxy.m_aabbMin, &upper = proxy.m_aabbMax;
  return {{below(double(lower.x()) - origin[0]), below(double(lower.y()) - origin[1]),
           below(double(lower.z()) - origin[2]), 0},
          {above(double(upper.x()) - origin[0]), above(double(upper.y()) - origin[1]),
           above(double(upper.z()) - origin[2]), 0}};
}

// What a point can ask of the solver that the device's rows do not have.
constexpr int kUnknownFlags =
    BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP | BT_CONTACT_FLAG_FRICTION_ANCHOR;

bool hasUnknownFlags(const btPersistentManifold& manifold) {
  for (int k = 0; k < manifold.getNumContacts(); ++k) {
    if (manifold.getContactPoint(k).m_contactPointFlags & kUnknownFlags) return true;
  }
  return false;
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

void HostContacts::fill(WorldInput& input, const WorldReader& reader, FallbackList& missing) const {
  input.hostManifolds.clear();
  for (const Found& found : m_found) {
    if (hasUnknownFlags(*found.manifold)) {
      missing.add("contact point flags", "a point with CFM, ERP or friction anchor of its own: not on the device yet");
    }
    input.hostManifolds.push_back(readManifold(*found.manifold, found.bodyA, found.bodyB));
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

void HostContacts::writeBack(const StepResults& results) {
  for (std::size_t i = 0; i < m_found.size(); ++i) {
    const Manifold& from = results.hostManifolds[i];
    btPersistentManifold& manifold = *m_found[i].manifold;
    for (int k = 0; k < from.pointCount && k < manifold.getNumContacts(); ++k) {
      btManifoldPoint& p = manifold.getContactPoint(k);
      const ContactPoint& c = from.points[k];
      p.m_appliedImpulse = btScalar(c.localPointB.w);
      p.m_appliedImpulseLateral1 = btScalar(c.normalWorldOnB.w);
      p.m_appliedImpulseLateral2 = btScalar(c.lateralFrictionDir1.w);
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
