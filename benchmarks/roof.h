// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the device can do at most, and how near to it a piece of work comes.
#pragma once

#include <benchmark/benchmark.h>

#include <string>

#include "gpu_engine/opencl/queue.h"

namespace btgpu {

struct Roof {
  double bytesPerSecond = 0;  // of copies in the device's memory, read and written bytes counted
  double flopsPerSecond = 0;  // of fused multiply-adds on float16, two flops each
};

// Measured, in well under a second on a GPU and a few on a CPU. The queue must have profiling on.
Roof measureRoof(Queue& queue);

// Work at its least: every input read once and every result written once, whatever caches and passes make of it.
struct Work {
  double bytes = 0, flops = 0;
};

// Sets the counters MB, GB/s, flops/B and roof%: the share of the measured time that the work would take if the device
// did nothing but the larger one of the two. `seconds` of one iteration. Caches can bring it above 100.
void reportRoof(benchmark::State& state, const Roof& roof, const Work& work, double seconds);

// Adds the device and the roof to the head of the output.
void describeRoof(const ComputeDevice& device, const Roof& roof);

}  // namespace btgpu
