// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 55. Must be equal exactly: there is nothing but integers and copied floats.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/contact.h"
#include "../../kernels/shared/joint.h"
#include "../../kernels/shared/step.h"

namespace btgpu {

struct IslandsReference {
  std::vector<uint> roots;                  // lowest body index of the island
  std::vector<BodyActivation> activations;  // after the islands' decisions
  std::vector<uint> solved;                 // 1 where the solver writes the body back
  std::vector<uint> constraints;            // manifolds that the solver gets, ascending
  std::vector<uint> jointSolved;            // 1 for joints of an island that is solved
  uint contactPoints = 0;                   // of all manifolds
};

// Islands by breadth-first search over the pairs and joints, then Bullet's decisions
// (btSimulationIslandManager::findUnions, ::buildIslands, ::processIslands, and
// btDiscreteDynamicsWorld::calculateSimulationIslands for joints). Bullet looks at the manifolds
// one after the other while kinematic bodies wake others; here all wake first, so that nothing depends on an
// order. manifolds: one a pair, then those of the host.
IslandsReference buildIslandsReference(const StepParams& params, const std::vector<BodyInfo>& infos,
                                       const std::vector<BodyStep>& steps,
                                       const std::vector<BodyActivation>& activations, const std::vector<Pair>& pairs,
                                       const std::vector<Manifold>& manifolds, const std::vector<Joint>& joints = {});

}  // namespace btgpu
