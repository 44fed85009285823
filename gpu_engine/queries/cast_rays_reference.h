// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of queries/cast_rays.cl: each ray is tried against every item, and of a mesh every triangle, without a
// tree. Exact, where the device rounds division and square root correctly: a tree only leaves out what a ray can't hit.
#pragma once

#include "../query_world.h"

namespace btgpu {

std::vector<RayHit> castRaysReference(const QueryWorld& world, const std::vector<Ray>& rays);

// Objects of world.host whose bounds each ray enters before its hit, ascending.
std::vector<std::vector<std::uint32_t>> hostItemsReference(const QueryWorld& world, const std::vector<Ray>& rays,
                                                           const std::vector<RayHit>& hits);

}  // namespace btgpu
