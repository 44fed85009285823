// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/support/box_pairs.h"

namespace btgpu {
namespace {

constexpr float kQuarterPi = 0.78539816339f;
const float4 kFar = {1000, -2000, 500, 0};

float& along(float4& v, uint axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

size_t addRandomBoxPair(std::mt19937& random, PairWorld& p, BoxPose kind) {
  float4 a = uniform3(random, 0.1f, 1), b = uniform3(random, 0.1f, 1);
  if (kind == BoxPose::Thin) along(random() % 2 ? a : b, random() % 3) = 1e-3f;
  const float4 base = randomTurn(random);
  float4 relative = kNoTurn, place = uniform3(random, -1, 1);
  const uint axis = random() % 3;
  const float side = random() % 2 ? 1.0f : -1.0f;
  const float4 half = (kQuarterPi + uniform(random, -0.2f, 0.2f)) * float4{1, 1, 1, 0};
  switch (kind) {
    case BoxPose::Anyhow:
    case BoxPose::Thin:
      relative = randomTurn(random);
      break;
    case BoxPose::Resting:
      relative = turnAbout(uniform3(random, -1, 1), uniform(random, -0.01f, 0.01f));
      [[fallthrough]];
    case BoxPose::Aligned:
      along(place, axis) = side * (along(a, axis) + along(b, axis) - uniform(random, -0.002f, 0.02f));
      break;
    case BoxPose::Crossed:
      // A turned about x, B about z, both by about 45 degrees: A's upper edge runs along x, B's lower one
      // along z.
      a = b = {0.8f, 0.8f, 0.8f, 0};
      place = uniform3(random, -0.3f, 0.3f);
      place.y = 1.6f * std::sqrt(2.0f) - uniform(random, -0.05f, 0.2f);
      break;
  }
  BodyPose poseA{kFar, base}, poseB{kFar + turned(base, place), turnProduct(base, relative)};
  if (kind == BoxPose::Crossed) {
    poseA.orientation = turnProduct(base, turnAbout({1, 0, 0, 0}, half.x));
    poseB.orientation = turnProduct(base, turnAbout({0, 0, 1, 0}, half.x));
  }
  return p.add(p.world.box(a), poseA, p.world.box(b), poseB);
}

PairWorld randomBoxPairs(std::mt19937& random, size_t count) {
  PairWorld p;
  const BoxPose kinds[] = {BoxPose::Anyhow, BoxPose::Resting, BoxPose::Aligned, BoxPose::Crossed, BoxPose::Thin};
  const int ball = p.world.sphere(1);
  for (size_t n = 0; n < count; ++n) {
    addRandomBoxPair(random, p, kinds[n % 5]);
    if (n % 3 == 2) p.add(ball, at(0, 0, 0), n % 2 ? ball : p.world.box({1, 1, 1, 0}), at(1, 0, 0));
  }
  return p;
}

PairWorld exactBoxPairs() {
  PairWorld p;
  const int cube = p.world.box({1, 1, 1, 0}), large = p.world.box({4, 1, 4, 0}),
            small = p.world.box({0.5f, 0.5f, 0.5f, 0});
  const int sheet = p.world.box({1, 1e-3f, 1, 0}, 1e-4f), ball = p.world.sphere(1);
  // The half diagonal of the cube's square side.
  const float diagonal = std::sqrt(2.0f);
  const float4 aboutX = turnAbout({1, 0, 0, 0}, kQuarterPi), aboutZ = turnAbout({0, 0, 1, 0}, kQuarterPi);
  p.add(cube, at(0, 0, 0), cube, at(0, 0, 0));
  p.add(cube, at(0, 0, 0), cube, at(0, 0, 2));
  p.add(cube, at(0, 0, 0), cube, at(std::nextafter(2.0f, 3.0f), 0, 0));
  p.add(cube, at(0, 0, 0), cube, at(-2, 2, 0));
  p.add(cube, at(0, 0, 0), cube, at(-2, 2, 2));
  p.add(large, at(0, 0, 0), small, at(1, 1.25f, -2));
  p.add(large, at(0, 0, 0), small, at(4, 1.25f, -2));
  p.add(small, at(1, 1.25f, -2), large, at(0, 0, 0));
  p.add(sheet, at(0, 0, 0), sheet, at(0.5f, 1e-3f, 0));
  p.add(cube, at(0, 0, 0, aboutX), cube, at(0.25f, 2 * diagonal - 0.25f, 0.125f, aboutZ));
  p.add(cube, at(0, 0, 0, aboutX), cube, at(0.25f, 2 * diagonal + 0.25f, 0.125f, aboutZ));
  p.add(large, at(0, 0, 0), cube, at(0, 0.75f + diagonal, 0, aboutX));
  p.add(ball, at(0, 0, 0), ball, at(1, 0, 0));
  p.add(cube, at(0, 0, 0), cube, at(5, 6, 7, aboutX));
  return p;
}

double pairSize(const PairWorld& p, const Pair& pair) {
  return boxPairSize(p.shapeOf(pair.bodyA), p.world.pose(pair.bodyA), p.shapeOf(pair.bodyB), p.world.pose(pair.bodyB));
}

AxisProjections projectionsOf(const PairWorld& p, const Pair& pair) {
  return projectBoxes(p.shapeOf(pair.bodyA), p.world.pose(pair.bodyA), p.shapeOf(pair.bodyB), p.world.pose(pair.bodyB));
}

}  // namespace btgpu
