// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 80, in double. Velocities must be equal within two roundings of their largest
// summand, positions within four, quaternion components within 1e-6 (they are at most one; about ten
// roundings and the 4 ulp that OpenCL grants sin and cos). Who moves, who is quarantined and what stays as it
// was must be equal exactly.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/step.h"
#include "contract.h"

namespace btgpu {

// The state that the stage changes.
struct PosesReference {
  std::vector<BodyInfo> infos;
  std::vector<BodyPose> poses;
  std::vector<BodyVelocity> velocities;
  uint quarantined = 0;  // bodies put into quarantine
};

// Bullet's btSequentialImpulseConstraintSolver::writeBackBodies and
// btDiscreteDynamicsWorld::integrateTransforms.
void integratePosesReference(const StepParams& params, const std::vector<BodyStep>& steps,
                             const std::vector<SolverBody>& solverBodies, const std::vector<uint>& solved,
                             const std::vector<BodyActivation>& activations, PosesReference& state);

// `before`: the state that the step started from.
void checkIntegratedPoses(Contract& contract, const StepParams& params, const std::vector<BodyStep>& steps,
                          const std::vector<SolverBody>& solverBodies, const PosesReference& before,
                          const PosesReference& device, const PosesReference& expected);

}  // namespace btgpu
