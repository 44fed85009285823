// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// One number for everything that a run left in the bodies of a world, step after step: equal for equal bits.
#pragma once

#include <btBulletDynamicsCommon.h>
#include <xxhash.h>

#include <cstdint>

namespace btgpu::test {

class WorldHash {
 public:
  // Adds poses, velocities and the state of sleep of all bodies.
  void add(const btCollisionWorld& world) {
    for (int i = 0; i < world.getNumCollisionObjects(); ++i) add(*world.getCollisionObjectArray()[i]);
  }
  void add(const btCollisionObject& o) {
    for (int row = 0; row < 3; ++row) add(o.getWorldTransform().getBasis()[row]);
    add(o.getWorldTransform().getOrigin());
    const btScalar sleep[] = {o.getDeactivationTime(), btScalar(o.getActivationState())};
    addBytes(sleep, sizeof sleep);
    const btRigidBody* body = btRigidBody::upcast(&o);
    if (!body) return;
    add(body->getLinearVelocity());
    add(body->getAngularVelocity());
  }
  std::uint64_t value() const { return m_value; }

 private:
  // Without the padding.
  void add(const btVector3& v) { addBytes(&v, 3 * sizeof(btScalar)); }
  void addBytes(const void* bytes, std::size_t size) { m_value = XXH3_64bits_withSeed(bytes, size, m_value); }

  std::uint64_t m_value = 0;
};

}  // namespace btgpu::test
