// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <functional>
#include <map>
#include <optional>

#include "../opencl/recorder.h"
#include "capture.h"
#include "capture_request.h"

namespace btgpu {

// Captures stages: reads every array before the stage's first command that touches it, and once more at the stage's
// end. Changes nothing that the engine can see; the queue's counts of launches and waits stay as they are.
class CaptureRecorder : public Recorder {
 public:
  // done: called at the end of each captured stage.
  CaptureRecorder(std::vector<CaptureRequest> requests, std::function<void(const Capture&)> done);
  // Tells on stderr which requests of single steps found nothing in a world that made steps.
  ~CaptureRecorder() override;

  void enterStep(Queue& queue, long step) override;
  void leaveStep(Queue& queue) override;
  void enterStage(Queue& queue, const char* stage) override;
  void beforeStage(Queue& queue, const char* stage, const std::function<StageInputs()>& inputs) override;
  void afterStage(Queue& queue, const std::function<std::vector<ArrayInUse>()>& arrays) override;
  void beforeLaunch(Queue& queue, const Launch& launch) override;
  void beforeWrite(Queue& queue, const cl::Buffer& to, size_t offset, size_t bytes, const void* from) override;
  void beforeCopy(Queue& queue, const cl::Buffer& from, const cl::Buffer& to, size_t fromOffset, size_t toOffset,
                  size_t bytes) override;

 private:
  // A stage that is being captured. Memory is told apart by its handle, which can't come again while m_buffers hold it,
  // so that it does not matter which array it belongs to at the time.
  struct Open {
    Capture capture;
    std::vector<cl::Buffer> buffers;  // one an array
    std::map<cl_mem, std::uint32_t> indices;
    std::vector<ArrayInUse> arrays;  // of the world, before the stage; empty outside of the pipeline
  };

  bool wanted(const char* stage);
  void open(Queue& queue, const char* stage);
  void close(Queue& queue);
  std::uint32_t touch(Queue& queue, const cl::Buffer& buffer);
  std::uint32_t touch(Queue& queue, const Argument& array);
  CapturedArgument captured(Queue& queue, const Argument& argument);

  std::vector<CaptureRequest> m_requests;
  std::vector<bool> m_met;
  std::function<void(const Capture&)> m_done;
  std::optional<long> m_step;
  bool m_stepped = false;
  std::optional<Open> m_open;
};

// A recorder that writes files: at `path` if it names a file, in it if it is a folder; if it is empty, in the current
// one. Tells on stderr what it wrote.
std::unique_ptr<Recorder> makeCaptureRecorder(const std::string& requests, const std::string& path);

}  // namespace btgpu
