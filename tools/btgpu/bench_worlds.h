// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>

#include "bench_world.h"
#include "worlds.h"

namespace btgpu::tool {

std::unique_ptr<BenchWorld> makeGpuWorld(const Builder& build, const btGpuSettings& settings, btScalar timeStep);
// Stage times of a world of makeGpuWorld with btGpuSettings::m_profile, since the last call.
std::vector<btGpuStageTime> takeProfile(BenchWorld& gpuWorld);
std::unique_ptr<BenchWorld> makeCpuWorld(const Builder& build, btScalar timeStep);
// Throws InputError if the scene holds what Bullet3 can't, or if the tool was built without Bullet3.
std::unique_ptr<BenchWorld> makeBullet3World(const Builder& build, const std::string& device, btScalar timeStep);

// The same scene in which no body ever sleeps.
Builder withoutSleeping(const Builder& build);
// Each body that can move gets a btDefaultMotionState.
Builder withMotionStates(const Builder& build);

}  // namespace btgpu::tool
