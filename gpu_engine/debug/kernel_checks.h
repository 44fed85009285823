// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>
#include <vector>

#include "../../kernels/shared/debug.h"
#include "../opencl/recorder.h"

namespace btgpu {

// The host's part of a debug build of the kernels (docs/debugging.md). Tells each launch how long its arrays are and
// reads what its assertions found. Fills new memory with a pattern, and looks after each stage whether the zones behind
// the arrays still hold it. Waits after every launch.
class KernelChecks : public Recorder {
 public:
  // Throws OpenClError.
  explicit KernelChecks(const ComputeDevice& device);

  void enterStage(Queue& queue, const char* stage) override;
  void leaveStep(Queue& queue) override;
  void afterAllocation(Queue& queue, const cl::Buffer& buffer, size_t bytes, const std::string& array) override;
  void beforeLaunch(Queue& queue, const Launch& launch) override;
  void afterLaunch(Queue& queue) override;
  const cl::Buffer* checks() const override { return &m_buffer; }
  Failures takeFailures(Queue& queue) override;

 private:
  struct Zone {
    cl::Buffer buffer;
    size_t offset, bytes;
    std::string array;
  };

  void addArray(const std::string& name, size_t length);
  void checkZones(Queue& queue);
  bool isWhole(Queue& queue, const Zone& zone);
  void note(unsigned long count, const std::string& text);

  cl::Buffer m_buffer;   // one DebugRecord
  DebugRecord m_record;  // the host's side of it
  std::string m_stage = "no stage", m_kernel;
  std::vector<Zone> m_zones;
  Failures m_failures;
};

// Fills memory with DEBUG_PATTERN.
void fillWithPattern(Queue& queue, const cl::Buffer& buffer, size_t offset, size_t bytes);

}  // namespace btgpu
