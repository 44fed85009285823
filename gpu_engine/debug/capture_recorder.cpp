// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "capture_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "../opencl/error.h"
#include "../opencl/queue.h"
#include "btgpu_version.h"
#include "capture_file.h"

namespace btgpu {
namespace {

// Past the queue's own counters.
Bytes contents(Queue& queue, const cl::Buffer& buffer) {
  Bytes bytes;
  try {
    bytes.resize(buffer.getInfo<CL_MEM_SIZE>());
    queue.raw().enqueueReadBuffer(buffer, CL_TRUE, 0, bytes.size(), bytes.data());
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), "while a stage is captured"); }
  return bytes;
}

Capture emptyCapture(const ComputeDevice& device, const char* stage, long step) {
  Capture capture;
  capture.stage = stage;
  capture.step = static_cast<std::uint64_t>(step);
  capture.version = BTGPU_VERSION;
  capture.device = device.description().name;
  capture.driver = device.description().driver;
  capture.cpuShape = device.shape() == KernelShape::Cpu;
  if (const char* options = std::getenv("BTGPU_BUILD_OPTIONS")) capture.buildOptions = options;
  return capture;
}

std::string fileFor(const Capture& capture, const std::string& path) {
  std::string name = fmt::format("btgpu-{}-{}.btgpucap", capture.stage, capture.step);
  if (path.empty()) return name;
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored) ? (std::filesystem::path(path) / name).string() : path;
}

std::uint32_t indexOf(const std::map<cl_mem, std::uint32_t>& indices, const cl::Buffer& buffer) {
  const auto found = indices.find(buffer());
  return found == indices.end() ? CapturedView::kNone : found->second;
}

// A capture that can't be written must not cost the step.
void writeFile(const Capture& capture, const std::string& path) {
  const std::string file = fileFor(capture, path);
  try {
    writeCapture(file, capture);
    fmt::print(stderr, "btgpu: captured {} of step {} in {}\n", capture.stage, capture.step, file);
  } catch (const CaptureError& e) { fmt::print(stderr, "btgpu: {}\n", e.what()); }
}

}  // namespace

CaptureRecorder::CaptureRecorder(std::vector<CaptureRequest> requests, std::function<void(const Capture&)> done)
    : m_requests(std::move(requests)), m_met(m_requests.size()), m_done(std::move(done)) {}

CaptureRecorder::~CaptureRecorder() {
  for (size_t i = 0; i < m_requests.size(); ++i) {
    if (m_met[i] || !m_stepped || m_requests[i].step == CaptureRequest::kEveryStep) continue;
    std::fprintf(stderr, "btgpu: nothing to capture: no stage %s in step %ld of this world\n",
                 m_requests[i].stage.c_str(), m_requests[i].step);
  }
}

// What an error left open is dropped.
void CaptureRecorder::enterStep(Queue&, long step) {
  m_open.reset();
  m_step = step;
  m_stepped = true;
}

void CaptureRecorder::leaveStep(Queue& queue) {
  close(queue);
  m_step.reset();
}

void CaptureRecorder::enterStage(Queue& queue, const char* stage) {
  if (m_open && m_open->capture.stage == stage && m_open->capture.commands.empty()) return;  // begun by beforeStage()
  open(queue, stage);
}

void CaptureRecorder::open(Queue& queue, const char* stage) {
  close(queue);
  if (!wanted(stage)) return;
  m_open.emplace();
  m_open->capture = emptyCapture(queue.device(), stage, *m_step);
}

void CaptureRecorder::beforeStage(Queue& queue, const char* stage, const std::function<StageInputs()>& inputs) {
  open(queue, stage);
  if (!m_open) return;
  StageInputs given = inputs();
  const auto isRead = [&](const std::string& name) {
    return std::find(given.alsoRead.begin(), given.alsoRead.end(), name) != given.alsoRead.end();
  };
  for (const ArrayInUse& array : given.arrays) {
    if (!isRead(array.name) || array.bytes == 0) continue;
    m_open->capture.arrays[touch(queue, array.buffer)].name = array.name;
  }
  m_open->arrays = std::move(given.arrays);
  m_open->capture.numbers = std::move(given.numbers);
}

