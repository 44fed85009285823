// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 20. Coordinates are equal within 1e-6 of the body's distance from the origin plus
// its size: the reference computes in double and rounds once. Exact: AABBs taken over from the last step,
// those of planes and of what takes no part, the states and the count.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/shape.h"
#include "../../kernels/shared/step.h"
#include "contract.h"

namespace btgpu {

struct UpdatedAabbs {
  std::vector<Aabb> aabbs;                  // by body
  std::vector<BodyActivation> activations;  // by body; as given but for those out of bounds
  uint outOfBounds = 0;                     // bodies disabled because their AABB is too large
};

// All arrays but `shapes` and `hullVertices` are indexed by body. An old AABB with lower.x > upper.x says that there is
// none.
UpdatedAabbs updateAabbsReference(const StepParams& params, const std::vector<BodyInfo>& infos,
                                  const std::vector<Shape>& shapes, const std::vector<float4>& hullVertices,
                                  const std::vector<BodyPose>& poses, const std::vector<BodyStep>& steps,
                                  const std::vector<BodyActivation>& activations, const std::vector<Aabb>& oldAabbs,
                                  const std::vector<Aabb>& hostAabbs = {});

void checkUpdatedAabbs(Contract& contract, const UpdatedAabbs& device, const UpdatedAabbs& expected);

}  // namespace btgpu
