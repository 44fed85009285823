// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "contacts.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <utility>

#include "../gpu_engine/slots.h"
#include "../gpu_engine/zone.h"
#include "compound_algorithm.h"
#include "convert.h"

BTGPU_TRANSLATION_BEGIN
namespace {

std::pair<std::uint32_t, std::uint32_t> pairOrder(const Manifold& m) {
  return {std::min(m.bodyA, m.bodyB), std::max(m.bodyA, m.bodyB)};
}

}  // namespace

ContactPoint readContactPoint(const btManifoldPoint& p) {
  const auto f = [](btScalar v) { return static_cast<float>(v); };
  ContactPoint c{};
  c.localPointA = toFloat4(p.m_localPointA, f(p.m_distance1));
  c.localPointB = toFloat4(p.m_localPointB, f(p.m_appliedImpulse));
  c.normalWorldOnB = toFloat4(p.m_normalWorldOnB, f(p.m_appliedImpulseLateral1));
  c.lateralFrictionDir1 = toFloat4(p.m_lateralFrictionDir1, f(p.m_appliedImpulseLateral2));
  c.lateralFrictionDir2 = toFloat4(p.m_lateralFrictionDir2);
  c.combined = {f(p.m_combinedFriction), f(p.m_combinedRestitution), f(p.m_combinedRollingFriction),
                f(p.m_combinedSpinningFriction)};
  c.combinedStiffness = f(p.m_combinedContactStiffness1);
  c.combinedDamping = f(p.m_combinedContactDamping1);
  c.lifeTime = p.m_lifeTime;
  c.flags = p.m_contactPointFlags;
  return c;
}

void writeContactPoint(const ContactPoint& c, const btTransform& a, const btTransform& b, btManifoldPoint& p) {
  p.m_localPointA = toBullet(c.localPointA);
  p.m_localPointB = toBullet(c.localPointB);
  p.m_normalWorldOnB = toBullet(c.normalWorldOnB);
  p.m_distance1 = btScalar(c.localPointA.w);
  p.m_positionWorldOnA = a * p.m_localPointA;
  p.m_positionWorldOnB = b * p.m_localPointB;
  p.m_appliedImpulse = btScalar(c.localPointB.w);
  p.m_appliedImpulseLateral1 = btScalar(c.normalWorldOnB.w);
  p.m_appliedImpulseLateral2 = btScalar(c.lateralFrictionDir1.w);
  p.m_lateralFrictionDir1 = toBullet(c.lateralFrictionDir1);
  p.m_lateralFrictionDir2 = toBullet(c.lateralFrictionDir2);
  p.m_combinedFriction = btScalar(c.combined.x);
  p.m_combinedRestitution = btScalar(c.combined.y);
  p.m_combinedRollingFriction = btScalar(c.combined.z);
  p.m_combinedSpinningFriction = btScalar(c.combined.w);
  p.m_combinedContactStiffness1 = btScalar(c.combinedStiffness);
  p.m_combinedContactDamping1 = btScalar(c.combinedDamping);
  p.m_lifeTime = c.lifeTime;
  p.m_contactPointFlags = c.flags & POINT_BULLET_FLAGS;
  p.m_prevRHS = p.m_contactMotion1 = p.m_contactMotion2 = p.m_frictionCFM = btScalar(0);
  p.m_partId0 = p.m_partId1 = p.m_index0 = p.m_index1 = -1;
}

Manifold readManifold(const btPersistentManifold& from, std::uint32_t bodyA, std::uint32_t bodyB) {
  Manifold m{};
  m.bodyA = bodyA;
  m.bodyB = bodyB;
  m.pointCount = from.getNumContacts();
  m.breakingThreshold = static_cast<float>(from.getContactBreakingThreshold());
  m.processingThreshold = static_cast<float>(from.getContactProcessingThreshold());
  for (int k = 0; k < m.pointCount; ++k) m.points[k] = readContactPoint(from.getContactPoint(k));
  return m;
}

