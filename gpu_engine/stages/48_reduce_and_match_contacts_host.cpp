// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "48_reduce_and_match_contacts_reference.h"
#include "host_pairs.h"

namespace btgpu {
namespace {

class HostReduceAndMatchContacts : public HostStage {
 public:
  HostReduceAndMatchContacts() : HostStage("48_reduce_and_match_contacts", pairArrayNames()) {}

  void compute(StageIo& io) override {
    m_in.arrays = readPairArrays(io);
    m_in.contacts = io.read(io.world.contacts, m_in.arrays.pairs.size());
    m_in.materials = io.readBodies(io.world.materials);
    m_in.unseen = (io.params().flags & STEP_CONTACTS_UNSEEN) != 0;
  }
  void store(StageIo& io) override { io.write(io.world.manifolds, matchContactsReference(m_in)); }
  void check(StageIo& io, Contract& contract) override {
    checkMatchedContacts(contract, m_in, io.read(io.world.manifolds, m_in.arrays.pairs.size()));
  }

 private:
  MatchInput m_in;
};

}  // namespace

std::unique_ptr<HostStage> hostReduceAndMatchContacts() { return std::make_unique<HostReduceAndMatchContacts>(); }

}  // namespace btgpu
