// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>
#include <vector>

#include "series.h"
#include "translation/oracle/one_step.h"
#include "worlds.h"

namespace btgpu::tool {

// Holds every step of btgpu's world against one step of stock, in a second world with the same scene.
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
  std::vector<Check> checks() const { return m_check.checks(); }

 private:
  OracleWorld m_oracle;
  std::unique_ptr<SceneContents> m_contents;
  OneStepCheck m_check;
  btScalar m_timeStep;
  std::vector<BodyState> m_before;
  std::vector<JointState> m_jointsBefore;
  std::vector<Manifold> m_cache;  // btgpu's manifolds after the step before
};

}  // namespace btgpu::tool
