// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "failing_opencl.h"

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>

#include <climits>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace btgpu::test {
namespace {

struct Plan {
  std::vector<std::string> calls;
  int buffers = 0, launches = 0, failures = 0;
  int callsLeft = -1, callsToFail = 0, buffersLeft = -1, launchesLeft = -1;
  unsigned long largestBuffer = ULONG_MAX;
  int callCode = 0, bufferCode = 0, launchCode = 0;
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

// The same for a call of any kind.
bool spendCall(const char* name) {
  plan.calls.push_back(name);
  if (plan.callsToFail == 0 || !spend(plan.callsLeft)) return false;
  if (plan.callsToFail != INT_MAX) --plan.callsToFail;
  return true;
}

template <typename Object>
Object refuse(cl_int* error) {
  if (error) *error = plan.callCode;
  return nullptr;
}

}  // namespace

void FailingOpenCl::reset() { plan = Plan(); }
void FailingOpenCl::failCallsAfter(int calls, int count, int code) {
  plan.callsLeft = calls;
  plan.callsToFail = count;
  plan.callCode = code;
}
void FailingOpenCl::failAllAfter(int calls, int code) { failCallsAfter(calls, INT_MAX, code); }
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
const std::vector<std::string>& FailingOpenCl::calls() { return plan.calls; }
int FailingOpenCl::buffers() { return plan.buffers; }
int FailingOpenCl::launches() { return plan.launches; }
int FailingOpenCl::failures() { return plan.failures; }

}  // namespace btgpu::test

using btgpu::test::plan;
using btgpu::test::real;
using btgpu::test::refuse;
using btgpu::test::spend;
using btgpu::test::spendCall;

extern "C" {

cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void* host, cl_int* error) {
  ++plan.buffers;
  if (spendCall("clCreateBuffer")) return refuse<cl_mem>(error);
  const bool tooLarge = size > plan.largestBuffer;
  if (tooLarge) ++plan.failures;
  if (tooLarge || spend(plan.buffersLeft)) {
    if (error) *error = plan.bufferCode;
    return nullptr;
  }
  return real<decltype(&clCreateBuffer)>("clCreateBuffer")(context, flags, size, host, error);
}

cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions, const size_t* offset,
                              const size_t* global, const size_t* local, cl_uint waitCount, const cl_event* wait,
                              cl_event* event) {
  ++plan.launches;
  if (spendCall("clEnqueueNDRangeKernel")) return plan.callCode;
  if (spend(plan.launchesLeft)) {
    if (plan.onlyOneLaunch) plan.launchesLeft = -1;
    return plan.launchCode;
  }
  return real<decltype(&clEnqueueNDRangeKernel)>("clEnqueueNDRangeKernel")(queue, kernel, dimensions, offset, global,
                                                                           local, waitCount, wait, event);
}

// ---- those that only failCallsAfter makes fail

