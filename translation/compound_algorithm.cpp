// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "compound_algorithm.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <new>
#include <utility>

#include "../gpu_engine/slots.h"
#include "convert.h"
#include "exact_type.h"

BTGPU_TRANSLATION_BEGIN

// Elements of the dispatcher's pool are made for the largest of Bullet's own algorithms.
static_assert(sizeof(DeviceCompoundAlgorithm) <= sizeof(btConvexConvexAlgorithm), "does not fit the dispatcher's pool");

namespace {

// Points on triangles don't name the compound's shape.
bool mayBeOfSameShapes(const btManifoldPoint& p, const btManifoldPoint& q) {
  return p.m_index0 == q.m_index0 && (p.m_index1 == q.m_index1 || p.m_partId1 >= 0 || q.m_partId1 >= 0);
}

// The point of `from` that lies nearest to where `p` does on body A; null if it has none. `distanceSqr`: between them.
const btManifoldPoint* nearestPoint(const btPersistentManifold& from, const btManifoldPoint& p, btScalar& distanceSqr) {
  const btManifoldPoint* nearest = nullptr;
  for (int k = 0; k < from.getNumContacts(); ++k) {
    const btManifoldPoint& q = from.getContactPoint(k);
    const btScalar d = (q.m_localPointA - p.m_localPointA).length2();
    if (!mayBeOfSameShapes(p, q) || (nearest && d >= distanceSqr)) continue;
    distanceSqr = d;
    nearest = &q;
  }
  return nearest;
}

// Which of Bullet's manifolds is of the same shapes; null if none is. Several may be where points don't tell.
btPersistentManifold* sameShapes(const btManifoldArray& manifolds, const btPersistentManifold& from) {
  btPersistentManifold* best = nullptr;
  btScalar least = 0;
  for (int i = 0; i < manifolds.size(); ++i) {
    if (manifolds[i]->getBody0() != from.getBody0()) continue;
    for (int k = 0; k < from.getNumContacts(); ++k) {
      btScalar d;
      if (!nearestPoint(*manifolds[i], from.getContactPoint(k), d) || (best && d >= least)) continue;
      best = manifolds[i];
      least = d;
    }
  }
  return best;
}

// Impulses of the points that Bullet has found too. The others, of which it finds one a step (but between boxes), go
// along while there is room.
void carryPoints(const btPersistentManifold& from, btPersistentManifold& to) {
  const btScalar limit = from.getContactBreakingThreshold() * from.getContactBreakingThreshold();
  for (int k = 0; k < from.getNumContacts(); ++k) {
    btManifoldPoint known = from.getContactPoint(k);
    btScalar d;
    auto* same = const_cast<btManifoldPoint*>(nearestPoint(to, known, d));
    if (same && d < limit) {
      same->m_appliedImpulse = known.m_appliedImpulse;
      same->m_appliedImpulseLateral1 = known.m_appliedImpulseLateral1;
      same->m_appliedImpulseLateral2 = known.m_appliedImpulseLateral2;
      same->m_lifeTime = known.m_lifeTime;
    } else if (to.getNumContacts() < MANIFOLD_CACHE_SIZE) {
      known.m_userPersistentData = nullptr;  // stays with the manifold that goes
      to.addManifoldPoint(known);
    }
  }
  to.refreshContactPoints(to.getBody0()->getWorldTransform(), to.getBody1()->getWorldTransform());
}

}  // namespace

DeviceCompoundAlgorithm::DeviceCompoundAlgorithm(btDispatcher& dispatcher, std::shared_ptr<ManifoldRegistry> registry)
    : m_registry(std::move(registry)) {
  m_dispatcher = &dispatcher;
}

DeviceCompoundAlgorithm::~DeviceCompoundAlgorithm() {
  releaseAll();
  if (m_stock) destroy(*m_dispatcher, m_stock);
}

DeviceCompoundAlgorithm* DeviceCompoundAlgorithm::find(const btBroadphasePair& pair) {
  return pair.m_algorithm && isExactly<DeviceCompoundAlgorithm>(*pair.m_algorithm)
             ? static_cast<DeviceCompoundAlgorithm*>(pair.m_algorithm)
             : nullptr;
}

DeviceCompoundAlgorithm& DeviceCompoundAlgorithm::of(btBroadphasePair& pair, btDispatcher& dispatcher,
                                                     const std::shared_ptr<ManifoldRegistry>& registry) {
  DeviceCompoundAlgorithm* ours = find(pair);
  if (ours && ours->m_registry == registry && !ours->m_stock) return *ours;
  if (pair.m_algorithm) destroy(dispatcher, pair.m_algorithm);
  void* memory = dispatcher.allocateCollisionAlgorithm(sizeof(DeviceCompoundAlgorithm));
  ours = new (memory) DeviceCompoundAlgorithm(dispatcher, registry);
  pair.m_algorithm = ours;
  return *ours;
}

