// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A stage on the host: its reference between the world's arrays on the device. It can take the place of the stage, or
// tell whether what the stage did is within its contract.
#pragma once

#include <memory>
#include <vector>

#include "device_world.h"
#include "stages/contract.h"

namespace btgpu {

// What a stage on the host sees of the running step. Every read and write waits.
class StageIo {
 public:
  StageIo(Queue& queue, DeviceWorld& ofWorld, const StepSettings& ofStep)
      : world(ofWorld), settings(ofStep), m_queue(queue) {}

  DeviceWorld& world;
  const StepSettings& settings;

  template <typename T>
  std::vector<T> read(const DeviceArray<T>& array, size_t count) {
    std::vector<T> host(std::min(count, array.size()));
    m_queue.read(array.buffer(), 0, host.size() * sizeof(T), host.data(), true);
    return host;
  }
  template <typename T>
  std::vector<T> read(const DeviceArray<T>& array) {
    return read(array, array.size());
  }
  // One entry a body.
  template <typename T>
  std::vector<T> readBodies(const DeviceArray<T>& array) {
    return read(array, world.bodyCount);
  }
  // Overwrites the first elements; those behind stay as they are.
  template <typename T>
  void write(DeviceArray<T>& array, const std::vector<T>& values) {
    if (values.size() > array.size()) array.resize(m_queue, values.size());
    m_queue.write(array.buffer(), 0, values.size() * sizeof(T), values.data(), true);
  }

  StepParams params() { return read(world.params, 1).at(0); }
  StepCounters counters() { return read(world.counters, 1).at(0); }
  void setCounters(const StepCounters& counters) { write(world.counters, std::vector<StepCounters>{counters}); }
  // Pairs of this step that there was room for.
  size_t pairCount() { return std::min<size_t>(counters().pairCount, world.capacities.pairs); }
  // Manifolds of the pairs, and those of the host once stage 50 has run.
  size_t manifoldCount() { return pairCount() + world.hostManifoldCount; }

 private:
  Queue& m_queue;
};

class HostStage {
 public:
  explicit HostStage(const char* name) : m_name(name) {}
  virtual ~HostStage() = default;
  const char* name() const { return m_name; }  // as the profile has it, "10_apply_forces"

  // Before the stage: reads what it reads, and finds what the reference makes of that.
  virtual void compute(StageIo& io) = 0;
  // In the stage's place: writes what it would have written.
  virtual void store(StageIo& io) = 0;
  // After the stage: holds what it wrote against the reference.
  virtual void check(StageIo& io, Contract& contract) = 0;

 private:
  const char* m_name;
};

// Each lives in stages/NN_stem_host.cpp.
std::unique_ptr<HostStage> hostApplyForces();
std::unique_ptr<HostStage> hostUpdateAabbs();
std::unique_ptr<HostStage> hostFindPairs();
std::unique_ptr<HostStage> hostGroupPairs();
std::unique_ptr<HostStage> hostCollidePrimitives();
std::unique_ptr<HostStage> hostFindSeparatingAxis();
std::unique_ptr<HostStage> hostClipFaces();
std::unique_ptr<HostStage> hostFindClosestFeatures();
std::unique_ptr<HostStage> hostClipConvexFaces();
std::unique_ptr<HostStage> hostReduceAndMatchContacts();
std::unique_ptr<HostStage> hostAppendHostContacts();
std::unique_ptr<HostStage> hostPrepareJoints();
std::unique_ptr<HostStage> hostBuildIslands();
std::unique_ptr<HostStage> hostColourConstraints();
std::unique_ptr<HostStage> hostPrepareContacts();
std::unique_ptr<HostStage> hostSolveVelocities();
std::unique_ptr<HostStage> hostIntegratePoses();
std::unique_ptr<HostStage> hostUpdateActivation();
std::unique_ptr<HostStage> hostGatherContacts();

// Which stages run on the host, and whether the others are held against it.
class HostStages {
 public:
  // `onHost`: numbers or names, separated by commas. Throws std::invalid_argument if there is no such stage.
  HostStages(const std::string& onHost, bool check);
  bool any() const { return m_check || !m_onHost.empty(); }

  // Runs the stage of that name on the device by `enqueue`, or on the host, or both.
  template <typename Enqueue>
  void run(const char* name, StageIo& io, const Enqueue& enqueue) {
    HostStage* stage = begin(name, io);
    if (!stage || !isOnHost(*stage)) enqueue();
    if (stage) end(*stage, io);
  }

  // Of the step so far. Cleared.
  std::vector<StageDifference> takeDifferences() { return std::exchange(m_differences, {}); }

 private:
  HostStage* begin(const char* name, StageIo& io);
  void end(HostStage& stage, StageIo& io);
  bool isOnHost(const HostStage& stage) const;

  std::vector<std::unique_ptr<HostStage>> m_stages;
  std::vector<const HostStage*> m_onHost;
  bool m_check;
  std::vector<StageDifference> m_differences;
};

}  // namespace btgpu
