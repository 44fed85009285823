// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Worlds for tests that run the same calls on stock Bullet and on btgpu.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "compat/btGpuDynamicsWorld.h"
#include "tests/support/world_of.h"

namespace btgpu::test {

using StockWorld = WorldOf<btDiscreteDynamicsWorld>;
using GpuWorld = WorldOf<btGpuDynamicsWorld>;

// Stock must never be compared with stock. `shares`: what the CPU may do inside the device's steps, by name.
inline void expectAllOnDevice(const btGpuDynamicsWorld& world, const std::vector<std::string>& shares = {}) {
  EXPECT_GT(world.statistics().m_deviceSteps, 0u) << "no step ran on a device";
  EXPECT_EQ(world.statistics().m_stockSteps, 0u);
  for (const auto& f : world.fallbackReport()) {
    const bool allowed = !f.m_wholeStep && std::find(shares.begin(), shares.end(), f.m_what) != shares.end();
    EXPECT_TRUE(allowed) << "on the CPU: " << f.m_what << ": " << f.m_reason;
  }
}

inline double length(const btVector3& v) { return double(v.length()); }

}  // namespace btgpu::test
