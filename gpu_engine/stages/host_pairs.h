// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../host_stage.h"
#include "pair_arrays.h"

namespace btgpu {

// What readPairArrays() reads.
inline std::vector<std::string> pairArrayNames() {
  return {"pairs",         "infos",      "shapes",        "poses",      "old manifolds", "old pair count",
          "bucket starts", "pair items", "hull vertices", "hull faces", "hull corners",  "hull edges"};
}

inline PairArrays readPairArrays(StageIo& io) {
  DeviceWorld& w = io.world;
  PairArrays in;
  const size_t pairCount = io.pairCount();
  in.pairs = io.read(w.pairs, pairCount);
  in.infos = io.readBodies(w.infos);
  in.shapes = io.read(w.shapes);
  in.poses = io.readBodies(w.poses);
  in.oldManifolds = io.read(w.oldManifolds, io.read(w.oldPairCount, 1).at(0));
  in.bucketFirst = io.read(w.bucketFirst, BUCKET_COUNT + 1);
  in.items = io.read(w.items, pairCount);
  in.hulls.vertices = io.read(w.hullVertices);
  in.hulls.faces = io.read(w.hullFaces);
  in.hulls.corners = io.read(w.hullCorners);
  in.hulls.edges = io.read(w.hullEdges);
  return in;
}

}  // namespace btgpu
