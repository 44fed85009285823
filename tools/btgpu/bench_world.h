// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What `btgpu bench` steps and measures. Knows nothing of any physics library.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace btgpu::tool {

// Where the time of the last step went, as far as the world tells.
struct StepSplit {
  std::optional<double> deviceMs, translateMs;
};

// Figures of the last step; what a world does not count is left out.
struct StepCounts {
  std::optional<long> launches, waits, manifolds, contacts, colours, deviceBytes;
};

// Of the bodies that can move, after the last step.
struct EndFigures {
  double meanHeight = 0, kineticEnergy = 0;  // along gravity upwards; J a body
};

class BenchWorld {
 public:
  virtual ~BenchWorld() = default;
  virtual void step() = 0;  // with the results on the host at its end
  virtual StepSplit split() const { return {}; }
  virtual StepCounts counts() = 0;  // may take its time
  virtual std::optional<EndFigures> end() const { return {}; }
  virtual int bodies() const = 0;
  virtual std::string device() const = 0;
  virtual std::string driver() const { return {}; }
  // Empty, or why the figures are not those of this world.
  virtual std::string failure() const { return {}; }
};

}  // namespace btgpu::tool
