// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstdint>

#include "cl.h"

namespace btgpu {

// The clock of a device's events on the host's axis, std::chrono::steady_clock. Both count nanoseconds; what lies
// between them is measured by small writes, each of which was queued after a host time and had ended before another.
class DeviceClock {
 public:
  // Waits for the queue, which has to be made with profiling; best while it is idle. A call of OpenCL that fails leaves
  // the clock as it was.
  void correlate(const cl::Context& context, const cl::CommandQueue& queue) noexcept;

  bool isKnown() const { return m_known; }
  bool isDue() const;  // the clocks may have drifted apart since
  std::int64_t toHost(cl_ulong deviceTime) const { return static_cast<std::int64_t>(deviceTime) + m_offset; }
  // Half the range in which the offset was found to lie; nanoseconds.
  std::int64_t accuracy() const { return m_accuracy; }

 private:
  cl::Buffer m_target;  // of the writes
  bool m_known = false;
  std::int64_t m_offset = 0, m_accuracy = 0, m_measured = 0;
};

// Nanoseconds of std::chrono::steady_clock.
std::int64_t hostNow();

}  // namespace btgpu
