// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "46_clip_convex_faces_reference.h"
#include "host_pairs.h"

namespace btgpu {
namespace {

class HostClipConvexFaces : public HostStage {
 public:
  HostClipConvexFaces() : HostStage("46_clip_convex_faces", pairArrayNames()) {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_in = readPairArrays(io);
    m_found.closest =
        io.read(w.closest, m_in.bucketFirst[BUCKET_LAST_CONVEX + 1] - m_in.bucketFirst[BUCKET_FIRST_CONVEX]);
    m_found.near = io.read(w.nearPairs, io.read(w.nearCount, 1).at(0));
    m_before = io.read(w.contacts, m_in.pairs.size());
  }
  void store(StageIo& io) override {
    std::vector<RawContacts> contacts = m_before;
    clipConvexFacesReference(m_in, m_found, contacts);
    io.write(io.world.contacts, contacts);
  }
  void check(StageIo& io, Contract& contract) override {
    checkClippedConvexFaces(contract, m_in, m_found, m_before, io.read(io.world.contacts, m_in.pairs.size()));
  }

 private:
  PairArrays m_in;
  ClosestPairs m_found;
  std::vector<RawContacts> m_before;
};

}  // namespace

std::unique_ptr<HostStage> hostClipConvexFaces() { return std::make_unique<HostClipConvexFaces>(); }

}  // namespace btgpu
