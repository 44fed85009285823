// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "../zone.h"
#include "cl.h"
#include "compute_device.h"
#include "device_clock.h"
#include "recorder.h"

namespace btgpu {

// Device time and launches of one stage since the profile was last taken.
struct StageTime {
  std::string stage;
  double milliseconds = 0;
  int launches = 0;
};

// The in-order command queue of one world. Counts launches and blocking waits; with profiling on it also times
// every launch by its events, under the name of the stage that is running.
class Queue {
 public:
  Queue(std::shared_ptr<ComputeDevice> device, bool profile);

  ComputeDevice& device() const { return *m_device; }
  const std::shared_ptr<ComputeDevice>& sharedDevice() const { return m_device; }
  const cl::CommandQueue& raw() const { return m_queue; }

  // Names what is launched from here on; `stage` must outlive the profile (a literal).
  void enterStage(const char* stage) {
    m_stage = stage;
    if (m_recorder) m_recorder->enterStage(*this, stage);
    if (!currentZoneSink()) return;
    m_stageZone.reset();
    m_stageZone.emplace(stage);
  }
  // After the last stage of a step.
  void leaveStages() { m_stageZone.reset(); }
  // For recorders: between these two lies the step with this number.
  void enterStep(long step) {
    if (m_recorder) m_recorder->enterStep(*this, step);
  }
  void leaveStep() {
    if (m_recorder) m_recorder->leaveStep(*this);
  }
  void setRecorder(std::unique_ptr<Recorder> recorder) { m_recorder = std::move(recorder); }
  Recorder* recorder() const { return m_recorder.get(); }  // normally null

  void launch(const cl::Kernel& kernel, const std::string& name, Grid grid);
  void write(const cl::Buffer& buffer, size_t offset, size_t bytes, const void* from, bool wait);
  // done: set to the event of the read.
  void read(const cl::Buffer& buffer, size_t offset, size_t bytes, void* to, bool wait, cl::Event* done = nullptr);
  void copy(const cl::Buffer& from, const cl::Buffer& to, size_t fromOffset, size_t toOffset, size_t bytes);
  // For reading, without waiting: the memory may be read once the queue is finished.
  void* map(const cl::Buffer& buffer, size_t bytes);
  void unmap(const cl::Buffer& buffer, void* mapped);
  void finish();
  // Waits for one command and all before it; what was enqueued later goes on.
  void wait(const cl::Event& event);
  void flush();

  int launches() const { return m_launches; }
  int waits() const { return m_waits; }

  // With profiling, notes the times of the launches that have ended, and hands them to `sink` too, which may be null.
  // idle: nothing runs, so that the device's clock may be looked at.
  void collectTimes(ZoneSink* sink, bool idle);
  // Times since the last call, in order of first launch. Waits for the queue. Empty without profiling.
  std::vector<StageTime> takeProfile(ZoneSink* sink);

 private:
  struct Timed {
    const char* stage;
    std::string kernel;
    cl::Event event;
  };
  void note(const Timed& timed, const DeviceSlice& slice);
  std::shared_ptr<ComputeDevice> m_device;
  cl::CommandQueue m_queue;
  bool m_profile;
  const char* m_stage = "";
  std::optional<Zone> m_stageZone;
  std::deque<Timed> m_timed;  // launches whose times are not noted yet
  std::vector<StageTime> m_times;
  DeviceClock m_clock;
  std::unique_ptr<Recorder> m_recorder;
  int m_launches = 0, m_waits = 0;
};

}  // namespace btgpu
