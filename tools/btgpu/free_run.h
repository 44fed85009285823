// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gpu_engine/step_results.h"
#include "series.h"
#include "translation/oracle/tolerances.h"
#include "worlds.h"

namespace btgpu::tool {

// Figures of one world at one time.
struct WorldFigures {
  double kineticEnergy = 0, potentialEnergy = 0;  // a moving body
  double meanHeight = 0;                          // of moving bodies, along gravity upwards
  double momentum = 0, momentumScale = 0;         // size of the sum, sum of the sizes
  int moving = 0, sleeping = 0, belowGround = 0, notFinite = 0;
};

WorldFigures measureWorld(const btDiscreteDynamicsWorld& world, double groundHeight);

// Statistics of one run.
struct RunStatistics {
  WorldFigures end;           // at the last step
  double restingEnergy = 0;   // mean kinetic energy a body over the last steps
  std::vector<float> depths;  // penetrations of all contacts over the last steps
  double depth99() const;     // 99th percentile
};

// btgpu and stock run side by side, each on its own; statistics are compared, and positions while the scene says that
// they are comparable. Piles are chaotic, so stock runs more than once, from starts that differ by a millionth of a
// body's size: what its runs differ by is no difference to btgpu.
class FreeRunComparison {
 public:
  FreeRunComparison(const Builder& build, const scenes::Expectations& expectations, int steps);
  ~FreeRunComparison();

  // Steps stock; returns the time that the first of its runs took, in milliseconds.
  double stepStock(btScalar timeStep);
  void afterStep(int step, const btDiscreteDynamicsWorld& gpu, const StepResults& results);
  // Adds the figures of the step just done.
  void addTo(Series& series, const btDiscreteDynamicsWorld& gpu, const StepResults& results) const;
  std::vector<Check> checks() const;

  const RunStatistics& gpu() const { return m_gpu; }
  const RunStatistics& stock() const { return m_stock.front(); }  // the run that starts exactly as btgpu does
  const btDiscreteDynamicsWorld& stockWorld() const;              // of that run

 private:
  using StockWorld = TestWorld<btDiscreteDynamicsWorld>;
  static constexpr int kLastSteps = 60;

  void measureScene(const btDiscreteDynamicsWorld& world);
  bool comesToRest() const;
  double heightBeyondStock() const;
  double heightByChance() const;

  scenes::Expectations m_expectations;
  int m_steps;
  std::vector<std::unique_ptr<StockWorld>> m_stockWorlds;  // the first one starts exactly as btgpu does
  RunStatistics m_gpu;
  std::vector<RunStatistics> m_stock;
  double m_position = 0;
  double m_size = 1, m_weight = 0;  // of the moving bodies, mean
  bool m_fixedContacts = false;     // something static or kinematic is in the world
};

}  // namespace btgpu::tool
