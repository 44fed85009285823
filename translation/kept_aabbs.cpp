// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "kept_aabbs.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "read_queries.h"

BTGPU_TRANSLATION_BEGIN
namespace {

float below(double value) {
  const float f = static_cast<float>(value);
  return double(f) > value ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}
float above(double value) { return -below(-value); }

// As DeviceWorld::forgetStaleAabbs and uploadBorn have it.
std::vector<std::uint32_t> staleSlots(const WorldReader& reader) {
  const WorldInput& input = reader.input();
  std::vector<std::uint32_t> slots;
  if (!input.shapes.changed.empty() || input.replaceManifolds) {
    slots.resize(input.bodyCount);
    std::iota(slots.begin(), slots.end(), 0u);
    return slots;
  }
  for (const auto* list : {&input.poses.changed, &input.infos.changed, &input.born}) {
    slots.insert(slots.end(), list->begin(), list->end());
  }
  std::sort(slots.begin(), slots.end());
  slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
  return slots;
}

}  // namespace

Aabb aabbOf(const btBroadphaseProxy& proxy, const double (&origin)[3]) {
  const btVector3 &lower = proxy.m_aabbMin, &upper = proxy.m_aabbMax;
  return {{below(double(lower.x()) - origin[0]), below(double(lower.y()) - origin[1]),
           below(double(lower.z()) - origin[2]), 0},
          {above(double(upper.x()) - origin[0]), above(double(upper.y()) - origin[1]),
           above(double(upper.z()) - origin[2]), 0}};
}

void listKeptAabbs(const btCollisionWorld& world, bool current, WorldReader& reader) {
  WorldInput& input = reader.input();
  input.keptAabbs.clear();
  const auto leafOf = leafFinderOf(*world.getBroadphase());
  input.hostAabbsCurrent = current && leafOf && !world.getForceUpdateAllAabbs();
  if (!input.hostAabbsCurrent) return;
  for (const std::uint32_t slot : staleSlots(reader)) {
    const btCollisionObject* object = reader.isChild(slot) ? nullptr : reader.objectOf(slot);
    if (!object || object->isActive() || !object->getBroadphaseHandle()) continue;
    input.keptAabbs.push_back({slot, aabbOf(*leafOf(*object->getBroadphaseHandle()), input.regionOrigin)});
  }
}

BTGPU_TRANSLATION_END
