// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstdint>
#include <vector>

#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

// Bullet damps the bodies (predictUnconstraintMotion) before their joints and their sweeps look at the velocities. The
// device does the damping in its own step, so the bodies get their velocities back, bit by bit.
class DampedBodies {
 public:
  explicit DampedBodies(btScalar timeStep) : m_timeStep(timeStep) {}
  ~DampedBodies() {
    for (const Saved& s : m_saved) {
      s.body->setLinearVelocity(s.linear);
      s.body->setAngularVelocity(s.angular);
    }
  }
  DampedBodies(const DampedBodies&) = delete;
  DampedBodies& operator=(const DampedBodies&) = delete;

  void reserve(std::uint32_t slots) { m_done.assign(slots, false); }
  void damp(btRigidBody& body, std::uint32_t slot) {
    if (m_done[slot]) return;
    m_done[slot] = true;
    m_saved.push_back({&body, body.getLinearVelocity(), body.getAngularVelocity()});
    body.applyDamping(m_timeStep);
  }

 private:
  struct Saved {
    btRigidBody* body;
    btVector3 linear, angular;
  };
  btScalar m_timeStep;
  std::vector<Saved> m_saved;
  std::vector<bool> m_done;
};

BTGPU_TRANSLATION_END
