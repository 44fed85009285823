// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "42_collide_primitives_reference.h"
#include "host_pairs.h"

namespace btgpu {
namespace {

class HostCollidePrimitives : public HostStage {
 public:
  HostCollidePrimitives() : HostStage("42_collide_primitives", pairArrayNames()) {}

  void compute(StageIo& io) override {
    m_in = readPairArrays(io);
    m_before = io.read(io.world.contacts, m_in.pairs.size());
  }
  void store(StageIo& io) override {
    std::vector<RawContacts> contacts = m_before;
    collidePrimitivesReference(m_in, contacts);
    io.write(io.world.contacts, contacts);
  }
  void check(StageIo& io, Contract& contract) override {
    checkPrimitiveContacts(contract, m_in, m_before, io.read(io.world.contacts, m_in.pairs.size()));
  }

 private:
  PairArrays m_in;
  std::vector<RawContacts> m_before;
};

}  // namespace

std::unique_ptr<HostStage> hostCollidePrimitives() { return std::make_unique<HostCollidePrimitives>(); }

}  // namespace btgpu
