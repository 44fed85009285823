// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>
#include <vector>

#include "residuals.h"
#include "series.h"
#include "tolerances.h"

namespace btgpu::tool {

// Holds every step of btgpu against one step of stock from the same state, caches included; contacts and solver are
// compared apart. btgpu's world is never touched. What stock's own result depends on, the order of its rows, is
// measured as well, by solving now and then with the manifolds in reverse order.
class OneStepComparison {
 public:
  OneStepComparison(const Builder& build, const scenes::Expectations& expectations, btScalar timeStep);
  ~OneStepComparison();

  // Around each step of btgpu's world. `converged`: also measure the distance to stock run to convergence.
  void beforeStep(const btDynamicsWorld& gpuWorld);
  // `input`: with the joints' rows of the step.
  void afterStep(const btDynamicsWorld& gpuWorld, const WorldInput& input, const StepResults& results, bool converged);

  // Adds the figures of the step just compared.
  void addTo(Series& series) const;
  std::vector<Check> checks() const;

 private:
  void compareContacts(const std::vector<Manifold>& ours);
  void comparePair(const Manifold& ours, const btPersistentManifold* stock);
  void compareSolver(const btCollisionWorld& gpuWorld, const StepResults& results);
  void compareOrders(const std::vector<BodyState>& predicted, const StepResults& results, bool converged);
  Residual stockResidual(const std::vector<Manifold>& contacts, const std::vector<Velocity>& stock);
  void compareEnd(const btCollisionWorld& gpuWorld, const std::vector<Manifold>& contacts);
  std::vector<Manifold> readSolved(const std::vector<Manifold>& contacts);
  bool awake(const Manifold& m) const;
  Residual residualOf(const std::vector<Manifold>& contacts, const std::vector<Manifold>& solved,
                      const std::vector<Velocity>& velocities);

  std::unique_ptr<TestWorld<OracleWorld>> m_oracle;
  double m_otherDepthsAllowed;
  btScalar m_timeStep;
  std::vector<BodyState> m_before;
  std::vector<JointState> m_jointsBefore;
  const WorldInput* m_input = nullptr;    // of the step that is compared
  std::vector<uint> m_solvedJoints;       // of islands that were awake
  std::vector<bool> m_jointed;            // bodies of enabled joints
  size_t m_ofPairs = 0;                   // manifolds of the device's pairs; those of the host lie behind
  std::vector<Manifold> m_cache;          // btgpu's manifolds after the step before
  std::vector<Velocity> m_gpuVelocities;  // after the step
  std::vector<double> m_sizes;            // of the bodies: their angular motion disc, at most 10

  long m_pairs = 0, m_missingPairs = 0, m_otherDepths = 0, m_otherNormals = 0;
  long m_singles = 0, m_otherSingles = 0;
  long m_states = 0, m_otherStates = 0;
  double m_freeVelocity = 0, m_pose = 0, m_lastPose = 0, m_addedEnergy = 0, m_enteringEnergy = 0;
  int m_step = 0;
  Residual m_ourResidual, m_stockResidual;         // all steps
  Residual m_ourLast, m_stockLast;                 // the last step
  Residual m_forwardResidual, m_reversedResidual;  // stock in both orders, in the steps where both were run
  double m_ourDistance = 0, m_stockDistance = 0, m_reversedDistance = 0;
};

}  // namespace btgpu::tool
