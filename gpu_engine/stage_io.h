// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What a stage on the host sees of a step: the world's arrays, on the device while the step runs, or in a capture.
#pragma once

#include <vector>

#include "device_world.h"
#include "step_settings.h"

namespace btgpu {

class StageIo {
 public:
  StageIo(DeviceWorld& ofWorld, const StepSettings& ofStep) : world(ofWorld), settings(ofStep) {}
  virtual ~StageIo() = default;

  DeviceWorld& world;
  const StepSettings& settings;

  template <typename T>
  std::vector<T> read(const DeviceArray<T>& array, size_t count) {
    const ArrayInUse use{array.buffer(), array.name(), array.sizeBytes()};
    std::vector<T> host(std::min(count, bytesInUse(use) / sizeof(T)));
    if (!host.empty()) readBytes(use, host.size() * sizeof(T), host.data());
    return host;
  }
  template <typename T>
  std::vector<T> read(const DeviceArray<T>& array) {
    return read(array, SIZE_MAX);
  }
  // One entry a body.
  template <typename T>
  std::vector<T> readBodies(const DeviceArray<T>& array) {
    return read(array, world.bodyCount);
  }
  // Overwrites the first elements; those behind stay as they are.
  template <typename T>
  void write(DeviceArray<T>& array, const std::vector<T>& values) {
    if (values.size() > array.size()) array.resize(queue(), values.size());
    queue().write(array.buffer(), 0, values.size() * sizeof(T), values.data(), true);
  }

  StepParams params() { return read(world.params, 1).at(0); }
  StepCounters counters() { return read(world.counters, 1).at(0); }
  void setCounters(const StepCounters& counters) { write(world.counters, std::vector<StepCounters>{counters}); }
  // Pairs of this step that there was room for.
  size_t pairCount() { return std::min<size_t>(counters().pairCount, world.capacities.pairs); }
  // Manifolds of the pairs, and those of the host once stage 50 has run.
  size_t manifoldCount() { return pairCount() + world.hostManifoldCount; }

 protected:
  virtual size_t bytesInUse(const ArrayInUse& array) = 0;
  virtual void readBytes(const ArrayInUse& array, size_t bytes, void* to) = 0;
  virtual Queue& queue() = 0;  // for what is written
};

// In the running step. Every read and write waits.
class DeviceStageIo : public StageIo {
 public:
  DeviceStageIo(Queue& queue, DeviceWorld& ofWorld, const StepSettings& ofStep)
      : StageIo(ofWorld, ofStep), m_queue(queue) {}

 protected:
  size_t bytesInUse(const ArrayInUse& array) override { return array.bytes; }
  void readBytes(const ArrayInUse& array, size_t bytes, void* to) override {
    m_queue.read(array.buffer, 0, bytes, to, true);
  }
  Queue& queue() override { return m_queue; }

 private:
  Queue& m_queue;
};

}  // namespace btgpu
