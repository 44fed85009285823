// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "recorders.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdlib>
#include <vector>

#include "../opencl/error.h"
#include "capture_recorder.h"
#include "hang_watch.h"
#include "kernel_checks.h"
#include "stage_hashes.h"

namespace btgpu {
namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

// Several at once. The last one lies next to the kernels: what those before it read counts as time between two kernels.
class Several : public Recorder {
 public:
  void add(std::unique_ptr<Recorder> recorder) { m_all.push_back(std::move(recorder)); }
  size_t size() const { return m_all.size(); }
  std::unique_ptr<Recorder> takeLast() { return std::move(m_all.back()); }

  void enterStep(Queue& queue, long step) override {
    for (const auto& r : m_all) r->enterStep(queue, step);
  }
  void leaveStep(Queue& queue) override {
    for (const auto& r : m_all) r->leaveStep(queue);
  }
  void enterStage(Queue& queue, const char* stage) override {
    for (const auto& r : m_all) r->enterStage(queue, stage);
  }
  void beforeStage(Queue& queue, const char* stage, const std::function<StageInputs()>& inputs) override {
    for (const auto& r : m_all) r->beforeStage(queue, stage, inputs);
  }
  void afterStage(Queue& queue, const std::function<std::vector<ArrayInUse>()>& arrays) override {
    for (const auto& r : m_all) r->afterStage(queue, arrays);
  }
  void afterAllocation(Queue& queue, const cl::Buffer& buffer, size_t bytes, const std::string& array) override {
    for (const auto& r : m_all) r->afterAllocation(queue, buffer, bytes, array);
  }
  void beforeLaunch(Queue& queue, const Launch& launch) override {
    for (const auto& r : m_all) r->beforeLaunch(queue, launch);
  }
  void afterLaunch(Queue& queue) override {
    for (auto r = m_all.rbegin(); r != m_all.rend(); ++r) (*r)->afterLaunch(queue);
  }
  void beforeWrite(Queue& queue, const cl::Buffer& to, size_t offset, size_t bytes, const void* from) override {
    for (const auto& r : m_all) r->beforeWrite(queue, to, offset, bytes, from);
  }
  void beforeCopy(Queue& queue, const cl::Buffer& from, const cl::Buffer& to, size_t fromOffset, size_t toOffset,
                  size_t bytes) override {
    for (const auto& r : m_all) r->beforeCopy(queue, from, to, fromOffset, toOffset, bytes);
  }
  // Only the first one checks anything.
  const cl::Buffer* checks() const override { return m_all.front()->checks(); }
  Failures takeFailures(Queue& queue) override { return m_all.front()->takeFailures(queue); }

 private:
  std::vector<std::unique_ptr<Recorder>> m_all;
};

long stepToHash() {
  const std::string text = environment("BTGPU_STAGE_HASHES_STEP");
  if (text.empty()) return CaptureRequest::kEveryStep;
  char* end = nullptr;
  errno = 0;
  const long step = std::strtol(text.c_str(), &end, 10);
  if (*end == '\0' && errno == 0 && step >= 0) return step;
  throw OpenClError(OpenClError::Kind::General,
                    fmt::format("BTGPU_STAGE_HASHES_STEP={} is no step: a number from 0 is", text));
}

}  // namespace

std::unique_ptr<Recorder> recorderFromEnvironment(const ComputeDevice& device) {
  const std::string requests = environment("BTGPU_CAPTURE"), limit = environment("BTGPU_WATCH");
  const std::string hashes = environment("BTGPU_STAGE_HASHES");
  auto all = std::make_unique<Several>();
  if (device.debugKernels()) all->add(std::make_unique<KernelChecks>(device));
  if (!hashes.empty()) all->add(std::make_unique<StageHashes>(hashes, stepToHash()));
  if (!requests.empty()) all->add(makeCaptureRecorder(requests, environment("BTGPU_CAPTURE_FILE")));
  if (!limit.empty() && limit != "0") all->add(makeHangWatch(limit, environment("BTGPU_WATCH_FILE"), device));
  if (all->size() == 0) return nullptr;
  if (all->size() == 1) return all->takeLast();
  return all;
}

}  // namespace btgpu
