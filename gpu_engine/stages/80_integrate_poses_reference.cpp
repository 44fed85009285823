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
    Vec meanLinear = linear, meanAngular = angular;  // over the step
    if (written) {
      linear = linear + toVec(solver.deltaLinear) + toVec(steps[i].externalLinear);
      angular = angular + toVec(solver.deltaAngular) + toVec(steps[i].externalAngular);
      const bool inSubsteps = params.flags & STEP_SUBSTEPS;
      meanLinear = inSubsteps ? toVec(solver.pushLinear) : linear;
      meanAngular = inSubsteps ? toVec(solver.turnAngular) : angular;
      const Vec push = toVec(solver.pushLinear), turn = toVec(solver.turnAngular);
      if ((params.flags & STEP_SPLIT_IMPULSE) && !inSubsteps && (dot(push, push) != 0 || dot(turn, turn) != 0)) {
        pose = move(pose, push, turn * params.splitImpulseTurnErp, dt);
        moved = true;
      }
    }
    if (dynamic && isActive(activations[i].state)) {
      pose = move(pose, meanLinear, meanAngular, dt);
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

namespace {

constexpr double kRounding = 1.0 / 16777216;  // of one float operation, relative

double sizeOf(float4 v) { return length(toVec(v)); }

void checkPose(Contract& c, float timeStep, const SolverBody& solver, const BodyVelocity& velocity,
               const BodyPose& device, const BodyPose& expected) {
  const double moved = (sizeOf(velocity.linear) + sizeOf(solver.pushLinear)) * timeStep;
  c.near("position", device.position, expected.position, 4 * kRounding * (sizeOf(expected.position) + 2 * moved));
  c.same("position w", device.position.w, 0);
  c.near("orientation x", device.orientation.x, expected.orientation.x, 1e-6);
  c.near("orientation y", device.orientation.y, expected.orientation.y, 1e-6);
  c.near("orientation z", device.orientation.z, expected.orientation.z, 1e-6);
  c.near("orientation w", device.orientation.w, expected.orientation.w, 1e-6);
}

// Velocities that are not finite go in, and out only of what is in quarantine.
void checkVelocity(Contract& c, const BodyStep& step, const SolverBody& solver, const BodyVelocity& before,
                   const BodyVelocity& device, const BodyVelocity& expected) {
  const double linear =
      sizeOf(before.linear) + sizeOf(step.linearVelocity) + sizeOf(step.externalLinear) + sizeOf(solver.deltaLinear);
  const double angular = sizeOf(before.angular) + sizeOf(step.angularVelocity) + sizeOf(step.externalAngular) +
                         sizeOf(solver.deltaAngular);
  const bool finite = std::isfinite(linear) && std::isfinite(angular);
  c.near("linear velocity", device.linear, expected.linear, finite ? 2 * kRounding * linear : 0);
  c.near("angular velocity", device.angular, expected.angular, finite ? 2 * kRounding * angular : 0);
  c.same("linear velocity w", device.linear.w, expected.linear.w);
  c.same("angular velocity w", device.angular.w, expected.angular.w);
}

}  // namespace

void checkIntegratedPoses(Contract& contract, const StepParams& params, const std::vector<BodyStep>& steps,
                          const std::vector<SolverBody>& solverBodies, const PosesReference& before,
                          const PosesReference& device, const PosesReference& expected) {
  contract.sameArray("info of body", device.infos, expected.infos);
  contract.same("bodies put into quarantine", device.quarantined, expected.quarantined);
  for (size_t i = 0; i < expected.poses.size(); ++i) {
    contract.at("body {}", i);
    if (std::memcmp(&expected.poses[i], &before.poses[i], sizeof(BodyPose)) == 0) {
      contract.require(std::memcmp(&device.poses[i], &before.poses[i], sizeof(BodyPose)) == 0, "pose as it was");
    } else {
      checkPose(contract, params.timeStep, solverBodies[i], expected.velocities[i], device.poses[i], expected.poses[i]);
    }
    checkVelocity(contract, steps[i], solverBodies[i], before.velocities[i], device.velocities[i],
                  expected.velocities[i]);
  }
}

}  // namespace btgpu
