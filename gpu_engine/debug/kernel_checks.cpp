// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "kernel_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

#include "../opencl/error.h"
#include "../opencl/queue.h"

namespace btgpu {
namespace {

// All of it past the queue's own counters.
template <typename Call>
void checked(Call&& call) {
  try {
    call();
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), "while kernels are checked"); }
}

template <size_t N>
std::string textOf(const uint (&characters)[N]) {
  std::string text;
  for (size_t i = 0; i < N && characters[i]; ++i) text += static_cast<char>(characters[i]);
  return text;
}

float floatOf(uint bits) {
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

std::string valuesOf(const DebugRecord& r) {
  switch (r.kind) {
    case DEBUG_INDEX:
      return fmt::format("index {} of {}", r.values[0], r.values[1]);
    case DEBUG_FLOATS:
      return fmt::format("values {} and {}", floatOf(r.values[0]), floatOf(r.values[1]));
    default:
      return fmt::format("values {} and {}", r.values[0], r.values[1]);
  }
}

}  // namespace

void fillWithPattern(Queue& queue, const cl::Buffer& buffer, size_t offset, size_t bytes) {
  if (bytes == 0) return;
  checked([&] { queue.raw().enqueueFillBuffer<cl_uint>(buffer, DEBUG_PATTERN, offset, bytes); });
}

KernelChecks::KernelChecks(const ComputeDevice& device) : m_record{} {
  checked([&] { m_buffer = cl::Buffer(device.context(), CL_MEM_READ_WRITE, sizeof m_record); });
}

void KernelChecks::note(unsigned long count, const std::string& text) {
  if (m_failures.count == 0) m_failures.first = text;
  m_failures.count += count;
}

void KernelChecks::enterStage(Queue& queue, const char* stage) {
  checkZones(queue);
  m_stage = stage;
}

void KernelChecks::leaveStep(Queue& queue) { checkZones(queue); }

Failures KernelChecks::takeFailures(Queue& queue) {
  checkZones(queue);
  return std::exchange(m_failures, {});
}

void KernelChecks::afterAllocation(Queue& queue, const cl::Buffer& buffer, size_t bytes, const std::string& array) {
  size_t all = 0;
  checked([&] { all = buffer.getInfo<CL_MEM_SIZE>(); });
  fillWithPattern(queue, buffer, 0, all);
  if (all > bytes) m_zones.push_back({buffer, bytes, all - bytes, array});
}

void KernelChecks::checkZones(Queue& queue) {
  for (const Zone& zone : m_zones) {
    if (isWhole(queue, zone)) continue;
    note(1, fmt::format("guard zone in {}: something was written behind the end of array '{}'", m_stage, zone.array));
    fillWithPattern(queue, zone.buffer, zone.offset, zone.bytes);
  }
  // Nobody else has these any more.
  const auto last = std::remove_if(m_zones.begin(), m_zones.end(),
                                   [](const Zone& zone) { return zone.buffer.getInfo<CL_MEM_REFERENCE_COUNT>() == 1; });
  m_zones.erase(last, m_zones.end());
}

bool KernelChecks::isWhole(Queue& queue, const Zone& zone) {
  std::vector<uint> words(zone.bytes / sizeof(uint));
  checked([&] { queue.raw().enqueueReadBuffer(zone.buffer, CL_TRUE, zone.offset, zone.bytes, words.data()); });
  return std::all_of(words.begin(), words.end(), [](uint word) { return word == DEBUG_PATTERN; });
}

void KernelChecks::addArray(const std::string& name, size_t length) {
  const uint key = DEBUG_NAME(name.c_str(), name.size() + 1);
  const auto* end = m_record.names + m_record.arrayCount;
  if (m_record.arrayCount == DEBUG_ARRAYS || std::find(std::as_const(m_record).names, end, key) != end) {
    throw OpenClError(OpenClError::Kind::General,
                      fmt::format("kernel {} has too many arrays, or two too much alike: {}", m_kernel, name));
  }
  m_record.names[m_record.arrayCount] = key;
  m_record.lengths[m_record.arrayCount++] = static_cast<uint>(length);
}

void KernelChecks::beforeLaunch(Queue& queue, const Launch& launch) {
  m_kernel = launch.name;
  m_record = {};
  for (size_t i = 0; i < std::min(launch.arguments.size(), launch.parameters.size()); ++i) {
    const Argument& argument = launch.arguments[i];
    if (argument.kind == Argument::Kind::Array) {
      addArray(launch.parameters[i], argument.bytes / argument.elementBytes);
    } else if (argument.kind == Argument::Kind::Null) {
      addArray(launch.parameters[i], 0);
    }
  }
  // The texts are written only with a failure.
  checked([&] { queue.raw().enqueueWriteBuffer(m_buffer, CL_TRUE, 0, offsetof(DebugRecord, file), &m_record); });
}

void KernelChecks::afterLaunch(Queue& queue) {
  checked([&] { queue.raw().enqueueReadBuffer(m_buffer, CL_TRUE, 0, sizeof m_record.failures, &m_record); });
  if (m_record.failures == 0) return;
  checked([&] { queue.raw().enqueueReadBuffer(m_buffer, CL_TRUE, 0, sizeof m_record, &m_record); });
  note(m_record.failures,
       fmt::format("assertion in {}, {}, {} line {}, work item {}: {}, {}", m_stage, m_kernel, textOf(m_record.file),
                   m_record.line, m_record.item, textOf(m_record.text), valuesOf(m_record)));
}

}  // namespace btgpu
