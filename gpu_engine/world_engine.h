// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>

#include "engine.h"
#include "opencl/host_array.h"
#include "opencl/program_cache.h"
#include "pipeline.h"
#include "queries/closest_points.h"
#include "queries/convex_sweeper.h"
#include "queries/ray_caster.h"

namespace btgpu {

// The engine behind the plugin interface: uploads, steps, repeats a step that overflowed, downloads. Throws
// OpenClError; plugin.cpp turns that into a Status.
//
// While substeps are to follow it runs one substep ahead of what it has been asked for, so that the device does not
// wait for the host in between. The substep ahead reads nothing but what the one before it left on the device; it is
// adopted if begin() comes with no change, and else thrown away.
//
// A call of OpenCL that fails may fail but once: the step is then done again, once, from where it began. What the step
// before it left on the device is not touched until a step has succeeded; all else comes from the input anew.
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
  void closestPoints(const QueryWorld& world, const std::vector<ClosestQuery>& queries,
                     std::vector<ClosestAnswer>& answers);
  void castRays(const QueryWorld& world, const Ray* rays, size_t count, RayResults& results);
  void castSweeps(const QueryWorld& world, const Sweep* sweeps, size_t count, SweepResults& results);
  void reset();
  EngineInfo info() const;
  std::vector<StageProfile> takeProfile(ZoneSink* sink);
  // After a step; notes what is known of the times of its launches (Queue::collectTimes).
  void collectTimes(ZoneSink* sink) { m_queue.collectTimes(sink, m_ahead == Ahead::None); }

 private:
  // One step under way, and the host's side of its transfers.
  struct Flight {
    StepSettings settings;
    bool contactsUnseen = false;     // STEP_CONTACTS_UNSEEN
    std::vector<StepParams> params;  // host side of the upload
    HostArray<BodyPose> poses;
    HostArray<BodyVelocity> velocities;
    HostArray<BodyActivation> activations;
    HostArray<uint> roots;
    HostArray<uint> jointSolved;
    HostArray<float> jointImpulses;
    HostArray<StepCounters> counters;
    cl::Event done;  // of the last read
    int launches = 0;
  };
  enum class Ahead {
    None,
    Running,
    Broken,  // launched in part only
  };

  void start(const WorldInput& input, const StepSettings& settings);
  void launchCurrent(const WorldInput& input);
  void conclude(StepResults& results);
  void recover(const OpenClError& error);
  void reserve(const Capacities& wanted);
  void makeRoom(size_t bodyCount);
  void makeRoomFor(Flight& flight);
  void enqueue(Flight& flight, bool ahead);
  bool sendsContacts(const Flight& flight) const;
  void enqueueReads(Flight& flight);
  bool adoptAhead(const WorldInput& input, const StepSettings& settings);
  void throwAheadAway();
  bool mayRunAhead(const WorldInput& input) const;
  void runAhead();
  void takeBackAhead();
  void await(const Flight& flight);
  void showResults(Flight& flight, StepResults& results) const;
  void readContacts(StepResults& results);
  void takeFailures(StepResults& results);
  void growAfterOverflow(const StepCounters& counters);
  void adaptLaunches(const StepCounters& counters);

  EngineSettings m_engineSettings;
  std::shared_ptr<ComputeDevice> m_device;
  Queue m_queue;
  HostStages m_hostStages;
  Pipeline m_pipeline;
  std::unique_ptr<DeviceWorld> m_world;
  // Made by the first query; with a queue of their own, as a step may be under way.
  struct Queries {
    explicit Queries(const std::shared_ptr<ComputeDevice>& device)
        : queue(device, false), rayArrays(*device), sweepArrays(*device) {}
    Queue queue;
    QueryArrays rayArrays, sweepArrays;  // what is the device's differs between them
    std::unique_ptr<RayCaster> rays;     // each made when it is first asked
    std::unique_ptr<ConvexSweeper> sweeps;
    std::unique_ptr<ClosestPoints> closest;
  };
  template <typename Work>
  void query(const Work& work);
  std::unique_ptr<Queries> m_queries;
  WorldTraits m_traits;
  bool m_oldPointsRoll = false;  // some of the manifolds that the host replaced last
  Flight m_flights[2];           // the step that was begun, and the one ahead of it
  int m_current = 0;             // which of them was begun
  Ahead m_ahead = Ahead::None;
  bool m_aheadAllowed = true;           // there is memory for it
  bool m_contactsUnseen = false;        // the contacts of the last finished step were wanted later, and not sent
  uint m_residentGroups;                // that the solver may have; 0 once they could not all run at once
  bool m_prefetched = false;            // the current step was ahead once
  const WorldInput* m_input = nullptr;  // from begin() to finish()
  std::string m_recoveredFrom;          // the error that the current step was done again for
  const std::vector<StepCounters> m_noCounters = std::vector<StepCounters>(1);
  int m_waitsBefore = 0;
  long m_begun = 0;  // steps, since the engine was made
};

// OpenCL's view of a device as the plugin reports it.
EngineInfo describeDevice(const DeviceDescription& description);

}  // namespace btgpu
