// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../query_world.h"
#include "../stages/30_bounds_tree.h"

namespace btgpu {

// The world of batched queries on the device, with trees over its items; shared by all kinds of queries.
class QueryArrays {
 public:
  explicit QueryArrays(ComputeDevice& device);
  // Keeps what is there until the world's version changes. Without waiting.
  void upload(Queue& queue, const QueryWorld& world);

  // One kind of items.
  struct Items {
    explicit Items(ComputeDevice& device) : tree(device) {}
    DeviceArray<BodyInfo> infos{"query infos"};
    DeviceArray<ItemPose> poses{"query poses"};
    DeviceArray<ItemForm> forms{"query forms"};
    DeviceArray<Aabb> aabbs{"query aabbs"};
    BoundsTree tree;
    uint treeCount = 0, count = 0;
  };
  Items device, host;
  uint isDouble = 0;
  DeviceArray<CompoundChild> children{"query compound children"};
  DeviceArray<Shape> shapes{"query shapes"};
  DeviceArray<float4> hullVertices{"query hull vertices"}, spheres{"query spheres"};
  DeviceArray<HullFace> hullFaces{"query hull faces"};
  DeviceArray<uint> hullCorners{"query hull corners"};
  DeviceArray<HullEdge> hullEdges{"query hull edges"};
  DeviceArray<Mesh> meshes{"query meshes"};
  DeviceArray<MeshNode> meshNodes{"query mesh nodes"};
  DeviceArray<MeshTriangle> meshTriangles{"query mesh triangles"};

 private:
  static void upload(Queue& queue, const QueryItems& from, Items& to);

  std::uint64_t m_version = 0;  // of the world that the arrays hold; 0: none
  std::vector<float4> m_paddedVertices;
};

}  // namespace btgpu
