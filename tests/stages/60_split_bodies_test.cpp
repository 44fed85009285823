// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/60_split_bodies.h"

#include <algorithm>
#include <set>

#include "gpu_engine/stages/60_split_bodies_reference.h"
#include "tests/support/contact_scene.h"
#include "tests/support/device_test.h"
#include "tests/support/joint_scene.h"

namespace btgpu {
namespace {

class SplitBodiesTest : public DeviceTest {
 protected:
  struct Split {
    std::vector<SlotHeader> slots;
    std::vector<Joint> joints;
    std::vector<uint> copyFirst, slotFirst;
    StepCounters counters;
  };

  Split split(const ContactScene& scene, const JointScene& joints, const std::vector<uint>& solved, size_t slots) {
    const auto bench = benchForContacts(queue(), scene);
    DeviceWorld& world = bench->world();
    if (!joints.joints.empty()) {
      WorldInput input = scene.builder.finish();
      for (auto* changed : {&input.infos.changed, &input.born}) changed->clear();
      input = joints.addTo(input);
      world.upload(queue(), input);
      queue().finish();
      bench->write(world.jointSolved, solved);
    }
    writeConstraints(*bench, scene, slots);
    world.capacities.slots = slots;
    bench->run<SplitBodies>();
    const StepCounters counters = bench->counters();
    if (counters.overflow) return {{}, {}, {}, {}, counters};
    return {readSlots(*bench), bench->read(world.split.joints, joints.joints.size()),
            bench->read(world.split.copyFirst, world.bodyCount + 1), bench->read(world.slotFirst, COLOUR_TABLE),
            counters};
  }

  Split expectAsReference(const ContactScene& scene, const JointScene& joints = {}, std::vector<uint> solved = {}) {
    solved.resize(joints.joints.size(), 1);
    const Split s = split(scene, joints, solved, (scene.manifolds.size() + 31) / 32 * 32);
    const auto bench = benchForContacts(queue(), scene);
    const auto steps = bench->read(bench->world().steps, bench->world().bodyCount);
    const auto expected =
        splitBodiesReference(constraintsOf(scene, steps), scene.manifolds, steps, joints.joints, solved);
    EXPECT_EQ(s.counters.overflow, 0u);
    EXPECT_EQ(s.counters.serialCount, 0u);
    EXPECT_EQ(s.copyFirst, expected.copyFirst);
    EXPECT_EQ(s.slots.size(), expected.slots.size());
    for (size_t i = 0; i < s.slots.size() && i < expected.slots.size(); ++i) {
      EXPECT_TRUE(sameBits(s.slots[i], expected.slots[i])) << "slot " << i;
    }
    for (size_t j = 0; j < s.joints.size(); ++j) {
      EXPECT_TRUE(sameBits(s.joints[j], expected.joints[j])) << "joint " << j;
    }
    expectValid(scene, joints, s, steps);
    return s;
  }

