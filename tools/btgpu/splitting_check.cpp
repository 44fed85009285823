// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "splitting_check.h"

#include <algorithm>
#include <cmath>

namespace btgpu::tool {
namespace {

// Of bodies that the solver moves: contacts with points, and joints that are solved.
int mostCopies(const StepStart& start, const StepResults& device) {
  std::vector<int> copies(start.input.bodyCount, 0);
  for (const Manifold& m : device.matchedManifolds) {
    if (m.pointCount == 0) continue;
    for (const uint body : {m.bodyA, m.bodyB}) {
      if (start.input.masses.values[body].inverseInertiaLocal.w != 0) ++copies[body];
    }
  }
  for (size_t j = 0; j < start.input.joints.size(); ++j) {
    const Joint& joint = start.input.joints[j];
    if (!device.jointSolved[j] || joint.rowCount == 0) continue;
    for (const uint body : {joint.bodyA, joint.bodyB}) {
      if (body != NO_INDEX) ++copies[body];
    }
  }
  return copies.empty() ? 1 : std::max(1, *std::max_element(copies.begin(), copies.end()));
}

double ratio(double ours, double stock) { return stock > 0 ? ours / stock : ours > 0 ? HUGE_VAL : 0; }

// The limit grows with what the order of the rows makes of stock's own result, as that of solver.* does.
Check ofOrder(const char* name, double value, double reversed) {
  Check check = makeCheck(name, value);
  if (std::isfinite(reversed)) check.limit *= std::max({1.0, reversed, reversed > 0 ? 1 / reversed : 1.0});
  return check;
}

}  // namespace

SplittingCheck::SplittingCheck(const Builder& build, const std::string& device)
    : m_stock(build), m_splitting(device, Solver::MassSplitting) {}

void SplittingCheck::compare(const StepStart& start, const StepResults& device) {
  const int iterations = start.settings.iterations;
  m_stock.use(start, device);
  const Solved exact = m_stock.solve(kConvergedIterations, false);
  const Solved forward = m_stock.solve(iterations, false), reversed = m_stock.solve(iterations, true);
  const Solved ours = m_splitting.solve(start, 2 * mostCopies(start, device) * iterations);
  const auto add = [&](double& squares, double& distances, const Solved& solved) {
    const double residual = m_stock.residualOf(solved);
    squares += residual * residual;
    distances += m_stock.distance(solved, exact);
  };
  add(m_ours, m_ourDistance, ours);
  add(m_forward, m_forwardDistance, forward);
  add(m_reversed, m_reversedDistance, reversed);
}

std::vector<Check> SplittingCheck::checks() const {
  if (m_forwardDistance == 0) return {};
  return {ofOrder("splitting.residual", std::sqrt(ratio(m_ours, m_forward)), std::sqrt(ratio(m_reversed, m_forward))),
          ofOrder("splitting.distance_to_converged", ratio(m_ourDistance, m_forwardDistance),
                  ratio(m_reversedDistance, m_forwardDistance))};
}

}  // namespace btgpu::tool
