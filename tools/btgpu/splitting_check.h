// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <vector>

#include "same_step.h"
#include "translation/oracle/tolerances.h"

namespace btgpu::tool {

// Whether Jacobi with split masses is on its way to where Gauss-Seidel goes: the step once more from the same state,
// with 2 n times the world's iterations, n being the most copies of a body, against stock with the world's own
// (docs/compare.md).
class SplittingCheck {
 public:
  SplittingCheck(const Builder& build, const std::string& device);
  // start: of a step; device: what a solver made of it.
  void compare(const StepStart& start, const StepResults& device);
  std::vector<Check> checks() const;

 private:
  StockSolver m_stock;
  DeviceSolver m_splitting;
  double m_ours = 0, m_forward = 0, m_reversed = 0;                         // sums of squares of residuals
  double m_ourDistance = 0, m_forwardDistance = 0, m_reversedDistance = 0;  // sums
};

}  // namespace btgpu::tool
