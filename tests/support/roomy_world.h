// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A world on the device whose room is fixed by the test: a step that overflows is not repeated but shown as
// it is.
#pragma once

#include "gpu_engine/pipeline.h"
#include "gpu_engine/step_results.h"
#include "same_bits.h"
#include "tests/support/stage_bench.h"

namespace btgpu {

class RoomyWorld {
 public:
  RoomyWorld(Queue& queue, const Capacities& room)
      : m_queue(queue), m_room(room), m_pipeline(queue.device(), m_noHostStages) {}

  // One step, as WorldEngine does it up to the point where it would look for an overflow.
  StepResults step(const WorldInput& input, const StepSettings& settings) {
    const WorldTraits traits = traitsOf(input);
    m_world.reserve(m_queue, m_room, settings.twoFrictionDirections, traits.torsionRows);
    m_world.upload(m_queue, input);
    m_queue.finish();
    m_before = state();
    m_world.params.copyFromHost(m_queue, {makeStepParams(settings, traits.torsionRows)});
    m_world.counters.copyFromHost(m_queue, {StepCounters{}});
    m_pipeline.enqueueStep(m_queue, m_world, settings, traits);

    StepResults results;
    results.counters = m_world.counters.toVector(m_queue).front();
    m_after = state();
    results.poses = m_after.poses;
    results.velocities = m_after.velocities;
    results.activations = m_after.activations;
    if (results.counters.overflow) return results;
    results.manifolds = m_world.manifolds.toVector(m_queue);
    results.manifolds.resize(results.counters.pairCount);
    m_world.swapStepResults();
    return results;
  }

  // Whether the last step left everything that a repetition starts from as it was.
  bool untouched() const {
    return same(m_before.poses, m_after.poses) && same(m_before.velocities, m_after.velocities) &&
           same(m_before.activations, m_after.activations) && same(m_before.infos, m_after.infos) &&
           same(m_before.oldAabbs, m_after.oldAabbs) && same(m_before.oldKeys, m_after.oldKeys) &&
           same(m_before.oldManifolds, m_after.oldManifolds) && same(m_before.oldPairCount, m_after.oldPairCount);
  }

 private:
  struct State {
    std::vector<BodyPose> poses;
    std::vector<BodyVelocity> velocities;
    std::vector<BodyActivation> activations;
    std::vector<BodyInfo> infos;
    std::vector<Aabb> oldAabbs;
    std::vector<ulong> oldKeys;
    std::vector<uint> oldPairCount;
    std::vector<Manifold> oldManifolds;
  };

  State state() {
    State s{m_world.poses.toVector(m_queue),        m_world.velocities.toVector(m_queue),
            m_world.activations.toVector(m_queue),  m_world.infos.toVector(m_queue),
            m_world.oldAabbs.toVector(m_queue),     m_world.oldKeys.toVector(m_queue),
            m_world.oldPairCount.toVector(m_queue), m_world.oldManifolds.toVector(m_queue)};
    return s;
  }

  Queue& m_queue;
  Capacities m_room;
  HostStages m_noHostStages{"", false};
  Pipeline m_pipeline;
  DeviceWorld m_world;
  State m_before, m_after;
};

}  // namespace btgpu
