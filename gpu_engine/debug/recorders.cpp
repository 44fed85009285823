// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "recorders.h"

#include <cstdlib>

#include "capture_recorder.h"
#include "hang_watch.h"

namespace btgpu {
namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

// A capture inside a watch: what the capture reads counts as time between two kernels.
class Both : public Recorder {
 public:
  Both(std::unique_ptr<Recorder> outer, std::unique_ptr<Recorder> inner)
      : m_outer(std::move(outer)), m_inner(std::move(inner)) {}

  void enterStep(Queue& queue, long step) override {
    m_outer->enterStep(queue, step);
    m_inner->enterStep(queue, step);
  }
  void leaveStep(Queue& queue) override {
    m_inner->leaveStep(queue);
    m_outer->leaveStep(queue);
  }
  void enterStage(Queue& queue, const char* stage) override {
    m_inner->enterStage(queue, stage);
    m_outer->enterStage(queue, stage);
  }
  void beforeLaunch(Queue& queue, const Launch& launch) override {
    m_inner->beforeLaunch(queue, launch);
    m_outer->beforeLaunch(queue, launch);
  }
  void afterLaunch(Queue& queue) override {
    m_outer->afterLaunch(queue);
    m_inner->afterLaunch(queue);
  }
  void beforeWrite(Queue& queue, const cl::Buffer& to, size_t offset, size_t bytes, const void* from) override {
    m_inner->beforeWrite(queue, to, offset, bytes, from);
  }
  void beforeCopy(Queue& queue, const cl::Buffer& from, const cl::Buffer& to, size_t fromOffset, size_t toOffset,
                  size_t bytes) override {
    m_inner->beforeCopy(queue, from, to, fromOffset, toOffset, bytes);
  }

 private:
  std::unique_ptr<Recorder> m_outer, m_inner;
};

}  // namespace

std::unique_ptr<Recorder> recorderFromEnvironment(const ComputeDevice& device) {
  const std::string requests = environment("BTGPU_CAPTURE"), limit = environment("BTGPU_WATCH");
  std::unique_ptr<Recorder> capture, watch;
  if (!requests.empty()) capture = makeCaptureRecorder(requests, environment("BTGPU_CAPTURE_FILE"));
  if (!limit.empty() && limit != "0") watch = makeHangWatch(limit, environment("BTGPU_WATCH_FILE"), device);
  if (capture && watch) return std::make_unique<Both>(std::move(watch), std::move(capture));
  return capture ? std::move(capture) : std::move(watch);
}

}  // namespace btgpu
