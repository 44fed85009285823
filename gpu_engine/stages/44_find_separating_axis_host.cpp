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
    std::vector<SeparatingAxis> found = findSeparatingAxesReference(m_in, contacts);
    found.resize(w.capacities.pairs);  // as long as the device's: kernels take the lengths for granted
    io.write(w.axes, found);
    io.write(w.contacts, contacts);
  }
  void check(StageIo& io, Contract& contract) override {
    DeviceWorld& w = io.world;
    const size_t count = m_in.bucketFirst[BUCKET_BOX_BOX + 1] - m_in.bucketFirst[BUCKET_BOX_BOX];
    checkSeparatingAxes(contract, m_in, io.read(w.axes, count), m_before, io.read(w.contacts, m_in.pairs.size()));
  }

 private:
  PairArrays m_in;
  std::vector<RawContacts> m_before;
};

}  // namespace

std::unique_ptr<HostStage> hostFindSeparatingAxis() { return std::make_unique<HostFindSeparatingAxis>(); }

}  // namespace btgpu
