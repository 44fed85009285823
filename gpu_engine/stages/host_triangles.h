// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "40_cull_triangles_reference.h"
#include "host_pairs.h"

namespace btgpu {

// What readTriangleInput() reads.
inline std::vector<std::string> triangleArrayNames() {
  std::vector<std::string> names = pairArrayNames();
  names.insert(names.end(), {"meshes", "mesh triangles"});
  return names;
}

inline TriangleInput readTriangleInput(StageIo& io) {
  TriangleInput in;
  in.arrays = readPairArrays(io);
  in.meshes.meshes = io.read(io.world.meshes);
  in.meshes.triangles = io.read(io.world.meshTriangles);
  return in;
}

// As stage 40 left them.
inline TriangleHits readTriangleHits(StageIo& io, const TriangleInput& in) {
  DeviceWorld& w = io.world;
  TriangleHits out;
  out.found = io.read(w.triangleFound);
  // Captures tell no more of it than how long the array is.
  out.groups = std::max(1u, static_cast<uint>(out.found.size() / std::max<size_t>(1, w.capacities.pairs)));
  out.found.resize(in.pairCount() * out.groups);
  out.first = io.read(w.triangleFirst, out.found.size());
  out.hits = io.read(w.triangleHits, io.counters().triangleHits);
  return out;
}

}  // namespace btgpu
