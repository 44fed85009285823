// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Who owns a manifold that the device fills. Bullet finds a pair's manifolds through the pair's algorithm and releases
// them with it, so each one belongs to a small algorithm of ours in btBroadphasePair::m_algorithm. It may die at any
// time (a body leaves, the broadphase drops the pair), and after the world did, so it tells a registry that lives as
// long as anyone needs it.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

// Ends an algorithm as the dispatcher that made it wants.
void destroy(btDispatcher& dispatcher, btCollisionAlgorithm* algorithm);

// Manifolds by handle, as long as they live.
class ManifoldRegistry {
 public:
  std::uint32_t add(btPersistentManifold* manifold);
  void remove(std::uint32_t handle);
  // Null once the manifold is gone.
  btPersistentManifold* at(std::uint32_t handle) const { return m_manifolds[handle]; }
  std::size_t alive() const { return m_manifolds.size() - m_free.size() - m_removed.size(); }
  // True if a manifold has gone since the last reclaim().
  bool hasRemoved() const { return !m_removed.empty(); }
  // Handles of manifolds that are gone may be used again: nobody remembers them any more.
  void reclaim();

 private:
  std::vector<btPersistentManifold*> m_manifolds;
  std::vector<std::uint32_t> m_free, m_removed;
};

// On the stock path (a fallback step, performDiscreteCollisionDetection) it hands the work to Bullet's own algorithm,
// which goes on with the same manifold, impulses included.
class DeviceContactAlgorithm : public btCollisionAlgorithm {
 public:
  // The pair's algorithm, ours or made ours: one that stock made is taken over with its manifold, if it has just one.
  // Null if the dispatcher has no room for a manifold.
  static DeviceContactAlgorithm* of(btBroadphasePair& pair, btDispatcher& dispatcher,
                                    const std::shared_ptr<ManifoldRegistry>& registry);
  static bool isOurs(const btBroadphasePair& pair);
  // The pair's algorithm if it is one of ours and known to this registry, else null.
  static DeviceContactAlgorithm* find(const btBroadphasePair& pair, const std::shared_ptr<ManifoldRegistry>& registry);

  ~DeviceContactAlgorithm() override;
  DeviceContactAlgorithm(const DeviceContactAlgorithm&) = delete;
  DeviceContactAlgorithm& operator=(const DeviceContactAlgorithm&) = delete;

  std::uint32_t handle() const { return m_handle; }

  void processCollision(const btCollisionObjectWrapper* body0, const btCollisionObjectWrapper* body1,
                        const btDispatcherInfo& info, btManifoldResult* result) override;
  btScalar calculateTimeOfImpact(btCollisionObject* body0, btCollisionObject* body1, const btDispatcherInfo& info,
                                 btManifoldResult* result) override;
  void getAllContactManifolds(btManifoldArray& manifolds) override { manifolds.push_back(m_manifold); }

 private:
  DeviceContactAlgorithm(btDispatcher& dispatcher, std::shared_ptr<ManifoldRegistry> registry,
                         btPersistentManifold* manifold, btCollisionAlgorithm* owner);

  // Makes m_stock, and the manifold its own.
  void makeStock(const btCollisionObjectWrapper* body0, const btCollisionObjectWrapper* body1);

  std::shared_ptr<ManifoldRegistry> m_registry;
  btPersistentManifold* m_manifold;
  btCollisionAlgorithm* m_stock;  // Bullet's algorithm for the pair, once it was needed
  std::uint32_t m_handle;
  bool m_ownsManifold;  // else m_stock does
};

BTGPU_TRANSLATION_END