std::vector<Manifold> readManifolds(btDispatcher& dispatcher, const WorldReader& reader,
                                    const btManifoldArray& predictive) {
  const Zone zone("readManifolds");
  std::vector<Manifold> manifolds;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& from = *dispatcher.getManifoldByIndexInternal(i);
    if (predictive.findLinearSearch(const_cast<btPersistentManifold*>(&from)) < predictive.size()) continue;
    std::uint32_t a = reader.findSlot(from.getBody0()), b = reader.findSlot(from.getBody1());
    if (a == kNoSlot || b == kNoSlot || reader.slots()[a].onHost || reader.slots()[b].onHost) continue;
    if (!slotsOfManifold(reader, from, a, b)) continue;
    manifolds.push_back(readManifold(from, a, b));
  }
  // One manifold a pair of slots: of several (which shapes of the device never have) the first one counts.
  std::stable_sort(manifolds.begin(), manifolds.end(),
                   [](const Manifold& a, const Manifold& b) { return pairOrder(a) < pairOrder(b); });
  manifolds.erase(std::unique(manifolds.begin(), manifolds.end(),
                              [](const Manifold& a, const Manifold& b) { return pairOrder(a) == pairOrder(b); }),
                  manifolds.end());
  return manifolds;
}

void fillManifold(const Manifold& from, btPersistentManifold& manifold) {
  const int known = manifold.getNumContacts();
  manifold.setNumContacts(from.pointCount);
  // Bullet leaves the user data of points that are gone where it was.
  for (int k = known; k < from.pointCount; ++k) manifold.getContactPoint(k).m_userPersistentData = nullptr;
  const btTransform& a = manifold.getBody0()->getWorldTransform();
  const btTransform& b = manifold.getBody1()->getWorldTransform();
  for (int k = 0; k < from.pointCount; ++k) writeContactPoint(from.points[k], a, b, manifold.getContactPoint(k));
  manifold.setContactBreakingThreshold(btScalar(from.breakingThreshold));
  manifold.setContactProcessingThreshold(btScalar(from.processingThreshold));
}

void writeManifold(const Manifold& from, btPersistentManifold& manifold) {
  while (manifold.getNumContacts() > from.pointCount) manifold.removeContactPoint(manifold.getNumContacts() - 1);
  fillManifold(from, manifold);
}

namespace {

// Bullet's algorithms for boxes and planes ask when they are made whether the pair is to collide, and have no manifold
// for ever if it is not: of two that sleep they would let one fall through the other when it wakes.
class Awake {
 public:
  explicit Awake(btCollisionObject& object) : m_object(object), m_state(object.getActivationState()) {
    object.forceActivationState(ACTIVE_TAG);
  }
  ~Awake() { m_object.forceActivationState(m_state); }
  Awake(const Awake&) = delete;
  Awake& operator=(const Awake&) = delete;

 private:
  btCollisionObject& m_object;
  int m_state;
};

}  // namespace