  // Without the reference: each end has a copy of its own, of its own body, and there are no others.
  static void expectValid(const ContactScene& scene, const JointScene& joints, const Split& s,
                          const std::vector<BodyStep>& steps) {
    std::set<uint> taken;
    const auto expectOwn = [&](uint copy, uint body) {
      if (copy == NO_INDEX) return;
      ASSERT_TRUE(taken.insert(copy).second) << "copy " << copy << " of body " << body << " twice";
      ASSERT_GE(copy, s.copyFirst[body]);
      ASSERT_LT(copy, s.copyFirst[body + 1]);
    };
    for (const SlotHeader& h : s.slots) {
      if (h.manifold == NO_INDEX) continue;
      const Manifold& m = scene.manifolds[h.manifold];
      EXPECT_EQ(h.bodyA == NO_INDEX, steps[m.bodyA].angularVelocity.w == 0);
      EXPECT_EQ(h.bodyB == NO_INDEX, steps[m.bodyB].angularVelocity.w == 0);
      expectOwn(h.bodyA, m.bodyA);
      expectOwn(h.bodyB, m.bodyB);
    }
    for (size_t j = 0; j < s.joints.size(); ++j) {
      expectOwn(s.joints[j].bodyA, joints.joints[j].bodyA);
      if (s.joints[j].bodyB != s.joints[j].bodyA) expectOwn(s.joints[j].bodyB, joints.joints[j].bodyB);
    }
    EXPECT_EQ(taken.size(), s.copyFirst.back());
  }
};

ContactScene starOf(uint arms) {
  ContactScene scene;
  const int shape = scene.builder.sphere(0.5f);
  const uint hub = scene.builder.add(shape, {}, 16);
  for (uint i = 0; i < arms; ++i) {
    const uint other = scene.builder.add(shape, {float(i), 0, 0, 0}, i % 5 ? 1.0f : 0.0f);
    scene.addPoint(i % 2 ? scene.addManifold(hub, other) : scene.addManifold(other, hub), {0, 1, 0, 0}, 0, {}, {});
  }
  return scene;
}

TEST_F(SplitBodiesTest, NothingSmall) {
  ContactScene scene;
  scene.builder.add(scene.builder.sphere(1), {}, 1);
  const Split s = expectAsReference(scene);
  EXPECT_EQ(s.copyFirst, (std::vector<uint>{0, 0}));
  EXPECT_EQ(s.counters.colourCount, 0u);
}

TEST_F(SplitBodiesTest, StarSmall) {
  const Split s = expectAsReference(starOf(10));
  EXPECT_EQ(s.copyFirst[1], 10u) << "copies of the hub";
  EXPECT_EQ(s.slotFirst[1], 32u);
  EXPECT_EQ(s.slotFirst[COLOUR_SERIAL], s.slotFirst[COLOUR_SERIAL + 1]);
}

// No constraint is too many for a body.
TEST_F(SplitBodiesTest, Hundreds) {
  const Split s = expectAsReference(starOf(700));
  EXPECT_EQ(s.copyFirst[1], 700u);
  EXPECT_EQ(s.counters.serialCount, 0u);
}

// Joints that are asleep or have no rows need no copies; one of a body with itself needs one.
TEST_F(SplitBodiesTest, JointsSmall) {
  std::mt19937 random(1);
  ContactScene scene = starOf(4);
  JointScene joints;
  for (const auto& [a, b] : {std::pair{0u, 2u}, {0u, 3u}, {2u, NO_INDEX}, {3u, 3u}, {2u, 4u}}) {
    joints.add(a, b);
    joints.addRandomRow(random);
  }
  joints.joints[4].rowCount = 0;
  const Split s = expectAsReference(scene, joints, {1, 0, 1, 1, 1});
  EXPECT_NE(s.joints[0].bodyA, NO_INDEX);
  EXPECT_EQ(s.joints[1].bodyA, NO_INDEX) << "asleep";
  EXPECT_EQ(s.joints[3].bodyA, s.joints[3].bodyB);
  EXPECT_EQ(s.joints[4].bodyA, NO_INDEX) << "without rows";
}

TEST_F(SplitBodiesTest, RandomSmall) {
  std::mt19937 random(2);
  expectAsReference(randomContacts(random, {12, 33}));
}

TEST_F(SplitBodiesTest, Random) {
  std::mt19937 random(3);
  for (const uint manifolds : {64u, 3000u}) {
    const ContactScene scene = randomContacts(random, {400, manifolds});
    std::vector<bool> moves;
    for (uint i = 0; i < scene.builder.bodyCount(); ++i) {
      moves.push_back(ContactScene(scene).builder.mass(i).inverseInertiaLocal.w != 0);
    }
    expectAsReference(scene, randomJoints(random, moves, 300), {1, 1, 0, 0, 1});
  }
}

TEST_F(SplitBodiesTest, SlotOverflowSmall) {
  const Split s = split(starOf(40), {}, {}, 32);
  EXPECT_EQ(s.counters.overflow, OVERFLOW_SLOTS);
  EXPECT_EQ(s.counters.slotCount, 64u) << "what is needed";
}

}  // namespace
}  // namespace btgpu
