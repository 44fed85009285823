// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "queue.h"

#include <fmt/format.h>

#include <algorithm>

#include "error.h"

namespace btgpu {

Queue::Queue(std::shared_ptr<ComputeDevice> device, bool profile) : m_device(std::move(device)), m_profile(profile) {
  try {
    m_queue = cl::CommandQueue(m_device->context(), m_device->device(), profile ? CL_QUEUE_PROFILING_ENABLE : 0);
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), m_device->description().name); }
}

void Queue::launch(const cl::Kernel& kernel, const std::string& name, Grid grid) {
  cl::Event event;
  try {
    m_queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(grid.global), cl::NDRange(grid.local), nullptr,
                                 m_profile ? &event : nullptr);
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), "kernel " + name); }
  ++m_launches;
  if (m_profile) m_timed.push_back({m_stage, event});
}

void Queue::write(const cl::Buffer& buffer, size_t offset, size_t bytes, const void* from, bool wait) {
  if (bytes == 0) return;
  if (m_recorder) m_recorder->beforeWrite(*this, buffer, offset, bytes, from);
  try {
    m_queue.enqueueWriteBuffer(buffer, wait ? CL_TRUE : CL_FALSE, offset, bytes, from);
  } catch (const cl::Error& e) {
    throw makeOpenClError(e.err(), e.what(), fmt::format("{} bytes to the device", bytes));
  }
  if (wait) ++m_waits;
}

void Queue::read(const cl::Buffer& buffer, size_t offset, size_t bytes, void* to, bool wait, cl::Event* done) {
  if (bytes == 0) return;
  try {
    m_queue.enqueueReadBuffer(buffer, wait ? CL_TRUE : CL_FALSE, offset, bytes, to, nullptr, done);
  } catch (const cl::Error& e) {
    throw makeOpenClError(e.err(), e.what(), fmt::format("{} bytes from the device", bytes));
  }
  if (wait) ++m_waits;
}

void Queue::copy(const cl::Buffer& from, const cl::Buffer& to, size_t fromOffset, size_t toOffset, size_t bytes) {
  if (bytes == 0) return;
  if (m_recorder) m_recorder->beforeCopy(*this, from, to, fromOffset, toOffset, bytes);
  try {
    m_queue.enqueueCopyBuffer(from, to, fromOffset, toOffset, bytes);
  } catch (const cl::Error& e) {
    throw makeOpenClError(e.err(), e.what(), fmt::format("{} bytes on the device", bytes));
  }
}

void* Queue::map(const cl::Buffer& buffer, size_t bytes) {
  try {
    return m_queue.enqueueMapBuffer(buffer, CL_FALSE, CL_MAP_READ, 0, bytes);
  } catch (const cl::Error& e) {
    throw makeOpenClError(e.err(), e.what(), fmt::format("{} bytes mapped from the device", bytes));
  }
}

void Queue::unmap(const cl::Buffer& buffer, void* mapped) {
  try {
    m_queue.enqueueUnmapMemObject(buffer, mapped);
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), "at the end of a mapping"); }
}

void Queue::finish() {
  try {
    m_queue.finish();
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), "at the end of a step"); }
  ++m_waits;
}

void Queue::wait(const cl::Event& event) {
  try {
    event.wait();
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), "at the end of a step"); }
  ++m_waits;
}

void Queue::flush() {
  try {
    m_queue.flush();
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), "in a step"); }
}

std::vector<StageTime> Queue::takeProfile() {
  std::vector<StageTime> times;
  if (m_timed.empty()) return times;
  m_queue.finish();
  for (const auto& timed : m_timed) {
    auto it = std::find_if(times.begin(), times.end(), [&](const StageTime& t) { return t.stage == timed.stage; });
    if (it == times.end()) it = times.insert(times.end(), {timed.stage, 0, 0});
    const auto start = timed.event.getProfilingInfo<CL_PROFILING_COMMAND_START>();
    const auto end = timed.event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
    it->milliseconds += static_cast<double>(end - start) * 1e-6;
    ++it->launches;
  }
  m_timed.clear();
  return times;
}

}  // namespace btgpu
