// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Batched queries of a world of any class; see btGpuDynamicsWorld.h.
#pragma once

#include "../translation/bullet.h"
#include "btGpuDynamicsWorld.h"

BTGPU_TRANSLATION_BEGIN

void rayTestBatch(const btDiscreteDynamicsWorld& world, const btGpuRay* rays, btGpuRayHit* hits, int count);
void convexSweepBatch(const btDiscreteDynamicsWorld& world, const btGpuSweep* sweeps, btGpuSweepHit* hits, int count);
void closestPointsBatch(const btDiscreteDynamicsWorld& world, const btGpuClosestQuery* queries,
                        btGpuClosestPoints* answers, int count);

BTGPU_TRANSLATION_END
