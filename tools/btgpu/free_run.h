// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>
#include <vector>

#include "gpu_engine/step_results.h"
#include "tolerances.h"
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

// btgpu and stock run side by side, each on its own; statistics are compared, and positions while the scene says that
// they are comparable.
class FreeRunComparison {
 public:
  FreeRunComparison(const scenes::Expectations& expectations, int steps) : m_expectations(expectations), m_steps(steps) {}

  void afterStep(int step, const btDiscreteDynamicsWorld& gpu, const StepResults& results,
                 const btDiscreteDynamicsWorld& stock, const btDispatcher& stockDispatcher);
  std::vector<Check> checks() const;

  const WorldFigures& gpuFigures() const { return m_gpu; }
  const WorldFigures& stockFigures() const { return m_stock; }

 private:
  bool comesToRest() const;

  static constexpr int kLastSteps = 60;
  scenes::Expectations m_expectations;
  int m_steps;
  double m_position = 0;
  double m_gpuEnergy = 0, m_stockEnergy = 0;  // sums over the last steps, a body
  int m_energySamples = 0;
  std::vector<float> m_gpuDepths, m_stockDepths;  // penetrations of all contacts over the last steps
  double m_size = 1;                              // mean size of the moving bodies
  double m_weight = 0;                            // mean weight
  bool m_fixedContacts = false;                   // something static or kinematic is in the world
  WorldFigures m_gpu, m_stock;                    // at the end
};

}  // namespace btgpu::tool
