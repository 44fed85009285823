// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "failing_opencl.h"

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>

#include <climits>
#include <cstdio>
#include <cstdlib>

namespace btgpu::test {
namespace {

struct Plan {
  int buffers = 0, launches = 0, failures = 0;
  int buffersLeft = -1, launchesLeft = -1;
  unsigned long largestBuffer = ULONG_MAX;
  int bufferCode = 0, launchCode = 0;
  bool onlyOneLaunch = false;
};
Plan plan;

template <typename Function>
Function real(const char* name) {
  static void* library = dlopen("libOpenCL.so.1", RTLD_NOW | RTLD_LOCAL);
  void* function = library ? dlsym(library, name) : nullptr;
  if (!function) {
    std::fprintf(stderr, "no %s in libOpenCL.so.1\n", name);
    std::abort();
  }
  return reinterpret_cast<Function>(function);
}

// True if this call is to fail.
bool spend(int& left) {
  if (left < 0) return false;
  if (left > 0) {
    --left;
    return false;
  }
  ++plan.failures;
  return true;
}

}  // namespace

void FailingOpenCl::reset() { plan = Plan(); }
void FailingOpenCl::failBuffersAfter(int calls, int code) {
  plan.buffersLeft = calls;
  plan.bufferCode = code;
}
void FailingOpenCl::failBuffersLargerThan(unsigned long bytes, int code) {
  plan.largestBuffer = bytes;
  plan.bufferCode = code;
}
void FailingOpenCl::failLaunchesAfter(int calls, int code) {
  plan.launchesLeft = calls;
  plan.launchCode = code;
}
void FailingOpenCl::failOneLaunchAfter(int calls, int code) {
  failLaunchesAfter(calls, code);
  plan.onlyOneLaunch = true;
}
int FailingOpenCl::buffers() { return plan.buffers; }
int FailingOpenCl::launches() { return plan.launches; }
int FailingOpenCl::failures() { return plan.failures; }

}  // namespace btgpu::test

using btgpu::test::plan;
using btgpu::test::real;
using btgpu::test::spend;

extern "C" cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void* host, cl_int* error) {
  ++plan.buffers;
  const bool tooLarge = size > plan.largestBuffer;
  if (tooLarge) ++plan.failures;
  if (tooLarge || spend(plan.buffersLeft)) {
    if (error) *error = plan.bufferCode;
    return nullptr;
  }
  return real<decltype(&clCreateBuffer)>("clCreateBuffer")(context, flags, size, host, error);
}

extern "C" cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                                         const size_t* offset, const size_t* global, const size_t* local,
                                         cl_uint waitCount, const cl_event* wait, cl_event* event) {
  ++plan.launches;
  if (spend(plan.launchesLeft)) {
    if (plan.onlyOneLaunch) plan.launchesLeft = -1;
    return plan.launchCode;
  }
  return real<decltype(&clEnqueueNDRangeKernel)>("clEnqueueNDRangeKernel")(queue, kernel, dimensions, offset, global,
                                                                           local, waitCount, wait, event);
}
