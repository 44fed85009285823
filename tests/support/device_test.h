// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Fixture for tests that run kernels. CTest runs each such test in both kernel shapes (BTGPU_KERNEL_SHAPE), and the
// cases whose name ends in "Small" under Oclgrind as well.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <memory>

#include "gpu_engine/debug/recorders.h"
#include "gpu_engine/opencl/error.h"
#include "gpu_engine/opencl/queue.h"

namespace btgpu {

class DeviceTest : public ::testing::Test {
 protected:
  // No device is a failure, not a skip: a test that did not run must not count as passed.
  // With BTGPU_DEBUG_KERNELS=1 nothing may fail in the kernels either.
  DeviceTest() : m_device(ComputeDevice::open("", ComputeDevice::debugKernelsWanted())), m_queue(m_device, false) {
    m_queue.setRecorder(recorderFromEnvironment(*m_device));
  }
  ~DeviceTest() override {
    const Failures failures = m_queue.recorder() ? m_queue.recorder()->takeFailures(m_queue) : Failures();
    EXPECT_EQ(failures.count, 0u) << failures.first;
    // For scripts/under_oclgrind.sh, which fails where there were none.
    if (!std::getenv("BTGPU_COUNT_LAUNCHES")) return;
    std::cout << "launches of kernels: " << m_queue.launches() + m_launchesElsewhere << '\n';
  }

  ComputeDevice& device() { return *m_device; }
  Queue& queue() { return m_queue; }
  // What a test launched in a queue of its own.
  void countLaunches(int launches) { m_launchesElsewhere += launches; }

  std::shared_ptr<ComputeDevice> m_device;
  Queue m_queue;

 private:
  int m_launchesElsewhere = 0;
};

}  // namespace btgpu
