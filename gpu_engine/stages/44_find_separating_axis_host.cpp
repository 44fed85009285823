// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "44_find_separating_axis_reference.h"
#include "host_pairs.h"

namespace btgpu {
namespace {

class HostFindSeparatingAxis : public HostStage {
 public:
  HostFindSeparatingAxis() : HostStage("44_find_separating_axis", pairArrayNames()) {}

  void compute(StageIo& io) override {
    m_in = readPairArrays(io);
    m_before = io.read(io.world.contacts, m_in.pairs.size());
  }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    std::vector<RawContacts> contacts = m_before;
    SeparatingAxes found = findSeparatingAxesReference(m_in, contacts);
    io.write(w.overlapCount, {static_cast<uint>(found.overlapping.size())});
    // As long as the device's: kernels take the lengths for granted.
    found.axes.resize(w.capacities.pairs);
    found.overlapping.resize(w.capacities.pairs);
    io.write(w.axes, found.axes);
    io.write(w.overlapping, found.overlapping);
    io.write(w.contacts, contacts);
  }
  void check(StageIo& io, Contract& contract) override {
    DeviceWorld& w = io.world;
    const size_t count = m_in.bucketFirst[BUCKET_BOX_BOX + 1] - m_in.bucketFirst[BUCKET_BOX_BOX];
    checkSeparatingAxes(contract, m_in,
                        {io.read(w.axes, count), io.read(w.overlapping, io.read(w.overlapCount, 1).at(0))}, m_before,
                        io.read(w.contacts, m_in.pairs.size()));
  }

 private:
  PairArrays m_in;
  std::vector<RawContacts> m_before;
};

}  // namespace

std::unique_ptr<HostStage> hostFindSeparatingAxis() { return std::make_unique<HostFindSeparatingAxis>(); }

}  // namespace btgpu
