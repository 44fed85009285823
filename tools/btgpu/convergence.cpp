// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "convergence.h"

#include <algorithm>
#include <cstring>

#include "bullet_file.h"
#include "same_step.h"

namespace btgpu::tool {
namespace {

StepStart runScene(btGpuDynamicsWorld& world, const ConvergenceOptions& options) {
  const btScalar dt = static_cast<btScalar>(options.timeStep);
  for (int step = 0; step < options.steps; ++step) world.stepSimulation(dt, 0);
  if (world.statistics().m_deviceSteps == 0 || world.statistics().m_stockSteps > 0) {
    throw InputError("the scene does not run on the device; 'btgpu compare' says why");
  }
  return recordStep(world, [&] { world.stepSimulation(dt, 0); });
}

struct DeviceLine {
  const char* name;
  Solver solver;
  GroupSplit split;
};

const DeviceLine kDeviceLines[] = {{"parity", Solver::Parity, GroupSplit::Space},
                                   {"two_level, space", Solver::TwoLevel, GroupSplit::Space},
                                   {"two_level, index", Solver::TwoLevel, GroupSplit::Index},
                                   {"mass_splitting", Solver::MassSplitting, GroupSplit::Space}};

// Of a manifold's points those that there are.
bool sameContacts(const Manifold& a, const Manifold& b) {
  return a.bodyA == b.bodyA && a.bodyB == b.bodyB && a.pointCount == b.pointCount &&
         std::memcmp(a.points, b.points, static_cast<size_t>(a.pointCount) * sizeof(ContactPoint)) == 0;
}

bool sameContacts(const std::vector<Manifold>& a, const std::vector<Manifold>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Manifold& x, const Manifold& y) { return sameContacts(x, y); });
}

}  // namespace

int solvesOf(const ConvergenceOptions& options) {
  return static_cast<int>((std::size(kDeviceLines) + 2) * options.iterations.size());
}

ConvergenceResult measureConvergence(const std::string& scene, const Builder& build,
                                     const ConvergenceOptions& options) {
  ConvergenceResult result;
  result.scene = scene;
  result.steps = options.steps;
  result.iterations = options.iterations;
  btGpuSettings settings;
  settings.m_device = options.device;
  settings.m_solver = btGpuSolver::Parity;
  settings.m_smallWorld = 0;
  TestWorld<btGpuDynamicsWorld> gpu(build, settings);
  const StepStart start = runScene(gpu.world(), options);
  result.device = gpu.world().statistics().m_device;
  result.bodies = gpu.world().getNumCollisionObjects();
  result.joints = static_cast<long>(start.input.joints.size());

  DeviceSolver first(options.device, Solver::Parity);
  first.solve(start, 1);
  const std::vector<Manifold> contacts = first.results().matchedManifolds;
  for (const Manifold& m : contacts) result.contacts += m.pointCount;
  StockSolver stock(build);
  stock.use(start, first.results());
  const Solved exact = stock.solve(kConvergedIterations, false);

  int done = 0;
  const auto measure = [&](ConvergenceLine& line, const Solved& solved) {
    line.residual.push_back(stock.residualOf(solved));
    line.distance.push_back(stock.distance(solved, exact));
    if (options.progress) options.progress(++done);
  };
  for (const DeviceLine& device : kDeviceLines) {
    DeviceSolver solver(options.device, device.solver, device.split);
    ConvergenceLine line{device.name, {}, {}};
    for (const int iterations : options.iterations) {
      measure(line, solver.solve(start, iterations));
      if (!sameContacts(solver.results().matchedManifolds, contacts)) ++result.deviceDifferences;
    }
    result.lines.push_back(line);
  }
  for (const bool reversed : {false, true}) {
    ConvergenceLine line{reversed ? "stock, reversed" : "stock", {}, {}};
    for (const int iterations : options.iterations) measure(line, stock.solve(iterations, reversed));
    result.lines.push_back(line);
  }
  return result;
}

}  // namespace btgpu::tool
