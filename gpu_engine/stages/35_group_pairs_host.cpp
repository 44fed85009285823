// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "35_group_pairs_reference.h"

namespace btgpu {
namespace {

class HostGroupPairs : public HostStage {
 public:
  HostGroupPairs() : HostStage("35_group_pairs") {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_expected =
        groupPairsReference(io.read(w.keys, io.pairCount()), io.read(w.oldKeys, io.read(w.oldPairCount, 1).at(0)),
                            io.readBodies(w.infos), io.read(w.shapes), io.readBodies(w.stepActivations),
                            io.readBodies(w.born), io.read(w.listedPairs, w.listedCount), w.onlyListed);
  }
  void store(StageIo& io) override {
    io.write(io.world.pairs, m_expected.pairs);
    io.write(io.world.items, m_expected.items);
    io.write(io.world.bucketFirst, m_expected.bucketFirst);
  }
  void check(StageIo& io, Contract& contract) override {
    const size_t count = m_expected.pairs.size();
    contract.sameArray("pair", io.read(io.world.pairs, count), m_expected.pairs);
    contract.sameArray("item", io.read(io.world.items, count), m_expected.items);
    contract.sameArray("start of bucket", io.read(io.world.bucketFirst, BUCKET_COUNT + 1), m_expected.bucketFirst);
  }

 private:
  GroupedPairs m_expected;
};

}  // namespace

std::unique_ptr<HostStage> hostGroupPairs() { return std::make_unique<HostGroupPairs>(); }

}  // namespace btgpu
