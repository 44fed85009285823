// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The one table of limits of `btgpu compare` and of the cross-check in the application, with the reason of each.
// docs/compare.md is written from it.
#pragma once

#include <string>
#include <vector>

namespace btgpu {

struct Tolerance {
  const char* name;     // of the check
  double limit;         // the value may not exceed it
  const char* meaning;  // what the value is
  const char* reason;   // why this limit
};

const std::vector<Tolerance>& tolerances();
const Tolerance& tolerance(const std::string& name);

struct Check {
  std::string name;
  double value, limit;
  bool pass() const { return value <= limit; }  // NaN fails
};

// For a solver whose iterations do less than stock's (Jacobi with split masses): of the checks that show how far the
// world's number of iterations comes, only the values stay.
void liftLimitsOfIterations(std::vector<Check>& checks);

inline Check makeCheck(const std::string& name, double value) { return {name, value, tolerance(name).limit}; }

}  // namespace btgpu
