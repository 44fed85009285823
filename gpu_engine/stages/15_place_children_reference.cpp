// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "15_place_children_reference.h"

#include <cmath>

#include "reference_maths.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kTolerance = 1e-6;  // some eight roundings of a product of unit size

// q p, as matrices would have it.
float4 product(float4 q, float4 p) {
  const Vec a = toVec(q), b = toVec(p);
  return toFloat4(b * double(q.w) + a * double(p.w) + cross(a, b), double(q.w) * p.w - dot(a, b));
}

BodyPose placed(float4 position, float4 orientation, const BodyPose& child) {
  return {toFloat4(toVec(position) + rotationOf(orientation) * toVec(child.position)),
          product(orientation, child.orientation)};
}

}  // namespace

void placeChildrenReference(const std::vector<BodyPose>& childPoses, PlacedChildren& world) {
  for (size_t i = 0; i < world.infos.size(); ++i) {
    BodyInfo& info = world.infos[i];
    if (!(info.flags & BODY_CHILD)) continue;
    const size_t body = info.parent;
    world.poses[i] = placed(world.poses[body].position, world.poses[body].orientation, childPoses[i]);
    const BodyPose predicted =
        placed(world.steps[body].predictedPosition, world.steps[body].predictedOrientation, childPoses[i]);
    world.steps[i].predictedPosition = predicted.position;
    world.steps[i].predictedOrientation = predicted.orientation;
    world.activations[i] = world.activations[body];
    info.flags &= ~BODY_QUARANTINED;
    info.flags |= world.infos[body].flags & BODY_QUARANTINED;
  }
}

void checkPlacedChildren(Contract& contract, const std::vector<BodyPose>& childPoses, const PlacedChildren& device,
                         const PlacedChildren& expected) {
  contract.sameArray("info of slot", device.infos, expected.infos);
  contract.sameArray("activation of slot", device.activations, expected.activations);
  for (size_t i = 0; i < expected.infos.size(); ++i) {
    if (!(expected.infos[i].flags & BODY_CHILD)) continue;
    contract.at("shape {} of body {}", i, expected.infos[i].parent);
    const double size = length(toVec(expected.poses[i].position)) + length(toVec(childPoses[i].position)) +
                        length(toVec(expected.poses[expected.infos[i].parent].position));
    contract.near("position", device.poses[i].position, expected.poses[i].position, kTolerance * size);
    contract.near("predicted position", device.steps[i].predictedPosition, expected.steps[i].predictedPosition,
                  kTolerance * (size + length(toVec(expected.steps[i].predictedPosition))));
    const auto sameTurn = [&](const char* what, float4 d, float4 e) {
      contract.near(what, d, e, kTolerance);
      contract.near(what, d.w, e.w, kTolerance);
    };
    sameTurn("orientation", device.poses[i].orientation, expected.poses[i].orientation);
    sameTurn("predicted orientation", device.steps[i].predictedOrientation, expected.steps[i].predictedOrientation);
  }
}

}  // namespace btgpu
