// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <vector>

#include "gpu_engine/step_results.h"
#include "gpu_engine/world_input.h"
#include "worlds.h"

namespace btgpu::tool {

// State of one body that a step starts from.
struct BodyState {
  btTransform transform, interpolation;
  btVector3 linear, angular, interpolationLinear, interpolationAngular;
  int activation;
  btScalar deactivationTime;
};

// What of a joint lives from step to step.
struct JointState {
  bool enabled;
  btScalar accumulatedAngle;  // of a btHingeAccumulatedAngleConstraint
};

std::vector<JointState> captureJoints(const btDynamicsWorld& world);

std::vector<BodyState> captureStates(const btCollisionWorld& world);

struct Velocity {
  btVector3 linear, angular;
};

// A stock world whose step is taken apart, so that each half can be given btgpu's own inputs: the state before the
// step and the manifold cache to the narrowphase, btgpu's contacts to the solver. Object i is slot i of the device.
class OracleWorld : public btDiscreteDynamicsWorld {
 public:
  using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;
  ~OracleWorld() override {
    for (btPersistentManifold* loose : m_loose) getDispatcher()->releaseManifold(loose);
  }

  // Sets all bodies to `states` and the contact cache to `cache` (StepResults::manifolds of the step before).
  void setState(const std::vector<BodyState>& states, const std::vector<Manifold>& cache);
  // Stock's step up to the contacts.
  void findContacts(btScalar timeStep);
  // Makes `contacts` the dispatcher's contacts, so that the solver works on the very same ones as btgpu's. Those behind
  // the first `ofPairs` come from the host and may be several a pair: each gets a manifold of its own, until the next
  // call.
  void replaceContacts(const std::vector<Manifold>& contacts, size_t ofPairs);
  // The manifold that holds contacts[i] of the last replaceContacts(); null if it has no points.
  const btPersistentManifold* replaced(size_t i) const { return m_replaced[i]; }
  // Turns the order of the dispatcher's manifolds round, and with it the order of the solver's rows.
  void reverseContacts();
  // Islands and solver, as in stock's step; `iterations` < 0: the world's own number.
  void solve(btScalar timeStep, int iterations = -1);
  // The rest of stock's step.
  void finish(btScalar timeStep);

  std::vector<Velocity> velocities() const;
  // Sets the joints, which are those of btgpu's world in the same order.
  void setJoints(const std::vector<JointState>& states);
  // Turns the order of the joints round, and with it the order of their rows.
  void reverseJoints();
  // Undoes solve(): everything that the solver and the islands changed.
  void restore(const std::vector<BodyState>& states);

 private:
  std::vector<btPersistentManifold*> m_loose, m_replaced;

  btCollisionObject* object(uint slot) { return getCollisionObjectArray()[static_cast<int>(slot)]; }
};

}  // namespace btgpu::tool
