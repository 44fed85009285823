// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The engine's interface as a plugin. compat/ opens the library at run time, so that an application linked with
// btgpu starts without OpenCL. Nothing is thrown across this boundary.
#pragma once

#include <string>
#include <vector>

#include "query_world.h"
#include "step_results.h"
#include "step_settings.h"
#include "world_input.h"
#include "zone.h"

namespace btgpu {

// Changes whenever anything in this header or in the headers it includes changes its layout.
inline constexpr int kEngineAbi = 16;
// Name of the factory in the plugin: EngineFactory.
inline constexpr const char* kEngineEntryPoint = "btgpuCreateEngine";
inline constexpr const char* kListDevicesEntryPoint = "btgpuListDevices";
inline constexpr const char* kReplayEntryPoint = "btgpuReplay";
inline constexpr const char* kPairSearchEntryPoint = "btgpuCreatePairSearch";

enum class Status {
  Ok,
  NoDevice,      // no OpenCL platform or device, or none that matches
  OutOfMemory,   // the device or the host
  DeviceFailed,  // an OpenCL call failed; the device state is lost
  BuildFailed,   // a kernel does not build on this device
  BadInput,      // a file that can't be read or makes no sense
  WrongAbi,      // plugin and caller were built from different versions
  InternalError,
};

struct EngineSettings {
  std::string device;         // index, part of the name, "cpu" or "gpu"; empty: BTGPU_DEVICE, else the first
  bool profile = false;       // time each stage (slows the step)
  bool debugKernels = false;  // kernels that check themselves (slow); so does BTGPU_DEBUG_KERNELS=1
  size_t bodyCapacity = 0, pairCapacity = 0;  // room to start with; grown as needed
  // Numbers or names of stages, "30,70": these run as their references, on the host. Empty: BTGPU_HOST_STAGES.
  std::string hostStages;
  // Each stage of each step is held against its reference (StepResults::differences); slow. Also with
  // BTGPU_CHECK_STAGES=1.
  bool checkStages = false;
};

struct StageProfile {
  std::string stage;
  double milliseconds;
  int launches;
};

struct EngineInfo {
  std::string device, vendor, platform, version, driver, type;  // as OpenCL names them
  std::string kernelShape;                                      // "gpu" or "cpu"
  int index = 0;
  unsigned computeUnits = 0;
  unsigned long globalMemory = 0, largestAllocation = 0;  // bytes
  unsigned long worldMemory = 0;  // bytes of the world's arrays on the device; the stages' scratch memory is not in it
  int programsBuilt = 0, programsLoaded = 0, programsRejected = 0;
  double buildSeconds = 0;
};

// One world's simulation on one device. Not thread-safe; different engines may be used by different threads.
class Engine {
 public:
  virtual ~Engine() = default;

  // Takes over what changed in `input` and starts the step; returns while the device works. `input` must stay as
  // it is until finishStep returns. If a call of OpenCL fails, here or in finishStep, the step is done again once. With
  // StepSettings::substepsToFollow the device goes on with the next substep; that is thrown away if the next beginStep
  // comes with changes or with other settings.
  virtual Status beginStep(const WorldInput& input, const StepSettings& settings) noexcept = 0;
  // Waits for the step that was begun and brings the results.
  virtual Status finishStep(StepResults& results) noexcept = 0;

  // The manifolds after the last finished step, in pair order, those without points included.
  // A and B as in WorldInput::manifolds: slots of shapes, where they are compounds'.
  virtual Status readManifolds(std::vector<Manifold>& manifolds) noexcept = 0;

  // Casts rays through `world`, which need have nothing to do with the last step's; may be called during a step. Waits.
  virtual Status castRays(const QueryWorld& world, const Ray* rays, size_t count, RayResults& results) noexcept = 0;

  // Sweeps of shapes that `world` has; likewise.
  virtual Status castSweeps(const QueryWorld& world, const Sweep* sweeps, size_t count,
                            SweepResults& results) noexcept = 0;

  // Closest points of pairs of the shapes in `world`; likewise.
  virtual Status closestPoints(const QueryWorld& world, const std::vector<ClosestQuery>& queries,
                               std::vector<ClosestAnswer>& answers) noexcept = 0;

  // Drops all device state; the next beginStep must come with everything in its change lists.
  virtual void reset() noexcept = 0;

  virtual EngineInfo info() const noexcept = 0;
  virtual std::vector<StageProfile> takeProfile() noexcept = 0;
  // Where the zones of the calls that follow go, and the times of the launches, if the engine was made with profile;
  // null: nowhere. It has to live until there is another one, or as long as the engine.
  virtual void setZoneSink(ZoneSink* sink) noexcept = 0;
  // One line about the last status that was not Ok.
  virtual std::string lastError() const noexcept = 0;
};

// Creates an engine; on failure returns null, sets *status and writes one line into error[0, errorSize).
using EngineFactory = Engine* (*)(int abi, const EngineSettings* settings, Status* status, char* error,
                                  size_t errorSize);
// All devices in the order of their indices.
using DeviceLister = Status (*)(int abi, std::vector<EngineInfo>* devices);

// What came of a captured stage that was run again (docs/capture.md).
struct ReplayReport {
  bool sameDevice = false;  // as the one that it was captured on, driver included
  int differentArrays = 0;  // of a reference: 1 if what was captured is not within its contract
  std::string text;         // for people; whole lines
};
struct ReplayOptions {
  std::string device;   // as in EngineSettings
  bool onHost = false;  // the stage's reference instead; needs no device
  int timedRuns = 0;    // so many more on the device, each from the same arrays, whose times go into the text
};
// Runs the capture in `file`. What is not Ok says why in one line.
using Replayer = Status (*)(int abi, const std::string* file, const ReplayOptions* options, ReplayReport* report,
                            std::string* error);

// Stage 30 by itself (`btgpu bench --scene pairs`).
struct PairSearchTimes {
  double milliseconds = 0;  // on the host's clock, from the first launch to the end of the last
  unsigned pairCount = 0;
  bool repeated = false;  // there was too little room at first; only the last time counts
};
class PairSearch {
 public:
  virtual ~PairSearch() = default;
  // As many of both: flags and filters, and AABBs.
  virtual Status setBodies(const std::vector<BodyInfo>& infos, const std::vector<Aabb>& aabbs) noexcept = 0;
  virtual Status find(PairSearchTimes& times) noexcept = 0;
  // Of the last find().
  virtual Status readKeys(std::vector<ulong>& keys) noexcept = 0;
  virtual std::string lastError() const noexcept = 0;
};
// device: as in EngineSettings. What is not Ok says why in one line.
using PairSearchFactory = Status (*)(int abi, const std::string* device, PairFinder finder, PairSearch** search,
                                     std::string* error);

}  // namespace btgpu
