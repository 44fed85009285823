// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/60_batch_constraints.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "gpu_engine/stages/60_batch_constraints_reference.h"
#include "kernels/lib/batches.h"
#include "tests/support/contact_scene.h"
#include "tests/support/device_test.h"

namespace btgpu {
namespace {

class BatchConstraintsTest : public DeviceTest {
 protected:
  struct Batches {
    std::vector<uint> split, groupBatches, batchFirst, slotFirst;
    std::vector<SlotHeader> slots;
    StepCounters counters;
  };

  Batches batch(const ContactScene& scene, GroupSplit by, size_t slots) {
    const auto bench = benchForContacts(queue(), scene);
    DeviceWorld& world = bench->world();
    writeConstraints(*bench, scene, slots);
    world.capacities.slots = slots;
    StepSettings settings = scene.settings;
    settings.groupSplit = by;
    bench->run<BatchConstraints>(settings);
    const StepCounters counters = bench->counters();
    if (counters.overflow) return {{}, {}, {}, {}, {}, counters};
    return {bench->read(world.batches.split),
            bench->read(world.batches.groupBatches),
            bench->read(world.batches.batchFirst),
            bench->read(world.slotFirst, COLOUR_TABLE),
            readSlots(*bench),
            counters};
  }

  // Both splits.
  void expectAsReference(const ContactScene& scene) {
    for (const GroupSplit by : {GroupSplit::Space, GroupSplit::Index}) {
      SCOPED_TRACE(by == GroupSplit::Space ? "by space" : "by index");
      expectAsReference(scene, by);
    }
  }

  Batches expectAsReference(const ContactScene& scene, GroupSplit by) {
    const Batches b = batch(scene, by, BATCH_BLOCK * scene.manifolds.size() + 2 * BTGPU_LANES);
    const WorldInput input = scene.builder.finish();
    const auto bench = benchForContacts(queue(), scene);
    const auto steps = bench->read(bench->world().steps, input.bodyCount);
    const std::vector<uint> constraints = constraintsOf(scene, steps);
    const auto expected = batchConstraintsReference(splitForGroups(by, input.bodyCount), constraints, scene.manifolds,
                                                    steps, input.poses.values);
    EXPECT_EQ(b.counters.overflow, 0u);
    EXPECT_EQ(b.counters.colourCount, expected.batchCount);
    EXPECT_EQ(b.counters.serialCount, expected.serialCount);
    EXPECT_EQ(b.groupBatches, expected.groupBatches);
    EXPECT_EQ(b.batchFirst, expected.batchFirst);
    EXPECT_EQ(b.slots.size(), expected.slots.size());
    EXPECT_EQ(b.slotFirst[COLOUR_SERIAL], expected.serialFirst);
    EXPECT_EQ(b.slotFirst[COLOUR_SERIAL + 1], expected.end);
    for (size_t s = 0; s < expected.slots.size() && s < b.slots.size(); ++s) {
      EXPECT_TRUE(sameBits(b.slots[s], expected.slots[s])) << "slot " << s;
      if (HasFailure()) return b;
    }
    expectValid(b, constraints);
    return b;
  }

