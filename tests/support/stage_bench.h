// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Runs single stages on a world of a test. Typical use, in a DeviceTest:
//   StageBench bench(queue(), builder.finish());
//   bench.run<ApplyForces>();
//   const auto steps = bench.read(bench.world().steps, bench.world().bodyCount);
// The test's queue must outlive the bench.
#pragma once

#include <stdexcept>
#include <type_traits>

#include "gpu_engine/device_world.h"
#include "gpu_engine/opencl/queue.h"
#include "gpu_engine/step_params.h"

namespace btgpu {

class StageBench {
 public:
  // Uploads the world and sets params and counters as WorldEngine does before a step. Fields of `wanted` that
  // are zero get room enough for small tests: 8 pairs a body, at least 64, and slots for all of them.
  StageBench(Queue& queue, const WorldInput& input, const StepSettings& settings = {}, Capacities wanted = {});

  Queue& queue() { return m_queue; }
  DeviceWorld& world() { return m_world; }

  // Makes the stage and runs it to the end; `args` are what Stage::enqueue takes after queue and world.
  template <typename Stage, typename... Args>
  void run(const Args&... args) {
    if constexpr (std::is_constructible_v<Stage, ComputeDevice&>) {
      Stage stage(m_queue.device());
      runStage(stage, args...);
    } else {
      Stage stage;
      runStage(stage, args...);
    }
  }
  // The same with a stage that lives on, for what it keeps between runs.
  template <typename Stage, typename... Args>
  void runStage(Stage& stage, const Args&... args) {
    stage.enqueue(m_queue, m_world, args...);
    m_queue.finish();
  }

  // The first `count` elements of an array, or all of them.
  template <typename T>
  std::vector<T> read(const DeviceArray<T>& array, size_t count) {
    if (count > array.size()) throw std::out_of_range("StageBench::read: " + array.name());
    std::vector<T> host(count);
    m_queue.read(array.buffer(), 0, count * sizeof(T), host.data(), true);
    return host;
  }
  template <typename T>
  std::vector<T> read(const DeviceArray<T>& array) {
    return read(array, array.size());
  }
  // Overwrites the first elements. The array grows if needed and never shrinks, since stages take sizes as
  // capacities.
  template <typename T>
  void write(DeviceArray<T>& array, const std::vector<T>& values) {
    if (values.size() > array.size()) array.resize(m_queue, values.size());
    m_queue.write(array.buffer(), 0, values.size() * sizeof(T), values.data(), true);
  }
  // Fills the whole array with the byte kPoison.
  template <typename T>
  void poison(DeviceArray<T>& array) {
    const std::vector<unsigned char> bytes(array.size() * sizeof(T), kPoison);
    m_queue.write(array.buffer(), 0, bytes.size(), bytes.data(), true);
  }
  static constexpr unsigned char kPoison = 0xcd;
  // True if all bytes of `value` are still poison.
  template <typename T>
  static bool isPoison(const T& value) {
    unsigned char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    for (const unsigned char b : bytes) {
      if (b != kPoison) return false;
    }
    return true;
  }

  StepParams params();
  void setParams(const StepParams& params);
  StepCounters counters();
  void setCounters(const StepCounters& counters);
  void setOverflow(uint overflow);

  // Puts the pairs on the device as stages 30 and 35 would have left them: pairs, items and bucketFirst by
  // Pair::bucket, keys, and both pair counters.
  void setPairs(const std::vector<Pair>& pairs);
  // Manifolds of this step, as stage 48 leaves them (one a pair, in pair order), or of the last one with
  // their keys.
  void setManifolds(const std::vector<Manifold>& manifolds) { write(m_world.manifolds, manifolds); }
  void setOldManifolds(const std::vector<Manifold>& manifolds);

 private:
  Queue& m_queue;
  DeviceWorld m_world;
};

// Bit for bit.
template <typename T>
bool sameBits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

}  // namespace btgpu
