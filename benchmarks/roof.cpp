// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "roof.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

namespace btgpu {
namespace {

constexpr int kTries = 5;

// Several chains of multiply-adds in each work item, so that none waits for the one before.
const char* const kKernels = R"(
__kernel void copyAll(uint items, __global const float16* from, __global float16* to) {
  const uint first = (uint)((ulong)items * get_group_id(0) / get_num_groups(0));
  const uint end = (uint)((ulong)items * (get_group_id(0) + 1) / get_num_groups(0));
  for (uint i = first + get_local_id(0); i < end; i += get_local_size(0)) to[i] = from[i];
}
__kernel void multiplyAdds(uint rounds, __global float* out) {
  float16 a = (float16)(get_global_id(0) * 1e-6f), b = a + 0.1f, c = a + 0.2f, d = a + 0.3f;
  const float16 m = (float16)(0.999f), n = (float16)(1e-3f);
  for (uint i = 0; i < rounds; ++i) {
    a = fma(a, m, n);
    b = fma(b, m, n);
    c = fma(c, m, n);
    d = fma(d, m, n);
  }
  const float16 s = a + b + c + d;
  out[get_global_id(0)] = s.s0 + s.s1 + s.s2 + s.s3 + s.s4 + s.s5 + s.s6 + s.s7 + s.s8 + s.s9 + s.sa + s.sb + s.sc +
                          s.sd + s.se + s.sf;
}
)";

double seconds(const cl::Event& event) {
  return 1e-9 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                    event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
}

size_t localSize(const ComputeDevice& device) { return device.shape() == KernelShape::Cpu ? 1 : 128; }

double measureCopies(Queue& queue, const cl::Program& program) {
  const auto& description = queue.device().description();
  // Well beyond the caches, where there is room.
  const size_t bytes = std::min<size_t>(size_t{256} << 20, description.globalMemory / 16);
  const cl::Buffer from(queue.device().context(), CL_MEM_READ_WRITE, bytes),
      to(queue.device().context(), CL_MEM_READ_WRITE, bytes);
  queue.raw().enqueueFillBuffer(from, cl_uint{1}, 0, bytes);
  queue.raw().enqueueFillBuffer(to, cl_uint{1}, 0, bytes);
  cl::Kernel kernel(program, "copyAll");
  kernel.setArg(0, static_cast<cl_uint>(bytes / 64));
  kernel.setArg(1, from);
  kernel.setArg(2, to);
  const size_t local = localSize(queue.device());
  const size_t groups = description.computeUnits * (local == 1 ? 1 : 16);
  double best = 1e30;
  for (int i = 0; i < kTries; ++i) {
    cl::Event copied, launched;  // a driver's own copy may be done by one thread, or by an engine beside the cores
    queue.raw().enqueueCopyBuffer(from, to, 0, 0, bytes, nullptr, &copied);
    queue.raw().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(local * groups), cl::NDRange(local), nullptr,
                                     &launched);
    queue.raw().finish();
    if (i > 0) best = std::min({best, seconds(copied), seconds(launched)});
  }
  return 2 * static_cast<double>(bytes) / best;
}

double measureFlops(Queue& queue, const cl::Program& program) {
  cl::Kernel kernel(program, "multiplyAdds");
  const size_t local = localSize(queue.device());
  const size_t items = local * 64 * queue.device().description().computeUnits;
  const cl_uint rounds = 4096;
  const cl::Buffer out(queue.device().context(), CL_MEM_WRITE_ONLY, items * sizeof(float));
  kernel.setArg(0, rounds);
  kernel.setArg(1, out);
  double best = 1e30;
  for (int i = 0; i < kTries; ++i) {
    cl::Event done;
    queue.raw().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(items), cl::NDRange(local), nullptr, &done);
    queue.raw().finish();
    if (i > 0) best = std::min(best, seconds(done));
  }
  return 2.0 * 16 * 4 * rounds * static_cast<double>(items) / best;
}

}  // namespace

Roof measureRoof(Queue& queue) {
  cl::Program program(queue.device().context(), kKernels);
  program.build();
  return {measureCopies(queue, program), measureFlops(queue, program)};
}

void reportRoof(benchmark::State& state, const Roof& roof, const Work& work, double seconds) {
  state.counters["MB"] = work.bytes / 1e6;
  if (!(seconds > 0) || !(work.bytes > 0)) return;
  const double least = std::max(work.bytes / roof.bytesPerSecond, work.flops / roof.flopsPerSecond);
  state.counters["GB/s"] = work.bytes / seconds / 1e9;
  state.counters["flops/B"] = work.flops / work.bytes;
  state.counters["roof%"] = 100 * least / seconds;
}

void describeRoof(const ComputeDevice& device, const Roof& roof) {
  benchmark::AddCustomContext("device", device.description().name);
  benchmark::AddCustomContext("shape", device.shape() == KernelShape::Cpu ? "cpu" : "gpu");
  benchmark::AddCustomContext("copyGBs", fmt::format("{:.1f}", roof.bytesPerSecond / 1e9));
  benchmark::AddCustomContext("gflops", fmt::format("{:.1f}", roof.flopsPerSecond / 1e9));
}

}  // namespace btgpu
