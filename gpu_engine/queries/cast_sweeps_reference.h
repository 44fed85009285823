// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of queries/cast_sweeps.cl: each sweep against every item, and of a mesh every triangle, without a
// tree. Hits are the same but for the device's sines, cosines and square roots, of which OpenCL promises no last bit:
// how far that moves an end of a way that stops within SWEEP_NEAR of the surface is up to the caller.
#pragma once

#include "../query_world.h"

namespace btgpu {

std::vector<SweepHit> castSweepsReference(const QueryWorld& world, const std::vector<Sweep>& sweeps);

// Objects of world.host whose bounds each sweep enters before its hit, ascending.
std::vector<std::vector<std::uint32_t>> hostItemsReference(const QueryWorld& world, const std::vector<Sweep>& sweeps,
                                                           const std::vector<SweepHit>& hits);

}  // namespace btgpu