const DeviceCompoundAlgorithm::Contact* DeviceCompoundAlgorithm::contact(ulong key, const btCollisionObject& a,
                                                                         const btCollisionObject& b) {
  const auto known =
      std::find_if(m_contacts.begin(), m_contacts.end(), [key](const Contact& c) { return c.key == key; });
  if (known != m_contacts.end()) return &*known;
  btPersistentManifold* manifold = m_dispatcher->getNewManifold(&a, &b);
  if (!manifold) return nullptr;
  m_contacts.push_back({key, manifold, m_registry->add(manifold)});
  return &m_contacts.back();
}

void DeviceCompoundAlgorithm::release(const btPersistentManifold* manifold) {
  const auto it = std::find_if(m_contacts.begin(), m_contacts.end(),
                               [manifold](const Contact& c) { return c.manifold == manifold; });
  if (it == m_contacts.end()) return;
  const Contact gone = *it;
  m_contacts.erase(it);
  m_registry->remove(gone.handle);
  m_dispatcher->releaseManifold(gone.manifold);
}

void DeviceCompoundAlgorithm::releaseAll() {
  while (!m_contacts.empty()) release(m_contacts.back().manifold);
}

bool DeviceCompoundAlgorithm::makeStock(const btCollisionObjectWrapper* body0, const btCollisionObjectWrapper* body1) {
  if (!m_stock) m_stock = m_dispatcher->findAlgorithm(body0, body1, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  return m_stock != nullptr;
}

void DeviceCompoundAlgorithm::processCollision(const btCollisionObjectWrapper* body0,
                                               const btCollisionObjectWrapper* body1, const btDispatcherInfo& info,
                                               btManifoldResult* result) {
  if (!makeStock(body0, body1)) return;
  m_stock->processCollision(body0, body1, info, result);
  if (m_contacts.empty()) return;
  btManifoldArray manifolds;
  m_stock->getAllContactManifolds(manifolds);
  for (const Contact& c : m_contacts) {
    if (btPersistentManifold* same = sameShapes(manifolds, *c.manifold)) carryPoints(*c.manifold, *same);
  }
  releaseAll();
}

btScalar DeviceCompoundAlgorithm::calculateTimeOfImpact(btCollisionObject* body0, btCollisionObject* body1,
                                                        const btDispatcherInfo& info, btManifoldResult* result) {
  const btCollisionObjectWrapper w0(nullptr, body0->getCollisionShape(), body0, body0->getWorldTransform(), -1, -1);
  const btCollisionObjectWrapper w1(nullptr, body1->getCollisionShape(), body1, body1->getWorldTransform(), -1, -1);
  return makeStock(&w0, &w1) ? m_stock->calculateTimeOfImpact(body0, body1, info, result) : btScalar(1);
}

void DeviceCompoundAlgorithm::getAllContactManifolds(btManifoldArray& manifolds) {
  for (const Contact& c : m_contacts) manifolds.push_back(c.manifold);
  if (m_stock) m_stock->getAllContactManifolds(manifolds);
}

std::uint32_t slotIn(const WorldReader& reader, ulong key, std::uint32_t body) {
  const auto low = static_cast<std::uint32_t>(key >> 32), high = static_cast<std::uint32_t>(key);
  return reader.ownerOf(low) == body ? low : high;
}

namespace {

// True if a slot of a compound's holds a mesh around a point in the body's axes.
bool isMeshAround(const WorldInput& input, std::uint32_t slot, const btVector3& point, btScalar reach) {
  const Shape& shape = input.shapes.values[static_cast<std::size_t>(input.infos.values[slot].shapeIndex)];
  if (shape.type != SHAPE_MESH) return false;
  constexpr double kNoOrigin[3] = {0, 0, 0};
  const btVector3 at = toTransform(input.childPoses.values[slot], kNoOrigin).invXform(point) - toBullet(shape.centre);
  const btVector3 half = toBullet(shape.extents) + btVector3(reach, reach, reach);
  return btFabs(at.x()) <= half.x() && btFabs(at.y()) <= half.y() && btFabs(at.z()) <= half.z();
}

}  // namespace

bool slotsOfManifold(const WorldReader& reader, const btPersistentManifold& manifold, std::uint32_t& a,
                     std::uint32_t& b) {
  const WorldInput& input = reader.input();
  const btScalar reach = manifold.getContactBreakingThreshold();
  const auto slotOf = [&](std::uint32_t body, int part, int index, const btVector3& point, std::uint32_t& slot) {
    slot = body;
    const auto* children = reader.childrenOf(body);
    if (!children) return true;
    const auto isMeant = [&](std::uint32_t c) {
      return part >= 0 ? isMeshAround(input, c, point, reach) : childOf(input.infos.values, c) == index;
    };
    if (std::count_if(children->begin(), children->end(), isMeant) != 1) return false;
    slot = *std::find_if(children->begin(), children->end(), isMeant);
    return true;
  };
  if (manifold.getNumContacts() == 0) return !reader.childrenOf(a) && !reader.childrenOf(b);
  const btManifoldPoint& p = manifold.getContactPoint(0);
  return slotOf(a, p.m_partId0, p.m_index0, p.m_localPointA, a) &&
         slotOf(b, p.m_partId1, p.m_index1, p.m_localPointB, b);
}

BTGPU_TRANSLATION_END
