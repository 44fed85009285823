// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "device_clock.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <limits>

namespace btgpu {
namespace {

constexpr int kRounds = 8;                         // the narrowest of them count; the first one pays for the buffer
constexpr std::int64_t kInterval = 1'000'000'000;  // clocks that NTP steers part by half a microsecond in a millisecond

std::int64_t timeOf(const cl::Event& event, cl_profiling_info what) {
  cl_ulong time = 0;
  const cl_int error = clGetEventProfilingInfo(event(), what, sizeof time, &time, nullptr);
  if (error != CL_SUCCESS) throw cl::Error(error, "clGetEventProfilingInfo");
  return static_cast<std::int64_t>(time);
}

}  // namespace

std::int64_t hostNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

bool DeviceClock::isDue() const { return !m_known || hostNow() - m_measured > kInterval; }

void DeviceClock::correlate(const cl::Context& context, const cl::CommandQueue& queue) noexcept {
  std::int64_t lower = std::numeric_limits<std::int64_t>::min(), upper = std::numeric_limits<std::int64_t>::max();
  try {
    if (m_target() == nullptr) m_target = cl::Buffer(context, CL_MEM_READ_WRITE, sizeof(cl_uint));
    const cl_uint nothing = 0;
    for (int round = 0; round < kRounds; ++round) {
      cl::Event event;
      const std::int64_t before = hostNow();
      queue.enqueueWriteBuffer(m_target, CL_FALSE, 0, sizeof nothing, &nothing, nullptr, &event);
      queue.finish();
      const std::int64_t after = hostNow();
      lower = std::max(lower, before - timeOf(event, CL_PROFILING_COMMAND_QUEUED));
      upper = std::min(upper, after - timeOf(event, CL_PROFILING_COMMAND_END));
    }
  } catch (const cl::Error&) { return; }
  m_known = true;
  m_measured = hostNow();
  // Where the driver's times contradict each other the range is inside out, and as wide as they do.
  m_offset = lower + (upper - lower) / 2;
  m_accuracy = std::abs(upper - lower) / 2 + 1;
}

}  // namespace btgpu