btPersistentManifold* manifoldOfPair(btCollisionWorld& world, btCollisionObject& a, btCollisionObject& b) {
  if (!a.getBroadphaseHandle() || !b.getBroadphaseHandle()) return nullptr;
  btBroadphasePair* pair = world.getPairCache()->findPair(a.getBroadphaseHandle(), b.getBroadphaseHandle());
  if (!pair) return nullptr;
  auto* first = static_cast<btCollisionObject*>(pair->m_pProxy0->m_clientObject);
  auto* second = static_cast<btCollisionObject*>(pair->m_pProxy1->m_clientObject);
  btDispatcher& dispatcher = *world.getDispatcher();
  const btCollisionObjectWrapper w0(nullptr, first->getCollisionShape(), first, first->getWorldTransform(), -1, -1);
  const btCollisionObjectWrapper w1(nullptr, second->getCollisionShape(), second, second->getWorldTransform(), -1, -1);
  if (!pair->m_algorithm) {
    const Awake awake(*first);
    pair->m_algorithm = dispatcher.findAlgorithm(&w0, &w1, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }
  if (!pair->m_algorithm) return nullptr;
  btManifoldArray manifolds;
  pair->m_algorithm->getAllContactManifolds(manifolds);
  if (manifolds.size() == 0) {
    // Some algorithms make their manifold only when they first run.
    btManifoldResult result(&w0, &w1);
    pair->m_algorithm->processCollision(&w0, &w1, world.getDispatchInfo(), &result);
    pair->m_algorithm->getAllContactManifolds(manifolds);
  }
  return manifolds.size() > 0 ? manifolds[0] : nullptr;
}

namespace {

void nameTriangles(const Manifold& from, const WorldInput& input, std::uint32_t slotB, btPersistentManifold& manifold) {
  const int shape = input.infos.values[slotB].shapeIndex;
  if (shape < 0 || input.shapes.values[static_cast<std::size_t>(shape)].type != SHAPE_MESH) return;
  const int place = input.shapes.values[static_cast<std::size_t>(shape)].firstVertex;
  const Mesh& mesh = input.meshes.meshes[static_cast<std::size_t>(place)];
  for (int k = 0; k < from.pointCount; ++k) {
    const int triangle = static_cast<int>(from.points[k].lateralFrictionDir2.w) - 1;
    if (triangle < 0 || triangle >= mesh.triangleCount) continue;
    const MeshTriangle& t =
        input.meshes.triangles[static_cast<std::size_t>(mesh.firstTriangle) + static_cast<std::size_t>(triangle)];
    manifold.getContactPoint(k).m_partId1 = t.part;
    manifold.getContactPoint(k).m_index1 = t.index;
  }
}

}  // namespace

void nameShapes(const Manifold& from, const WorldReader& reader, ulong key, btPersistentManifold& manifold) {
  const WorldInput& input = reader.input();
  const std::uint32_t a = slotIn(reader, key, reader.ownerOf(from.bodyA)),
                      b = slotIn(reader, key, reader.ownerOf(from.bodyB));
  if (reader.isChild(a) || reader.isChild(b)) {
    const int childA = childOf(input.infos.values, a), childB = childOf(input.infos.values, b);
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      manifold.getContactPoint(k).m_index0 = childA;
      manifold.getContactPoint(k).m_index1 = childB;
    }
  }
  nameTriangles(from, input, b, manifold);
}

// Into the algorithm that the pair's own one then takes the impulses from.
static void writeCompoundManifold(const Manifold& m, const WorldReader& reader, btCollisionWorld& world,
                                  const std::shared_ptr<ManifoldRegistry>& registry) {
  btCollisionObject &a = *reader.objectOf(m.bodyA), &b = *reader.objectOf(m.bodyB);
  if (!a.getBroadphaseHandle() || !b.getBroadphaseHandle()) return;
  btBroadphasePair* pair = world.getPairCache()->findPair(a.getBroadphaseHandle(), b.getBroadphaseHandle());
  if (!pair) return;
  const ulong key = pairKeyOf(m.bodyA, m.bodyB);
  const auto* contact = DeviceCompoundAlgorithm::of(*pair, *world.getDispatcher(), registry).contact(key, a, b);
  if (!contact) return;
  writeManifold(m, *contact->manifold);
  nameShapes(m, reader, key, *contact->manifold);
}

void writeManifolds(const std::vector<Manifold>& manifolds, const WorldReader& reader, btCollisionWorld& world) {
  const Zone zone("writeManifolds");
  const auto registry = std::make_shared<ManifoldRegistry>();
  // A slot may hold another body by now than the manifold was made for.
  const auto& born = reader.input().born;
  const auto objectOf = [&](std::uint32_t slot) -> btCollisionObject* {
    if (slot >= reader.slots().size() || std::binary_search(born.begin(), born.end(), slot)) return nullptr;
    return reader.objectOf(slot);
  };
  for (const Manifold& m : manifolds) {
    if (m.pointCount == 0) continue;
    btCollisionObject* a = objectOf(m.bodyA);
    btCollisionObject* b = objectOf(m.bodyB);
    if (!a || !b) continue;
    if (reader.isChild(m.bodyA) || reader.isChild(m.bodyB)) {
      writeCompoundManifold(m, reader, world, registry);
      continue;
    }
    btPersistentManifold* manifold = manifoldOfPair(world, *a, *b);
    if (manifold && manifold->getBody0() == a) writeManifold(m, *manifold);
  }
}

BTGPU_TRANSLATION_END
