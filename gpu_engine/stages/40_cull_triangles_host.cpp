// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../host_stage.h"
#include "host_triangles.h"

namespace btgpu {
namespace {

class HostCullTriangles : public HostStage {
 public:
  HostCullTriangles() : HostStage("40_cull_triangles", triangleArrayNames()) {}

  void compute(StageIo& io) override { m_in = readTriangleInput(io); }
  void store(StageIo& io) override {
    DeviceWorld& w = io.world;
    TriangleHits out = cullTrianglesReference(m_in);
    StepCounters counters = io.counters();
    counters.triangleHits = static_cast<uint>(out.hits.size());
    if (out.hits.size() > w.capacities.triangleHits) {
      counters.overflow |= OVERFLOW_TRIANGLES;
      io.setCounters(counters);
      return;
    }
    io.setCounters(counters);
    w.triangleGroups = out.groups;
    // As long as the device's: kernels take the lengths for granted.
    out.found.resize(w.capacities.pairs);
    out.first.resize(w.capacities.pairs);
    out.hits.resize(w.capacities.triangleHits);
    io.write(w.triangleFound, out.found);
    io.write(w.triangleFirst, out.first);
    io.write(w.triangleHits, out.hits);
  }
  void check(StageIo& io, Contract& contract) override {
    if (io.counters().overflow) return;
    checkTriangleHits(contract, m_in, readTriangleHits(io, m_in), io.counters().triangleHits);
  }

 private:
  TriangleInput m_in;
};

}  // namespace

std::unique_ptr<HostStage> hostCullTriangles() { return std::make_unique<HostCullTriangles>(); }

}  // namespace btgpu
