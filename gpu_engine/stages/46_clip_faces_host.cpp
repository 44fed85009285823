// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "46_clip_faces_reference.h"
#include "host_pairs.h"

namespace btgpu {
namespace {

class HostClipFaces : public HostStage {
 public:
  HostClipFaces() : HostStage("46_clip_faces", pairArrayNames()) {}

  void compute(StageIo& io) override {
    DeviceWorld& w = io.world;
    m_in = readPairArrays(io);
    m_axes = io.read(w.axes, m_in.bucketFirst[BUCKET_BOX_BOX + 1] - m_in.bucketFirst[BUCKET_BOX_BOX]);
    m_before = io.read(w.contacts, m_in.pairs.size());
  }
  void store(StageIo& io) override {
    std::vector<RawContacts> contacts = m_before;
    clipFacesReference(m_in, m_axes, contacts);
    io.write(io.world.contacts, contacts);
  }
  void check(StageIo& io, Contract& contract) override {
    checkClippedFaces(contract, m_in, m_axes, m_before, io.read(io.world.contacts, m_in.pairs.size()));
  }

 private:
  PairArrays m_in;
  std::vector<SeparatingAxis> m_axes;
  std::vector<RawContacts> m_before;
};

}  // namespace

std::unique_ptr<HostStage> hostClipFaces() { return std::make_unique<HostClipFaces>(); }

}  // namespace btgpu
