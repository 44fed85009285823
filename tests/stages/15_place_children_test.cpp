// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The shapes of compounds: where they are, and all stages of steps in which they collide, against their references.
#include "gpu_engine/stages/15_place_children.h"

#include "gpu_engine/stages/10_apply_forces.h"
#include "gpu_engine/stages/15_place_children_reference.h"
#include "gpu_engine/world_engine.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

class PlaceChildrenTest : public DeviceTest {
 protected:
  void expectAsReference(const WorldInput& input) {
    StageBench bench(queue(), input);
    DeviceWorld& w = bench.world();
    bench.run<ApplyForces>();
    const auto read = [&]() -> PlacedChildren {
      const size_t n = w.bodyCount;
      return {bench.read(w.infos, n), bench.read(w.poses, n), bench.read(w.steps, n), bench.read(w.activations, n)};
    };
    PlacedChildren expected = read();
    const PlacedChildren before = expected;
    placeChildrenReference(input.childPoses.values, expected);
    bench.run<PlaceChildren>();
    const PlacedChildren device = read();
    Contract contract("15_place_children");
    checkPlacedChildren(contract, input.childPoses.values, device, expected);
    EXPECT_TRUE(contract.ok()) << contract.text();
    for (size_t i = 0; i < before.infos.size(); ++i) {
      if (before.infos[i].flags & BODY_CHILD) continue;
      EXPECT_EQ(std::memcmp(&before.poses[i], &device.poses[i], sizeof(BodyPose)), 0) << "body " << i;
      EXPECT_EQ(std::memcmp(&before.steps[i], &device.steps[i], sizeof(BodyStep)), 0) << "body " << i;
    }
  }
};

BodyPose poseAt(float4 position, float4 orientation) { return {position, orientation}; }

// Bars of a ball, a box, and a capsule between them, in a heap over a floor of two boxes that are one compound.
WorldInput bars(uint count, uint seed) {
  std::mt19937 random(seed);
  WorldBuilder b;
  const int ball = b.sphere(0.3f), box = b.box({0.25f, 0.25f, 0.25f, 0}), bar = b.capsule(0, 0.1f, 0.5f);
  const int whole = b.compound({0.9f, 0.4f, 0.4f, 0}), floor = b.box({20, 1, 10, 0});
  const uint ground = b.add(b.compound({20, 1, 20, 0}), {0, -1, 0, 0}, 0);
  b.addChild(ground, floor, poseAt({0, 0, 10, 0}, kNoTurn));
  b.addChild(ground, floor, poseAt({0, 0, -10, 0}, kNoTurn));
  for (uint i = 0; i < count; ++i) {
    const float4 place = {float(i % 3) - 1, 0.6f + 0.5f * float(i / 6), 1.2f * float(i / 3 % 2), 0};
    const uint body = b.add(i % 5 == 4 ? box : whole, place, 1, randomTurn(random));
    b.velocity(body).angular = uniform3(random, -3, 3);
    b.forces(body).force = {0, -10, 0, 0};
    if (i % 5 == 4) continue;
    b.addChild(body, ball, poseAt({-0.6f, 0, 0, 0}, kNoTurn));
    b.addChild(body, box, poseAt({0.6f, 0, 0, 0}, randomTurn(random)));
    if (i % 2) b.addChild(body, bar, poseAt({0, 0, 0, 0}, turnAbout({0, 0, 1, 0}, 0.1f)));
  }
  return b.finish();
}

TEST_F(PlaceChildrenTest, Small) { expectAsReference(bars(3, 1)); }

TEST_F(PlaceChildrenTest, GoWithTheirBodies) {
  for (uint seed = 0; seed < 10; ++seed) {
    WorldInput input = bars(40, seed);
    std::mt19937 random(seed);
    for (auto& info : input.infos.values) {
      if (!(info.flags & BODY_CHILD) && random() % 4 == 0) info.flags |= BODY_QUARANTINED;
    }
    for (auto& activation : input.activations.values) activation = {int(random() % 6), uniform(random, 0, 2)};
    expectAsReference(input);
  }
}

TEST_F(PlaceChildrenTest, AllStagesOfTheirCollisions) {
  EngineSettings settings;
  settings.checkStages = true;
  WorldEngine engine(settings);
  WorldInput input = bars(40, 7);
  StepResults results;
  uint most = 0;
  for (int i = 0; i < 25; ++i) {
    engine.begin(input, StepSettings());
    engine.finish(results);
    for (const auto& d : results.differences) FAIL() << "step " << i << ": " << textOf(d);
    input.poses.values = results.poses;
    input.velocities.values = results.velocities;
    input.activations.values = results.activations;
    input.clearChanges();
    most = std::max(most, results.counters.contactPoints);
  }
  EXPECT_GT(most, 60u) << "they have to touch for this to mean something";
}

}  // namespace
}  // namespace btgpu
