// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "contact_algorithm.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <new>
#include <utility>

#include "compound_algorithm.h"
#include "exact_type.h"
#include "private_access.h"

BTGPU_TRANSLATION_BEGIN

// Elements of the dispatcher's pool are made for the largest of Bullet's own algorithms.
static_assert(sizeof(DeviceContactAlgorithm) <= sizeof(btConvexConvexAlgorithm), "does not fit the dispatcher's pool");

namespace {

// The one manifold of an algorithm that stock made, or null.
btPersistentManifold* onlyManifold(btCollisionAlgorithm& algorithm) {
  btManifoldArray manifolds;
  algorithm.getAllContactManifolds(manifolds);
  return manifolds.size() == 1 ? manifolds[0] : nullptr;
}

// Bullet's algorithms make a manifold of their own, some at once, some when they first run. Gives them another one.
template <typename Algorithm, typename Manifold, typename Owns>
bool handOver(btCollisionAlgorithm& algorithm, btPersistentManifold* manifold, btDispatcher& dispatcher) {
  if (!isExactly<Algorithm>(algorithm)) return false;
  auto& a = static_cast<Algorithm&>(algorithm);
  btPersistentManifold*& own = a.*memberPointer(Manifold());
  bool& owns = a.*memberPointer(Owns());
  if (own && owns) dispatcher.releaseManifold(own);
  own = manifold;
  owns = true;
  return true;
}

bool handOverMeshs(btCollisionAlgorithm& algorithm, btPersistentManifold* manifold, btDispatcher& dispatcher) {
  if (!isExactly<btConvexConcaveCollisionAlgorithm>(algorithm)) return false;
  auto& a = static_cast<btConvexConcaveCollisionAlgorithm&>(algorithm);
  btPersistentManifold*& own = (a.*memberPointer(ConvexConcaveCallback())).m_manifoldPtr;
  if (own) dispatcher.releaseManifold(own);
  own = manifold;  // released with the algorithm
  return true;
}

}  // namespace

void destroy(btDispatcher& dispatcher, btCollisionAlgorithm* algorithm) {
  algorithm->~btCollisionAlgorithm();
  dispatcher.freeCollisionAlgorithm(algorithm);
}

std::uint32_t ManifoldRegistry::add(btPersistentManifold* manifold) {
  if (m_free.empty()) {
    m_manifolds.push_back(manifold);
    return static_cast<std::uint32_t>(m_manifolds.size() - 1);
  }
  const std::uint32_t handle = m_free.back();
  m_free.pop_back();
  m_manifolds[handle] = manifold;
  return handle;
}

void ManifoldRegistry::remove(std::uint32_t handle) {
  m_manifolds[handle] = nullptr;
  m_removed.push_back(handle);
}

void ManifoldRegistry::reclaim() {
  m_free.insert(m_free.end(), m_removed.begin(), m_removed.end());
  m_removed.clear();
}

bool DeviceContactAlgorithm::isOurs(const btBroadphasePair& pair) {
  return pair.m_algorithm && isExactly<DeviceContactAlgorithm>(*pair.m_algorithm);
}

DeviceContactAlgorithm* DeviceContactAlgorithm::find(const btBroadphasePair& pair,
                                                     const std::shared_ptr<ManifoldRegistry>& registry) {
  if (!isOurs(pair)) return nullptr;
  auto* ours = static_cast<DeviceContactAlgorithm*>(pair.m_algorithm);
  return ours->m_registry == registry ? ours : nullptr;
}

DeviceContactAlgorithm* DeviceContactAlgorithm::of(btBroadphasePair& pair, btDispatcher& dispatcher,
                                                   const std::shared_ptr<ManifoldRegistry>& registry) {
  if (DeviceContactAlgorithm* ours = find(pair, registry)) return ours;
  btCollisionAlgorithm* owner = pair.m_algorithm;
  if (owner && isExactly<DeviceCompoundAlgorithm>(*owner)) {  // a body had another shape then
    destroy(dispatcher, owner);
    owner = pair.m_algorithm = nullptr;
  }
  btPersistentManifold* manifold = owner ? onlyManifold(*owner) : nullptr;
  if (!manifold) {
    if (owner) destroy(dispatcher, owner);
    owner = pair.m_algorithm = nullptr;
    manifold = dispatcher.getNewManifold(static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject),
                                         static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject));
    if (!manifold) return nullptr;
  }
  void* memory = dispatcher.allocateCollisionAlgorithm(sizeof(DeviceContactAlgorithm));
  auto* algorithm = new (memory) DeviceContactAlgorithm(dispatcher, registry, manifold, owner);
  pair.m_algorithm = algorithm;
  return algorithm;
}

DeviceContactAlgorithm::DeviceContactAlgorithm(btDispatcher& dispatcher, std::shared_ptr<ManifoldRegistry> registry,
                                               btPersistentManifold* manifold, btCollisionAlgorithm* owner)
    : m_registry(std::move(registry)),
      m_manifold(manifold),
      m_stock(owner),
      m_handle(m_registry->add(manifold)),
      m_ownsManifold(owner == nullptr) {
  m_dispatcher = &dispatcher;
}

DeviceContactAlgorithm::~DeviceContactAlgorithm() {
  m_registry->remove(m_handle);
  if (m_stock) destroy(*m_dispatcher, m_stock);
  if (m_ownsManifold) m_dispatcher->releaseManifold(m_manifold);
}

void DeviceContactAlgorithm::makeStock(const btCollisionObjectWrapper* body0, const btCollisionObjectWrapper* body1) {
  m_stock = m_dispatcher->findAlgorithm(body0, body1, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  if (!m_stock) return;
  btDispatcher& d = *m_dispatcher;
  m_ownsManifold =
      !(handOver<btBoxBoxCollisionAlgorithm, BoxBoxManifold, BoxBoxOwns>(*m_stock, m_manifold, d) ||
        handOver<btSphereSphereCollisionAlgorithm, SphereSphereManifold, SphereSphereOwns>(*m_stock, m_manifold, d) ||
        handOver<btConvexPlaneCollisionAlgorithm, ConvexPlaneManifold, ConvexPlaneOwns>(*m_stock, m_manifold, d) ||
        handOver<btConvexConvexAlgorithm, ConvexConvexManifold, ConvexConvexOwns>(*m_stock, m_manifold, d) ||
        handOverMeshs(*m_stock, m_manifold, d));
  if (!m_ownsManifold) return;
  // Not one that collides shapes of the device: at least it starts from the same points.
  destroy(d, m_stock);
  m_stock = d.findAlgorithm(body0, body1, m_manifold, BT_CONTACT_POINT_ALGORITHMS);
}

void DeviceContactAlgorithm::processCollision(const btCollisionObjectWrapper* body0,
                                              const btCollisionObjectWrapper* body1, const btDispatcherInfo& info,
                                              btManifoldResult* result) {
  if (!m_stock) makeStock(body0, body1);
  if (m_stock) m_stock->processCollision(body0, body1, info, result);
}

btScalar DeviceContactAlgorithm::calculateTimeOfImpact(btCollisionObject* body0, btCollisionObject* body1,
                                                       const btDispatcherInfo& info, btManifoldResult* result) {
  if (!m_stock) {
    const btCollisionObjectWrapper w0(nullptr, body0->getCollisionShape(), body0, body0->getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper w1(nullptr, body1->getCollisionShape(), body1, body1->getWorldTransform(), -1, -1);
    makeStock(&w0, &w1);
  }
  return m_stock ? m_stock->calculateTimeOfImpact(body0, body1, info, result) : btScalar(1);
}

BTGPU_TRANSLATION_END
