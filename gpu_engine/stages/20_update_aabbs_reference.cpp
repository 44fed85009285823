// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "20_update_aabbs_reference.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "shape_bounds.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kLargestMoving = 1e12;  // squared diagonal, btCollisionWorld::updateSingleAabb

Bounds boundsOf(const Shape& shape, float4 position, float4 orientation, double threshold,
                const std::vector<float4>& vertices) {
  const Bounds box = shapeBounds(shape, toVec(position), rotationOf(orientation), vertices);
  const Vec by{threshold, threshold, threshold};
  return {box.lower - by, box.upper + by};
}

Aabb noAabb() {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return {{kInfinity, kInfinity, kInfinity, 0}, {-kInfinity, -kInfinity, -kInfinity, 0}};
}

bool takesPart(const BodyInfo& body, const std::vector<Shape>& shapes) {
  return (body.flags & BODY_PRESENT) && !(body.flags & BODY_QUARANTINED) && body.shapeIndex >= 0 &&
         shapes[static_cast<size_t>(body.shapeIndex)].type != SHAPE_NONE;
}

// btCollisionObject::isActive
bool isActive(int state) {
  return state != STATE_SLEEPING && state != STATE_DISABLE_SIMULATION && state != STATE_FIXED_BASE;
}

// btCollisionWorld::updateSingleAabb, without the update of the broadphase.
Bounds wantedBounds(const StepParams& params, const BodyInfo& body, const Shape& shape, const BodyPose& pose,
                    const BodyStep& step, const std::vector<float4>& vertices) {
  Bounds box = boundsOf(shape, pose.position, pose.orientation, params.contactThreshold, vertices);
  const bool moves = (body.flags & BODY_RIGID) && !(body.flags & (BODY_STATIC | BODY_KINEMATIC));
  if (!(params.flags & STEP_USE_CONTINUOUS) || !moves) return box;
  const Bounds next =
      boundsOf(shape, step.predictedPosition, step.predictedOrientation, params.contactThreshold, vertices);
  for (int k = 0; k < 3; ++k) {
    box.lower[k] = std::min(box.lower[k], next.lower[k]);
    box.upper[k] = std::max(box.upper[k], next.upper[k]);
  }
  return box;
}

}  // namespace

UpdatedAabbs updateAabbsReference(const StepParams& params, const std::vector<BodyInfo>& infos,
                                  const std::vector<Shape>& shapes, const std::vector<float4>& hullVertices,
                                  const std::vector<BodyPose>& poses, const std::vector<BodyStep>& steps,
                                  const std::vector<BodyActivation>& activations, const std::vector<Aabb>& oldAabbs,
                                  const std::vector<Aabb>& hostAabbs) {
  UpdatedAabbs out;
  out.aabbs.assign(infos.size(), noAabb());
  out.activations = activations;
  for (size_t i = 0; i < infos.size(); ++i) {
    if (!takesPart(infos[i], shapes)) continue;
    if (shapes[static_cast<size_t>(infos[i].shapeIndex)].type == SHAPE_HOST) {
      out.aabbs[i] = hostAabbs[i];
      continue;
    }
    const bool hasOld = oldAabbs[i].lower.x <= oldAabbs[i].upper.x;
    // btCollisionWorld::updateAabbs leaves inactive bodies alone unless told to update all.
    const bool skipped = !(params.flags & STEP_FORCE_ALL_AABBS) && !isActive(activations[i].state);
    const Shape& shape = shapes[static_cast<size_t>(infos[i].shapeIndex)];
    const Bounds box = wantedBounds(params, infos[i], shape, poses[i], steps[i], hullVertices);
    const Vec diagonal = box.upper - box.lower;
    const bool inBounds = (infos[i].flags & (BODY_STATIC | BODY_CHILD)) || dot(diagonal, diagonal) < kLargestMoving;
    if (!skipped && !inBounds) {
      // btCollisionObject::setActivationState does not touch these two.
      int& state = out.activations[i].state;
      if (state != STATE_DISABLE_DEACTIVATION && state != STATE_DISABLE_SIMULATION) {
        state = STATE_DISABLE_SIMULATION;
        ++out.outOfBounds;
      }
    }
    const bool updated = !skipped && inBounds;
    out.aabbs[i] = updated || !hasOld ? Aabb{toFloat4(box.lower), toFloat4(box.upper)} : oldAabbs[i];
    const bool moves = !(infos[i].flags & (BODY_STATIC | BODY_KINEMATIC));
    if (shape.type == SHAPE_COMPOUND && !moves) out.aabbs[i] = noAabb();
  }
  return out;
}

namespace {

// A coordinate is the sum of position, reach and threshold; the reach a sum of three products with matrix entries that
// have some four roundings each: 16 half ulps of the largest of them.
constexpr double kTolerance = 1e-6;

void checkAxis(Contract& contract, float lower, float upper, float wantedLower, float wantedUpper) {
  const double limit = kTolerance * (std::fabs(double(wantedLower)) + std::fabs(double(wantedUpper)));
  contract.near("lower bound", lower, wantedLower, limit);
  contract.near("upper bound", upper, wantedUpper, limit);
}

}  // namespace

void checkUpdatedAabbs(Contract& contract, const UpdatedAabbs& device, const UpdatedAabbs& expected) {
  contract.sameArray("activation of body", device.activations, expected.activations);
  contract.same("bodies out of bounds", device.outOfBounds, expected.outOfBounds);
  for (size_t i = 0; i < expected.aabbs.size(); ++i) {
    const Aabb &a = device.aabbs[i], &e = expected.aabbs[i];
    contract.at("AABB of body {}", i);
    checkAxis(contract, a.lower.x, a.upper.x, e.lower.x, e.upper.x);
    checkAxis(contract, a.lower.y, a.upper.y, e.lower.y, e.upper.y);
    checkAxis(contract, a.lower.z, a.upper.z, e.lower.z, e.upper.z);
    contract.same("lower w", a.lower.w, 0);
    contract.same("upper w", a.upper.w, 0);
  }
}

}  // namespace btgpu
