// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../query_world.h"
#include "../stages/30_bounds_tree.h"

namespace btgpu {

// Batches of rays through the world as it is now. Keeps the world on the device until its version changes. Waits for
// the device, unlike a stage of the step.
class RayCaster {
 public:
  explicit RayCaster(ComputeDevice& device);

  // One hit a ray, and which of the host's objects it has to be tried against besides.
  void cast(Queue& queue, const QueryWorld& world, const Ray* rays, size_t count, RayResults& results);

 private:
  // One kind of items, with a tree over them.
  struct Items {
    explicit Items(ComputeDevice& device) : tree(device) {}
    DeviceArray<BodyInfo> infos{"query infos"};
    DeviceArray<ItemPose> poses{"query poses"};
    DeviceArray<uint> childOf{"query children of"};
    DeviceArray<Aabb> aabbs{"query aabbs"};
    BoundsTree tree;
    uint treeCount = 0, count = 0;
  };
  void upload(Queue& queue, const QueryWorld& world);
  static void upload(Queue& queue, const QueryItems& from, Items& to);
  void findHostItems(Queue& queue, size_t count, RayResults& results);

  Kernel m_castRays, m_countHostItems, m_emitHostItems;
  Scan m_scan;
  std::uint64_t m_version = 0;  // of the world that the arrays hold; 0: none
  uint m_isDouble = 0;
  Items m_device, m_host;
  std::vector<float4> m_paddedVertices;
  DeviceArray<CompoundChild> m_children{"query compound children"};
  DeviceArray<Shape> m_shapes{"query shapes"};
  DeviceArray<float4> m_hullVertices{"query hull vertices"};
  DeviceArray<Ray> m_rays{"rays"};
  DeviceArray<RayHit> m_hits{"ray hits"};
  DeviceArray<uint> m_counts{"host items of rays"}, m_offsets{"offsets of host items"}, m_total{"host item count"};
  DeviceArray<uint> m_objects{"host objects of rays"};
  DeviceArray<float> m_enters{"where rays enter host objects"};
};

}  // namespace btgpu
