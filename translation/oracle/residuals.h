// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <vector>

#include "oracle_world.h"

BTGPU_TRANSLATION_BEGIN

// One and the same measure of how well velocities and impulses satisfy the contact rows, whoever solved them: the
// velocity error that each row still has. Normal row: the error counts in full while the contact pushes, and only if
// it approaches while it does not. Friction row: slip counts while the impulse is inside the cone.
struct Residual {
  double sumOfSquares = 0;
  long rows = 0;
  double rms() const;
  void add(const Residual& other) {
    sumOfSquares += other.sumOfSquares;
    rows += other.rows;
  }
};

// `contacts`: as the solver got them (poses, distances). `solved`: the same manifolds with the impulses found.
// `before`: the bodies' states before the step, forces included in `velocities`.
Residual measureResidual(const OracleWorld& world, const std::vector<Manifold>& contacts,
                         const std::vector<Manifold>& solved, const std::vector<BodyState>& before,
                         const std::vector<Velocity>& predicted, const std::vector<Velocity>& velocities,
                         btScalar timeStep);

// The same for joints, from the rows that were made of them: their velocity errors at the end. Rows with limits count
// where a limit can't be the reason for the error; soft rows and motors, which have two limits, not at all.
Residual measureJointResidual(const std::vector<Joint>& joints, const std::vector<JointRow>& rows,
                              const std::vector<uint>& solved, const std::vector<Velocity>& velocities);

// The same of one joint.
Residual measureJointResidual(const Joint& joint, const std::vector<JointRow>& rows,
                              const std::vector<Velocity>& velocities);

// Mass-weighted distance of two sets of velocities: sqrt(sum m |dv|^2 + dw . I dw).
double velocityDistance(const OracleWorld& world, const std::vector<Velocity>& a, const std::vector<Velocity>& b);

double kineticEnergy(const OracleWorld& world, const std::vector<Velocity>& velocities);

BTGPU_TRANSLATION_END
