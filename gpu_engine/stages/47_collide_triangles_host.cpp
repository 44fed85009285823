// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "47_collide_triangles_reference.h"
#include "host_triangles.h"

namespace btgpu {
namespace {

std::vector<std::string> arrayNames() {
  std::vector<std::string> names = triangleArrayNames();
  names.insert(names.end(), {"triangles found", "triangle starts", "triangle hits"});
  return names;
}

class HostCollideTriangles : public HostStage {
 public:
  HostCollideTriangles() : HostStage("47_collide_triangles", arrayNames()) {}

  void compute(StageIo& io) override {
    m_in = readTriangleInput(io);
    m_hits = readTriangleHits(io, m_in);
    m_before = io.read(io.world.contacts, m_in.arrays.pairs.size());
  }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    std::vector<TriangleContacts> touches = collideTrianglesReference(m_in, m_hits);
    std::vector<RawContacts> contacts = m_before;
    pickTouchesReference(m_in, m_hits, touches, contacts);
    touches.resize(w.capacities.triangleHits);
    io.write(w.triangleTouches, touches);
    io.write(w.contacts, contacts);
  }
  void check(StageIo& io, Contract& contract) override {
    const auto touches = io.read(io.world.triangleTouches, m_hits.hits.size());
    checkTriangleContacts(contract, m_in, m_hits, touches);
    checkPickedTouches(contract, m_in, m_hits, touches, m_before, io.read(io.world.contacts, m_in.arrays.pairs.size()));
  }

 private:
  TriangleInput m_in;
  TriangleHits m_hits;
  std::vector<RawContacts> m_before;
};

}  // namespace

std::unique_ptr<HostStage> hostCollideTriangles() { return std::make_unique<HostCollideTriangles>(); }

}  // namespace btgpu
