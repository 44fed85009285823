// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// As DeviceContactAlgorithm (contact_algorithm.h), of a pair in which a compound takes part: any number of manifolds,
// one for each two shapes that touch, known by the key of their slots.
#pragma once

#include "contact_algorithm.h"
#include "read_world.h"

BTGPU_TRANSLATION_BEGIN

// On the stock path it hands the work to Bullet's own algorithm, which makes manifolds of its own; those of the device
// give them their impulses, and go.
class DeviceCompoundAlgorithm : public btCollisionAlgorithm {
 public:
  struct Contact {
    ulong key;
    btPersistentManifold* manifold;
    std::uint32_t handle;
  };

  // The pair's algorithm, made ours if it is not: what stock made is destroyed, with its manifolds.
  static DeviceCompoundAlgorithm& of(btBroadphasePair& pair, btDispatcher& dispatcher,
                                     const std::shared_ptr<ManifoldRegistry>& registry);
  static DeviceCompoundAlgorithm* find(const btBroadphasePair& pair);

  ~DeviceCompoundAlgorithm() override;
  DeviceCompoundAlgorithm(const DeviceCompoundAlgorithm&) = delete;
  DeviceCompoundAlgorithm& operator=(const DeviceCompoundAlgorithm&) = delete;

  const std::vector<Contact>& contacts() const { return m_contacts; }
  // The contact of a key, made between the two bodies if there is none; null if the dispatcher has no room for it.
  const Contact* contact(ulong key, const btCollisionObject& a, const btCollisionObject& b);
  void release(const btPersistentManifold* manifold);

  void processCollision(const btCollisionObjectWrapper* body0, const btCollisionObjectWrapper* body1,
                        const btDispatcherInfo& info, btManifoldResult* result) override;
  btScalar calculateTimeOfImpact(btCollisionObject* body0, btCollisionObject* body1, const btDispatcherInfo& info,
                                 btManifoldResult* result) override;
  void getAllContactManifolds(btManifoldArray& manifolds) override;

 private:
  DeviceCompoundAlgorithm(btDispatcher& dispatcher, std::shared_ptr<ManifoldRegistry> registry);
  bool makeStock(const btCollisionObjectWrapper* body0, const btCollisionObjectWrapper* body1);
  void releaseAll();

  std::shared_ptr<ManifoldRegistry> m_registry;
  std::vector<Contact> m_contacts;
  btCollisionAlgorithm* m_stock = nullptr;
};

// Of the two slots of a key, the one that belongs to `body`.
std::uint32_t slotIn(const WorldReader& reader, ulong key, std::uint32_t body);

// The slots of a manifold that Bullet made for two bodies: those of the shapes that its points name, where a body is a
// compound. Points on triangles name the triangle and not the mesh, which is then told by where they lie. False if they
// name none, or several of a nested compound, or lie in the boxes of several meshes.
bool slotsOfManifold(const WorldReader& reader, const btPersistentManifold& manifold, std::uint32_t& a,
                     std::uint32_t& b);

BTGPU_TRANSLATION_END
