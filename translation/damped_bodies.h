// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstdint>
#include <vector>

#include "bullet.h"
#include "parallel.h"

BTGPU_TRANSLATION_BEGIN

// Bullet damps the bodies (predictUnconstraintMotion) before their joints and their sweeps look at the velocities. The
// device does the damping in its own step, so the bodies get their velocities back, bit by bit.
class DampedBodies {
 public:
  explicit DampedBodies(btScalar timeStep) : m_timeStep(timeStep) {}
  ~DampedBodies() {
    parallelFor(m_saved.size(), kGrain, [this](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        m_saved[i].body->setLinearVelocity(m_saved[i].linear);
        m_saved[i].body->setAngularVelocity(m_saved[i].angular);
      }
    });
  }
  DampedBodies(const DampedBodies&) = delete;
  DampedBodies& operator=(const DampedBodies&) = delete;

  void reserve(std::uint32_t slots) { m_done.assign(slots, false); }
  void damp(btRigidBody& body, std::uint32_t slot) {
    if (m_done[slot]) return;
    m_done[slot] = true;
    m_saved.push_back(damped(body));
  }
  // All of these, none of which has been damped and none of which is in the list twice.
  void damp(const std::vector<btRigidBody*>& bodies) {
    m_saved.resize(bodies.size());
    parallelFor(bodies.size(), kGrain, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) m_saved[i] = damped(*bodies[i]);
    });
  }

 private:
  struct Saved {
    btRigidBody* body;
    btVector3 linear, angular;
  };
  Saved damped(btRigidBody& body) const {
    const Saved saved{&body, body.getLinearVelocity(), body.getAngularVelocity()};
    body.applyDamping(m_timeStep);
    return saved;
  }

  static constexpr std::size_t kGrain = 256;
  btScalar m_timeStep;
  std::vector<Saved> m_saved;
  std::vector<bool> m_done;
};

BTGPU_TRANSLATION_END
