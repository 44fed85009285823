// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What batched queries go down the seam with: the shapes in the world where they are now, which need not be where the
// last step left them.
#pragma once

#include <cstdint>
#include <vector>

#include "../kernels/shared/query.h"
#include "world_input.h"

namespace btgpu {

struct QueryItems {
  std::vector<BodyInfo> infos;  // uniqueId: position of the object in the world's array
  std::vector<ItemPose> poses;  // of what the device tests itself
  std::vector<ItemForm> forms;  // likewise
  std::vector<Aabb> aabbs;
  std::uint32_t treeCount = 0;  // the items from here on have no bounds
};

struct QueryWorld {
  // Shapes, hulls and meshes by BodyInfo::shapeIndex; the rest of it is empty.
  WorldInput shapes;
  std::vector<float4> spheres;  // ItemForm says what
  QueryItems device, host;      // that the device has a test for; that Bullet itself has to be asked for
  std::vector<CompoundChild> children;
  bool isDouble = false;      // Bullet's btScalar
  std::uint64_t version = 0;  // another one whenever anything above is
};

// Objects of QueryWorld::host that ray or sweep i may hit before its hit are [hostFirst[i], hostFirst[i + 1]) of these,
// with where it enters their bounds; hostFirst is empty if there are none at all.
struct HostLists {
  std::vector<std::uint32_t> hostFirst, hostObjects;
  std::vector<float> hostEnters;
};
struct RayResults : HostLists {
  std::vector<RayHit> hits;
};
struct SweepResults : HostLists {
  std::vector<SweepHit> hits;
};

}  // namespace btgpu
