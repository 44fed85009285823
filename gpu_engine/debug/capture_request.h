// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>
#include <vector>

namespace btgpu {

// A stage to capture, by its number ("44", all stages of that number) or its stem, or "all", and the step, from 0.
struct CaptureRequest {
  static constexpr long kEveryStep = -1;
  std::string stage;
  long step = 0;

  bool matches(const std::string& stem, long number) const {
    if (step != kEveryStep && step != number) return false;
    return stage == "all" || stem == stage || stem.substr(0, stem.find('_')) == stage;
  }
};

// What BTGPU_CAPTURE asks for: "44@120,70_solve_velocities@3". Throws OpenClError if it makes no sense.
std::vector<CaptureRequest> parseCaptureRequests(const std::string& text);

}  // namespace btgpu
