// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>

#include "engine.h"
#include "opencl/program_cache.h"
#include "pipeline.h"

namespace btgpu {

// The engine behind the plugin interface: uploads, steps, repeats a step that overflowed, downloads. Throws
// OpenClError; plugin.cpp turns that into a Status.
class WorldEngine {
 public:
  explicit WorldEngine(const EngineSettings& settings);
  // Waits: after a failure part of a step may still run, on this engine's arrays and the caller's.
  ~WorldEngine();
  WorldEngine(const WorldEngine&) = delete;
  WorldEngine& operator=(const WorldEngine&) = delete;

  void begin(const WorldInput& input, const StepSettings& settings);
  void finish(StepResults& results);
  void readManifolds(std::vector<Manifold>& manifolds);
  void reset();
  EngineInfo info() const;
  std::vector<StageProfile> takeProfile();

 private:
  void makeRoom(size_t bodyCount);
  void enqueue();
  void enqueueReads(StepResults& results);
  void readContacts(StepResults& results);
  bool growAfterOverflow(const StepCounters& counters);
  void adaptLaunches(const StepCounters& counters);

  EngineSettings m_engineSettings;
  std::shared_ptr<ComputeDevice> m_device;
  Queue m_queue;
  Pipeline m_pipeline;
  std::unique_ptr<DeviceWorld> m_world;
  WorldTraits m_traits;
  StepSettings m_settings;
  std::vector<StepParams> m_params;  // host side of the upload
  std::vector<StepCounters> m_counters;
  int m_launchesBefore = 0, m_waitsBefore = 0;
};

// OpenCL's view of a device as the plugin reports it.
EngineInfo describeDevice(const DeviceDescription& description);

}  // namespace btgpu
