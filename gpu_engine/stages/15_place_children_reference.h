// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 15. Positions are equal within 1e-6 of the lengths that are added, orientations within 1e-6;
// exact: activations and flags.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "contract.h"

namespace btgpu {

// By slot; what the stage changes.
struct PlacedChildren {
  std::vector<BodyInfo> infos;
  std::vector<BodyPose> poses;
  std::vector<BodyStep> steps;
  std::vector<BodyActivation> activations;
};

// Moves the slots with BODY_CHILD to where their bodies are; childPoses: in the axes of the body.
void placeChildrenReference(const std::vector<BodyPose>& childPoses, PlacedChildren& world);

void checkPlacedChildren(Contract& contract, const std::vector<BodyPose>& childPoses, const PlacedChildren& device,
                         const PlacedChildren& expected);

}  // namespace btgpu