  // What any two-level batching must fulfil, without the reference.
  static void expectValid(const Batches& b, const std::vector<uint>& constraints) {
    std::vector<uint> found;
    const uint phases = b.split[SPLIT_PHASES], groups = b.split[SPLIT_GROUPS];
    for (uint phase = 0; phase < phases; ++phase) {
      std::map<uint, uint> groupOf;  // of the phase, by body
      for (uint group = phase * groups; group < (phase + 1) * groups; ++group) {
        for (uint batch = 0; batch < BATCH_LIMIT; ++batch) {
          const uint first = b.batchFirst[group * BATCH_LIMIT + batch];
          const uint end = b.batchFirst[group * BATCH_LIMIT + batch + 1];
          EXPECT_EQ(first % BATCH_BLOCK, 0u);
          std::set<uint> moved;
          for (uint s = first; s < end; ++s) {
            const SlotHeader& h = b.slots[s];
            if (h.manifold == NO_INDEX) continue;
            EXPECT_LT(batch, b.groupBatches[group]) << "would never be solved";
            found.push_back(h.manifold);
            for (const uint body : {h.bodyA, h.bodyB}) {
              if (body == NO_INDEX) continue;
              ASSERT_TRUE(moved.insert(body).second) << "body " << body << " twice in a batch of group " << group;
              ASSERT_EQ(groupOf.emplace(body, group).first->second, group)
                  << "body " << body << " in two groups of phase " << phase;
            }
          }
        }
      }
    }
    for (uint s = b.slotFirst[COLOUR_SERIAL]; s < b.slotFirst[COLOUR_SERIAL + 1]; ++s)
      found.push_back(b.slots[s].manifold);
    for (size_t s = b.slotFirst[COLOUR_SERIAL + 1]; s < b.slots.size(); ++s) EXPECT_EQ(b.slots[s].manifold, NO_INDEX);
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, constraints) << "each constraint once";
  }
};

uint addSphere(ContactScene& scene, float4 position, float mass = 1) {
  return scene.builder.add(scene.builder.sphere(0.5f), position, mass);
}

void touch(ContactScene& scene, uint a, uint b) {
  scene.addPoint(scene.addManifold(a, b), {0, 1, 0, 0}, 0, {0, 0.5f, 0, 0}, {0, -0.5f, 0, 0});
}

// Spheres on a grid, each touching its next neighbours and the ground.
ContactScene block(int x, int y, int z) {
  ContactScene scene;
  const uint ground = addSphere(scene, {}, 0);
  const auto at = [&](int i, int j, int k) { return 1 + static_cast<uint>((j * z + k) * x + i); };
  for (int j = 0; j < y; ++j) {
    for (int k = 0; k < z; ++k) {
      for (int i = 0; i < x; ++i) addSphere(scene, {float(i) - 3, float(j), float(k) - 2, 0});
    }
  }
  for (int j = 0; j < y; ++j) {
    for (int k = 0; k < z; ++k) {
      for (int i = 0; i < x; ++i) {
        if (i > 0) touch(scene, at(i - 1, j, k), at(i, j, k));
        if (j > 0) touch(scene, at(i, j, k), at(i, j - 1, k));
        if (k > 0) touch(scene, at(i, j, k - 1), at(i, j, k));
        if (j == 0) touch(scene, ground, at(i, j, k));
      }
    }
  }
  return scene;
}

TEST_F(BatchConstraintsTest, NoneSmall) {
  ContactScene scene;
  addSphere(scene, {});
  expectAsReference(scene);
}

TEST_F(BatchConstraintsTest, TriangleSmall) {
  ContactScene scene;
  for (int i = 0; i < 3; ++i) addSphere(scene, {float(i), 0, 0, 0});
  touch(scene, 0, 1);
  touch(scene, 1, 2);
  touch(scene, 2, 0);
  expectAsReference(scene);
}

TEST_F(BatchConstraintsTest, BlockSmall) { expectAsReference(block(4, 2, 3)); }

// Many groups in each phase: cells repeat, sets pair up.
TEST_F(BatchConstraintsTest, Block) {
  const ContactScene scene = block(16, 12, 14);
  for (const GroupSplit by : {GroupSplit::Space, GroupSplit::Index}) {
    const Batches b = expectAsReference(scene, by);
    EXPECT_GT(b.split[SPLIT_GROUPS], 1u);
    std::set<uint> used;
    for (uint g = 0; g < b.groupBatches.size(); ++g) {
      if (b.groupBatches[g] > 0) used.insert(g / b.split[SPLIT_GROUPS]);
    }
    // By index: what lies behind or above another has the same low bits here, what lies beside it differs by 1, 3 or 7.
    EXPECT_GE(used.size(), by == GroupSplit::Space ? 8u : 4u) << "phases";
    EXPECT_LE(b.counters.colourCount, 16u) << "six neighbours each, and a few that share cells of the table";
  }
}

// Bodies that share a cell of the table of marks are never in one batch, and get one all the same.
TEST_F(BatchConstraintsTest, SharedMarksSmall) {
  std::vector<uint> sharing;
  for (uint i = 1; sharing.size() < 3; ++i) {
    if (markCell(i) == markCell(0)) sharing.push_back(i);
  }
  ContactScene scene;
  while (scene.builder.bodyCount() <= sharing.back()) addSphere(scene, {}, 1);
  const uint ground = addSphere(scene, {}, 0);
  for (const uint body : {0u, sharing[0], sharing[1], sharing[2], 1u}) touch(scene, body, ground);
  const Batches b = expectAsReference(scene, GroupSplit::Space);
  EXPECT_EQ(b.counters.colourCount, 4u);
}

// A body with more constraints than a group has batches: the rest is solved one after the other.
ContactScene starOf(uint arms) {
  ContactScene scene;
  const uint hub = addSphere(scene, {}, 16);
  for (uint i = 0; i < arms; ++i) {
    const uint other = addSphere(scene, {float(i % 7) / 4, float(i % 5) / 4, 0, 0});
    touch(scene, i % 2 ? hub : other, i % 2 ? other : hub);
  }
  return scene;
}

TEST_F(BatchConstraintsTest, StarSmall) { expectAsReference(starOf(70)); }

TEST_F(BatchConstraintsTest, Hundreds) {
  const Batches b = expectAsReference(starOf(500), GroupSplit::Space);
  EXPECT_GT(b.counters.serialCount, 0u);
  expectAsReference(starOf(500), GroupSplit::Index);
}

// Constraints longer than the cells, and places that no grid has.
TEST_F(BatchConstraintsTest, FarSmall) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  ContactScene scene = block(4, 2, 3);
  const uint last = scene.builder.bodyCount() - 1;
  const uint far = addSphere(scene, {1e6f, -1e6f, 0, 0}), off = addSphere(scene, {3e38f, 0, -3e38f, 0});
  const uint lost = addSphere(scene, {std::numeric_limits<float>::quiet_NaN(), 0, kInfinity, 0});
  for (const uint body : {far, off, lost}) {
    touch(scene, body, last);
    touch(scene, 1, body);
  }
  touch(scene, off, lost);
  touch(scene, far, 0);
  expectAsReference(scene);
}

TEST_F(BatchConstraintsTest, RandomSmall) {
  std::mt19937 random(1);
  expectAsReference(randomContacts(random, {40, 90}));
}

TEST_F(BatchConstraintsTest, Random) {
  std::mt19937 random(2);
  expectAsReference(randomContacts(random, {300, 1000}));
  expectAsReference(randomContacts(random, {3000, 9000}));
}

TEST_F(BatchConstraintsTest, SlotOverflowSmall) {
  const ContactScene scene = block(4, 2, 3);
  const uint needed = expectAsReference(scene, GroupSplit::Space).counters.slotCount;
  EXPECT_EQ(batch(scene, GroupSplit::Space, needed).counters.overflow, 0u) << "just enough";
  const Batches b = batch(scene, GroupSplit::Space, needed - BTGPU_LANES);
  EXPECT_EQ(b.counters.overflow, OVERFLOW_SLOTS);
  EXPECT_EQ(b.counters.slotCount, needed) << "what is needed";
}

}  // namespace
}  // namespace btgpu
