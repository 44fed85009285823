// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "80_integrate_poses_reference.h"

#include <algorithm>

#include "reference_maths.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kEpsilon = 1.1920929e-7;  // SIMD_EPSILON in a float build of Bullet
constexpr double kQuarterPi = 0.78539816339744831;

struct Pose {
  Vec position, turn;  // turn: x, y, z of the quaternion
  double w;
};

bool isFinite(float4 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z) && std::isfinite(v.w); }

// btTransformUtil::integrateTransform. A spin of more than a quarter of pi a step is limited, but only in the
// angle: the sine part keeps the size that it has for the whole spin, as in Bullet.
Pose move(const Pose& pose, const Vec& linear, const Vec& angular, double dt) {
  const double rateSqr = dot(angular, angular);
  const double rate = std::min(rateSqr > kEpsilon ? std::sqrt(rateSqr) : 0.0, kQuarterPi / dt);
  const Vec s = angular * (rate > 0 ? std::sin(rate * dt / 2) / rate : dt / 2);
  const double c = std::cos(rate * dt / 2);
  Pose next = {pose.position + linear * dt, pose.turn * c + s * pose.w + cross(s, pose.turn),
               c * pose.w - dot(s, pose.turn)};
  const double size = std::sqrt(dot(next.turn, next.turn) + next.w * next.w);
  next.turn = next.turn / size;
  next.w /= size;
  return next;
}

bool isActive(int state) {
  return state != STATE_SLEEPING && state != STATE_DISABLE_SIMULATION && state != STATE_FIXED_BASE;
}

}  // namespace

void integratePosesReference(const StepParams& params, const std::vector<BodyStep>& steps,
                             const std::vector<SolverBody>& solverBodies, const std::vector<uint>& solved,
                             const std::vector<BodyActivation>& activations, PosesReference& state) {
  const double dt = params.timeStep;
  for (size_t i = 0; i < state.infos.size(); ++i) {
    const uint flags = state.infos[i].flags;
    if (!(flags & BODY_PRESENT) || (flags & BODY_QUARANTINED)) continue;
    const bool dynamic = (flags & BODY_INTEGRATED) && !(flags & (BODY_STATIC | BODY_KINEMATIC));
    const bool written = solved[i] && steps[i].angularVelocity.w != 0;
    const SolverBody& solver = solverBodies[i];
    const float4 q = state.poses[i].orientation;
    Pose pose = {toVec(state.poses[i].position), toVec(q), q.w};
    Vec linear = toVec(dynamic ? steps[i].linearVelocity : state.velocities[i].linear);
    Vec angular = toVec(dynamic ? steps[i].angularVelocity : state.velocities[i].angular);
    bool moved = false;
    if (written) {
      linear = linear + toVec(solver.deltaLinear) + toVec(steps[i].externalLinear);
      angular = angular + toVec(solver.deltaAngular) + toVec(steps[i].externalAngular);
      const Vec push = toVec(solver.pushLinear), turn = toVec(solver.turnAngular);
      if ((params.flags & STEP_SPLIT_IMPULSE) && (dot(push, push) != 0 || dot(turn, turn) != 0)) {
        pose = move(pose, push, turn * params.splitImpulseTurnErp, dt);
        moved = true;
      }
    }
    if (dynamic && isActive(activations[i].state)) {
      pose = move(pose, linear, angular, dt);
      moved = true;
    }
    const BodyPose newPose = {toFloat4(pose.position), toFloat4(pose.turn, pose.w)};
    const BodyVelocity newVelocity = {toFloat4(linear), toFloat4(angular)};
    const bool finite = isFinite(newPose.position) && isFinite(newPose.orientation) && isFinite(newVelocity.linear) &&
                        isFinite(newVelocity.angular);
    if (!finite) {
      state.infos[i].flags |= BODY_QUARANTINED;
      state.velocities[i] = {};
      ++state.quarantined;
      continue;
    }
    if (moved) state.poses[i] = newPose;
    if (dynamic || written) state.velocities[i] = newVelocity;
  }
}

}  // namespace btgpu