// A stage that ran on the host gave the queue nothing but writes.
void CaptureRecorder::afterStage(Queue& queue, const std::function<std::vector<ArrayInUse>()>& arrays) {
  if (!m_open) return;
  const std::vector<ArrayInUse> after = arrays();
  for (size_t i = 0; i < m_open->arrays.size() && i < after.size(); ++i) {
    const ArrayInUse& before = m_open->arrays[i];
    CapturedView view{before.name, indexOf(m_open->indices, before.buffer), indexOf(m_open->indices, after[i].buffer),
                      before.bytes, after[i].bytes};
    if (view.before == CapturedView::kNone && view.after == CapturedView::kNone && view.bytesBefore > 0) continue;
    m_open->capture.views.push_back(std::move(view));
  }
  close(queue);
}

bool CaptureRecorder::wanted(const char* stage) {
  bool any = false;
  for (size_t i = 0; m_step && i < m_requests.size(); ++i) {
    if (!m_requests[i].matches(stage, *m_step)) continue;
    m_met[i] = any = true;
  }
  return any;
}

void CaptureRecorder::close(Queue& queue) {
  if (!m_open) return;
  Open open = std::move(*m_open);
  m_open.reset();
  for (size_t i = 0; i < open.buffers.size(); ++i) {
    CapturedArray& array = open.capture.arrays[i];
    array.after = contents(queue, open.buffers[i]);
    if (array.after == array.before) array.after = {};
  }
  m_done(open.capture);
}

std::uint32_t CaptureRecorder::touch(Queue& queue, const cl::Buffer& buffer) {
  const auto next = static_cast<std::uint32_t>(m_open->buffers.size());
  const auto [it, isNew] = m_open->indices.emplace(buffer(), next);
  if (isNew) {
    m_open->buffers.push_back(buffer);
    m_open->capture.arrays.push_back({"", "", 1, contents(queue, buffer), {}});
  }
  return it->second;
}

// Swapped arrays: memory keeps the name under which it was first seen.
std::uint32_t CaptureRecorder::touch(Queue& queue, const Argument& argument) {
  const std::uint32_t index = touch(queue, argument.buffer);
  CapturedArray& array = m_open->capture.arrays[index];
  if (array.type.empty()) {
    array.name = argument.name;
    array.type = argument.type;
    array.elementBytes = static_cast<std::uint32_t>(argument.elementBytes);
  }
  return index;
}

CapturedArgument CaptureRecorder::captured(Queue& queue, const Argument& argument) {
  using Kind = CapturedArgument::Kind;
  switch (argument.kind) {
    case Argument::Kind::Array:
      return {Kind::Array, touch(queue, argument), {}};
    case Argument::Kind::Null:
      return {Kind::Null, 0, argument.type};
    case Argument::Kind::Uint:
      return {Kind::Uint, argument.bits, {}};
    case Argument::Kind::Float:
      break;
  }
  return {Kind::Float, argument.bits, {}};
}

void CaptureRecorder::beforeLaunch(Queue& queue, const Launch& launch) {
  if (!m_open) return;
  CapturedLaunch captive{launch.file, launch.name, launch.options, launch.grid.global, launch.grid.local, {}};
  for (const Argument& argument : launch.arguments) captive.arguments.push_back(captured(queue, argument));
  m_open->capture.commands.emplace_back(std::move(captive));
}

void CaptureRecorder::beforeWrite(Queue& queue, const cl::Buffer& to, size_t offset, size_t bytes, const void* from) {
  if (!m_open) return;
  const auto* data = static_cast<const unsigned char*>(from);
  const std::uint32_t array = touch(queue, to);
  m_open->capture.commands.emplace_back(CapturedWrite{array, offset, {data, data + bytes}});
}

void CaptureRecorder::beforeCopy(Queue& queue, const cl::Buffer& from, const cl::Buffer& to, size_t fromOffset,
                                 size_t toOffset, size_t bytes) {
  if (!m_open) return;
  const std::uint32_t source = touch(queue, from), target = touch(queue, to);
  m_open->capture.commands.emplace_back(CapturedCopy{source, target, fromOffset, toOffset, bytes});
}

std::unique_ptr<Recorder> makeCaptureRecorder(const std::string& requests, const std::string& path) {
  return std::make_unique<CaptureRecorder>(parseCaptureRequests(requests),
                                           [path](const Capture& capture) { writeFile(capture, path); });
}

}  // namespace btgpu
