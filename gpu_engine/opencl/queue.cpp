// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "queue.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "error.h"

namespace btgpu {

Queue::Queue(std::shared_ptr<ComputeDevice> device, bool profile) : m_device(std::move(device)), m_profile(profile) {
  try {
    m_queue = cl::CommandQueue(m_device->context(), m_device->device(), profile ? CL_QUEUE_PROFILING_ENABLE : 0);
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), m_device->description().name); }
  if (m_profile) m_clock.correlate(m_device->context(), m_queue);
}

void Queue::launch(const cl::Kernel& kernel, const std::string& name, Grid grid) {
  cl::Event event;
  try {
    m_queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(grid.global), cl::NDRange(grid.local), nullptr,
                                 m_profile ? &event : nullptr);
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), "kernel " + name); }
  ++m_launches;
  if (m_profile) m_timed.push_back({m_stage, name, event});
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

void Queue::note(const Timed& timed, const DeviceSlice& slice) {
  auto it = std::find_if(m_times.begin(), m_times.end(), [&](const StageTime& t) { return t.stage == timed.stage; });
  if (it == m_times.end()) it = m_times.insert(m_times.end(), {timed.stage, 0, 0});
  it->milliseconds += static_cast<double>(slice.ended - slice.started) * 1e-6;
  ++it->launches;
}

void Queue::collectTimes(ZoneSink* sink, bool idle) {
  if (!m_profile) return;
  const Zone zone("collectTimes");
  if (idle && m_clock.isDue()) m_clock.correlate(m_device->context(), m_queue);
  std::vector<DeviceSlice> slices;
  size_t ended = 0, lost = 0;
  for (; ended < m_timed.size(); ++ended) {
    const Timed& timed = m_timed[ended];
    // A step must not fail for its times.
    try {
      if (timed.event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() > CL_COMPLETE) break;
      const auto time = [&](cl_profiling_info what) {
        cl_ulong t = 0;
        const cl_int error = clGetEventProfilingInfo(timed.event(), what, sizeof t, &t, nullptr);
        if (error != CL_SUCCESS) throw cl::Error(error, "clGetEventProfilingInfo");
        return m_clock.toHost(t);
      };
      const DeviceSlice slice{timed.stage,
                              timed.kernel.c_str(),
                              time(CL_PROFILING_COMMAND_QUEUED),
                              time(CL_PROFILING_COMMAND_SUBMIT),
                              time(CL_PROFILING_COMMAND_START),
                              time(CL_PROFILING_COMMAND_END)};
      note(timed, slice);
      slices.push_back(slice);
    } catch (const cl::Error&) { ++lost; }
  }
  if (!m_clock.isKnown()) {
    lost += slices.size();
    slices.clear();
  }
  if (sink && ended > 0) sink->add({slices.data(), slices.size(), m_clock.accuracy(), lost});
  m_timed.erase(m_timed.begin(), m_timed.begin() + static_cast<std::ptrdiff_t>(ended));
}

std::vector<StageTime> Queue::takeProfile(ZoneSink* sink) {
  if (m_profile) m_queue.finish();
  collectTimes(sink, true);
  return std::exchange(m_times, {});
}

}  // namespace btgpu
