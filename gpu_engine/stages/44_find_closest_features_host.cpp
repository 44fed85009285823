// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "44_find_closest_features_reference.h"
#include "host_pairs.h"

namespace btgpu {
namespace {

class HostFindClosestFeatures : public HostStage {
 public:
  HostFindClosestFeatures() : HostStage("44_find_closest_features", pairArrayNames()) {}

  void compute(StageIo& io) override {
    m_in = readPairArrays(io);
    m_before = io.read(io.world.contacts, m_in.pairs.size());
  }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    std::vector<RawContacts> contacts = m_before;
    ClosestPairs found = findClosestFeaturesReference(m_in, contacts);
    io.write(w.nearCount, {static_cast<uint>(found.near.size())});
    // As long as the device's: kernels take the lengths for granted.
    found.closest.resize(w.capacities.pairs);
    found.near.resize(w.capacities.pairs);
    io.write(w.closest, found.closest);
    io.write(w.nearPairs, found.near);
    io.write(w.contacts, contacts);
  }
  void check(StageIo& io, Contract& contract) override {
    DeviceWorld& w = io.world;
    const size_t count = m_in.bucketFirst[BUCKET_LAST_CONVEX + 1] - m_in.bucketFirst[BUCKET_FIRST_CONVEX];
    checkClosestFeatures(contract, m_in,
                         {io.read(w.closest, count), io.read(w.nearPairs, io.read(w.nearCount, 1).at(0))}, m_before,
                         io.read(w.contacts, m_in.pairs.size()));
  }

 private:
  PairArrays m_in;
  std::vector<RawContacts> m_before;
};

}  // namespace

std::unique_ptr<HostStage> hostFindClosestFeatures() { return std::make_unique<HostFindClosestFeatures>(); }

}  // namespace btgpu