cl_context clCreateContext(const cl_context_properties* properties, cl_uint count, const cl_device_id* devices,
                           void(CL_CALLBACK* notify)(const char*, const void*, size_t, void*), void* data,
                           cl_int* error) {
  if (spendCall("clCreateContext")) return refuse<cl_context>(error);
  return real<decltype(&clCreateContext)>("clCreateContext")(properties, count, devices, notify, data, error);
}
cl_command_queue clCreateCommandQueue(cl_context context, cl_device_id device, cl_command_queue_properties properties,
                                      cl_int* error) {
  if (spendCall("clCreateCommandQueue")) return refuse<cl_command_queue>(error);
  return real<decltype(&clCreateCommandQueue)>("clCreateCommandQueue")(context, device, properties, error);
}
cl_program clCreateProgramWithSource(cl_context context, cl_uint count, const char** texts, const size_t* lengths,
                                     cl_int* error) {
  if (spendCall("clCreateProgramWithSource")) return refuse<cl_program>(error);
  return real<decltype(&clCreateProgramWithSource)>("clCreateProgramWithSource")(context, count, texts, lengths, error);
}
cl_program clCreateProgramWithBinary(cl_context context, cl_uint count, const cl_device_id* devices,
                                     const size_t* lengths, const unsigned char** binaries, cl_int* status,
                                     cl_int* error) {
  if (spendCall("clCreateProgramWithBinary")) return refuse<cl_program>(error);
  return real<decltype(&clCreateProgramWithBinary)>("clCreateProgramWithBinary")(context, count, devices, lengths,
                                                                                 binaries, status, error);
}
cl_int clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
                      void(CL_CALLBACK* notify)(cl_program, void*), void* data) {
  if (spendCall("clBuildProgram")) return plan.callCode;
  return real<decltype(&clBuildProgram)>("clBuildProgram")(program, count, devices, options, notify, data);
}
cl_kernel clCreateKernel(cl_program program, const char* name, cl_int* error) {
  if (spendCall("clCreateKernel")) return refuse<cl_kernel>(error);
  return real<decltype(&clCreateKernel)>("clCreateKernel")(program, name, error);
}
cl_int clSetKernelArg(cl_kernel kernel, cl_uint index, size_t size, const void* value) {
  if (spendCall("clSetKernelArg")) return plan.callCode;
  return real<decltype(&clSetKernelArg)>("clSetKernelArg")(kernel, index, size, value);
}
cl_int clEnqueueReadBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size,
                           void* to, cl_uint waitCount, const cl_event* wait, cl_event* event) {
  if (spendCall("clEnqueueReadBuffer")) return plan.callCode;
  return real<decltype(&clEnqueueReadBuffer)>("clEnqueueReadBuffer")(queue, buffer, blocking, offset, size, to,
                                                                     waitCount, wait, event);
}
cl_int clEnqueueWriteBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size,
                            const void* from, cl_uint waitCount, const cl_event* wait, cl_event* event) {
  if (spendCall("clEnqueueWriteBuffer")) return plan.callCode;
  return real<decltype(&clEnqueueWriteBuffer)>("clEnqueueWriteBuffer")(queue, buffer, blocking, offset, size, from,
                                                                       waitCount, wait, event);
}
cl_int clEnqueueCopyBuffer(cl_command_queue queue, cl_mem from, cl_mem to, size_t fromOffset, size_t toOffset,
                           size_t size, cl_uint waitCount, const cl_event* wait, cl_event* event) {
  if (spendCall("clEnqueueCopyBuffer")) return plan.callCode;
  return real<decltype(&clEnqueueCopyBuffer)>("clEnqueueCopyBuffer")(queue, from, to, fromOffset, toOffset, size,
                                                                     waitCount, wait, event);
}
void* clEnqueueMapBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocking, cl_map_flags flags, size_t offset,
                         size_t size, cl_uint waitCount, const cl_event* wait, cl_event* event, cl_int* error) {
  if (spendCall("clEnqueueMapBuffer")) return refuse<void*>(error);
  return real<decltype(&clEnqueueMapBuffer)>("clEnqueueMapBuffer")(queue, buffer, blocking, flags, offset, size,
                                                                   waitCount, wait, event, error);
}

// What ends something does so even where it fails: a device that is lost runs nothing any more.
cl_int clEnqueueUnmapMemObject(cl_command_queue queue, cl_mem memory, void* mapped, cl_uint waitCount,
                               const cl_event* wait, cl_event* event) {
  const cl_int code = real<decltype(&clEnqueueUnmapMemObject)>("clEnqueueUnmapMemObject")(queue, memory, mapped,
                                                                                          waitCount, wait, event);
  return spendCall("clEnqueueUnmapMemObject") ? plan.callCode : code;
}
cl_int clFlush(cl_command_queue queue) {
  const cl_int code = real<decltype(&clFlush)>("clFlush")(queue);
  return spendCall("clFlush") ? plan.callCode : code;
}
cl_int clFinish(cl_command_queue queue) {
  const cl_int code = real<decltype(&clFinish)>("clFinish")(queue);
  return spendCall("clFinish") ? plan.callCode : code;
}
cl_int clWaitForEvents(cl_uint count, const cl_event* events) {
  const cl_int code = real<decltype(&clWaitForEvents)>("clWaitForEvents")(count, events);
  return spendCall("clWaitForEvents") ? plan.callCode : code;
}

}  // extern "C"
