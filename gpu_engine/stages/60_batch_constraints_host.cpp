// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../../kernels/lib/batches.h"
#include "../host_stage.h"
#include "60_batch_constraints.h"
#include "60_batch_constraints_reference.h"

namespace btgpu {
namespace {

class HostBatchConstraints : public HostStage {
 public:
  HostBatchConstraints() : HostStage("60_batch_constraints") {}

  void compute(StageIo& io) override {
    const DeviceWorld& w = io.world;
    m_constraints = io.read(w.constraints, io.counters().constraintCount);
    m_manifolds = io.read(w.manifolds, io.manifoldCount());
    m_steps = io.readBodies(w.steps);
    m_poses = io.readBodies(w.poses);
  }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    computeFor(splitForGroups(io.settings.groupSplit, w.bodyCount));
    StepCounters counters = io.counters();
    counters.colourCount = counters.largeColours = m_expected.batchCount;
    counters.serialCount = m_expected.serialCount;
    counters.slotCount = static_cast<uint>(m_expected.slots.size());
    io.write(w.batches.split, m_split);
    io.write(w.batches.groupBatches, m_expected.groupBatches);
    io.write(w.batches.batchFirst, m_expected.batchFirst);
    io.write(w.slotFirst, slotFirst());
    if (m_expected.slots.size() > w.capacities.slots) {
      counters.overflow |= OVERFLOW_SLOTS;
    } else {
      io.write(w.slots, m_expected.slots);
    }
    io.setCounters(counters);
  }
  void check(StageIo& io, Contract& contract) override {
    DeviceWorld& w = io.world;
    // As the stage left it: a capture does not say which split was wanted.
    const std::vector<uint> split = io.read(w.batches.split, BATCH_SPLIT_SIZE);
    contract.require(split == splitForGroups(GroupSplit::Space, w.bodyCount) ||
                         split == splitForGroups(GroupSplit::Index, w.bodyCount),
                     "a split for so many bodies");
    if (!contract.ok()) return;
    computeFor(split);
    const StepCounters counters = io.counters();
    contract.same("batches", counters.colourCount, m_expected.batchCount);
    contract.same("constraints in the serial batch", counters.serialCount, m_expected.serialCount);
    contract.same("slots", counters.slotCount, static_cast<double>(m_expected.slots.size()));
    contract.sameArray("batches of group", io.read(w.batches.groupBatches, m_expected.groupBatches.size()),
                       m_expected.groupBatches);
    contract.sameArray("start of batch", io.read(w.batches.batchFirst, m_expected.batchFirst.size()),
                       m_expected.batchFirst);
    contract.sameArray("slot table", io.read(w.slotFirst, COLOUR_TABLE), slotFirst());
    if (!counters.overflow) contract.sameArray("slot", io.read(w.slots, counters.slotCount), m_expected.slots);
  }

 private:
  void computeFor(const std::vector<uint>& split) {
    m_split = split;
    m_expected = batchConstraintsReference(split, m_constraints, m_manifolds, m_steps, m_poses);
  }
  // Where the serial batch is.
  std::vector<uint> slotFirst() const {
    std::vector<uint> first(COLOUR_TABLE, m_expected.serialFirst);
    first[0] = 0;
    first[COLOUR_SERIAL + 1] = m_expected.end;
    return first;
  }

  std::vector<uint> m_constraints, m_split;
  std::vector<Manifold> m_manifolds;
  std::vector<BodyStep> m_steps;
  std::vector<BodyPose> m_poses;
  BatchesReference m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostBatchConstraints() { return std::make_unique<HostBatchConstraints>(); }

}  // namespace btgpu
