// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the stages that collide pairs read, as their contracts take it.
#pragma once

#include <algorithm>
#include <vector>

#include "../../kernels/shared/contact.h"
#include "../slots.h"
#include "../world_input.h"
#include "reference_maths.h"

namespace btgpu {

struct PairArrays {
  std::vector<Pair> pairs;
  std::vector<BodyInfo> infos;
  std::vector<Shape> shapes;
  std::vector<BodyPose> poses;
  std::vector<Manifold> oldManifolds;
  std::vector<uint> bucketFirst, items;
  HullArrays hulls;

  size_t shapeIndexOf(uint body) const { return static_cast<size_t>(infos[body].shapeIndex); }
  const Shape& shapeOf(uint body) const { return shapes[shapeIndexOf(body)]; }
  // The body that a slot belongs to, itself but for the shapes of a compound.
  uint ownerOf(uint slot) const { return btgpu::ownerOf(infos, slot); }
  reference::Vec bFromA(const Pair& p) const {
    return reference::toVec(poses[p.bodyB].position) - reference::toVec(poses[p.bodyA].position);
  }
  // How far apart surfaces may be for a contact: fixed with the pair's manifold.
  float thresholdOf(const Pair& p) const {
    if (p.oldManifold != NO_INDEX) return oldManifolds[p.oldManifold].breakingThreshold;
    return std::min(shapeOf(ownerOf(p.bodyA)).breakingThreshold, shapeOf(ownerOf(p.bodyB)).breakingThreshold);
  }
};

}  // namespace btgpu
