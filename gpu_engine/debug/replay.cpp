// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <tuple>

#include "../opencl/error.h"
#include "../opencl/kernel.h"
#include "array_difference.h"
#include "btgpu_version.h"
#include "capture_file.h"

namespace btgpu {
namespace {

class Replay {
 public:
  Replay(const Capture& capture, std::shared_ptr<ComputeDevice> device)
      : m_capture(capture), m_queue(std::move(device), false) {
    for (const CapturedArray& array : capture.arrays) m_buffers.push_back(makeBuffer(array));
  }

  void run() {
    for (const CapturedCommand& command : m_capture.commands) {
      std::visit([this](const auto& c) { run(c); }, command);
    }
    m_queue.finish();
  }

  // From the start of the first command to the end of the last one, in ms; arrays are again as they were before.
  double time() {
    for (size_t i = 0; i < m_buffers.size(); ++i) {
      const Bytes& before = m_capture.arrays[i].before;
      m_queue.write(m_buffers[i], 0, before.size(), before.data(), true);
    }
    const auto start = std::chrono::steady_clock::now();
    run();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  }

  std::vector<Bytes> contents() {
    std::vector<Bytes> all;
    for (size_t i = 0; i < m_buffers.size(); ++i) {
      all.emplace_back(m_capture.arrays[i].before.size());
      m_queue.read(m_buffers[i], 0, all[i].size(), all[i].data(), true);
    }
    return all;
  }

 private:
  cl::Buffer makeBuffer(const CapturedArray& array) {
    cl::Buffer buffer;
    try {
      buffer = cl::Buffer(m_queue.device().context(), CL_MEM_READ_WRITE, array.before.size());
    } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), array.name); }
    m_queue.write(buffer, 0, array.before.size(), array.before.data(), true);
    return buffer;
  }

  void run(const CapturedLaunch& launch) {
    Launch again{launch.file, launch.name, launch.options, {launch.global, launch.local}, {}, {}};
    for (const CapturedArgument& argument : launch.arguments) again.arguments.push_back(argumentOf(argument));
    kernelOf(launch).relaunch(m_queue, again);
  }
  void run(const CapturedWrite& write) {
    m_queue.write(m_buffers[write.array], write.offset, write.data.size(), write.data.data(), true);
  }
  void run(const CapturedCopy& copy) {
    m_queue.copy(m_buffers[copy.from], m_buffers[copy.to], copy.fromOffset, copy.toOffset, copy.bytes);
  }

  Argument argumentOf(const CapturedArgument& captured) const {
    using Kind = CapturedArgument::Kind;
    Argument argument;
    argument.bits = captured.value;
    argument.type = captured.type;
    if (captured.kind == Kind::Uint || captured.kind == Kind::Float) {
      argument.kind = captured.kind == Kind::Uint ? Argument::Kind::Uint : Argument::Kind::Float;
      argument.type = captured.kind == Kind::Uint ? "uint" : "float";
    } else if (captured.kind == Kind::Array) {
      argument.kind = Argument::Kind::Array;
      argument.type = m_capture.arrays[captured.value].type;
      argument.buffer = m_buffers[captured.value];
    }
    return argument;
  }

  Kernel& kernelOf(const CapturedLaunch& launch) {
    const auto key = std::tie(launch.file, launch.name, launch.options);
    auto it = m_kernels.find(key);
    if (it == m_kernels.end()) {
      it = m_kernels.emplace(key, Kernel(m_queue.device(), launch.file, launch.name, launch.options)).first;
    }
    return it->second;
  }

  const Capture& m_capture;
  Queue m_queue;
  std::vector<cl::Buffer> m_buffers;
  std::map<std::tuple<std::string, std::string, std::string>, Kernel> m_kernels;
};

// The device in the shape that was captured.
std::shared_ptr<ComputeDevice> shapeOf(const Capture& capture, const std::shared_ptr<ComputeDevice>& device) {
  const KernelShape shape = capture.cpuShape ? KernelShape::Cpu : KernelShape::Gpu;
  if (device->shape() == shape) return device;
  return std::make_shared<ComputeDevice>(device->device(), device->description(), shape);
}

size_t launchCount(const Capture& capture) {
  size_t count = 0;
  for (const CapturedCommand& command : capture.commands) count += std::holds_alternative<CapturedLaunch>(command);
  return count;
}

std::string buildOptions() {
  const char* options = std::getenv("BTGPU_BUILD_OPTIONS");
  return options ? options : "";
}

std::string introductionOn(const Capture& capture, const DeviceDescription& device, bool sameDevice) {
  std::string text = introduction(capture);
  if (!sameDevice) text += fmt::format("replayed on another one: {}, driver {}\n", device.name, device.driver);
  if (capture.buildOptions != buildOptions()) {
    text += fmt::format("BTGPU_BUILD_OPTIONS was '{}' and is '{}'\n", capture.buildOptions, buildOptions());
  }
  return text;
}

std::string timesOf(Replay& replay, int runs) {
  std::vector<double> times;
  for (int i = 0; i < runs; ++i) times.push_back(replay.time());
  std::sort(times.begin(), times.end());
  return fmt::format("{} runs: least {:.4f} ms, median {:.4f} ms\n", runs, times.front(), times[times.size() / 2]);
}

}  // namespace

std::string introduction(const Capture& capture) {
  std::string text =
      fmt::format("{} of step {}: {} launches, {} arrays, {} shape\ncaptured by btgpu {} on {}, driver {}\n",
                  capture.stage, capture.step, launchCount(capture), capture.arrays.size(),
                  capture.cpuShape ? "cpu" : "gpu", capture.version, capture.device, capture.driver);
  if (capture.version != BTGPU_VERSION) text += fmt::format("replayed by btgpu {}\n", BTGPU_VERSION);
  return text;
}

std::vector<Bytes> runCapture(const Capture& capture, const std::shared_ptr<ComputeDevice>& device) {
  Replay replay(capture, shapeOf(capture, device));
  replay.run();
  return replay.contents();
}

ReplayReport replayFile(const std::string& file, const ReplayOptions& options) {
  const Capture capture = readCapture(file);
  const auto device = ComputeDevice::open(options.device);
  const DeviceDescription& d = device->description();
  ReplayReport report;
  report.sameDevice = d.name == capture.device && d.driver == capture.driver;
  report.text = introductionOn(capture, d, report.sameDevice);
  Replay replay(capture, shapeOf(capture, device));
  replay.run();
  const std::vector<Bytes> found = replay.contents();
  for (size_t i = 0; i < found.size(); ++i) {
    const ArrayDifference difference = compareArray(capture.arrays[i], found[i]);
    if (difference.different == 0) continue;
    ++report.differentArrays;
    report.text += describe(capture.arrays[i], difference) + "\n";
  }
  if (report.differentArrays == 0) report.text += "identical\n";
  if (options.timedRuns > 0) report.text += timesOf(replay, options.timedRuns);
  return report;
}

}  // namespace btgpu
