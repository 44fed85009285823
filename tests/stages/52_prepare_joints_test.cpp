// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/52_prepare_joints.h"

#include <cmath>
#include <limits>

#include "gpu_engine/joint_colours.h"
#include "gpu_engine/stages/10_apply_forces.h"
#include "gpu_engine/stages/52_prepare_joints_reference.h"
#include "tests/support/device_test.h"
#include "tests/support/joint_scene.h"
#include "tests/support/stage_bench.h"

namespace btgpu {
namespace {

class PrepareJointsTest : public DeviceTest {
 protected:
  std::vector<JointEffect> expectAsReference(const WorldBuilder& builder, const JointScene& scene) {
    StageBench bench(queue(), scene.addTo(builder.finish()));
    bench.run<ApplyForces>();
    DeviceWorld& world = bench.world();
    bench.poison(world.jointEffects);
    bench.poison(world.jointImpulses);
    bench.run<PrepareJoints>();
    const auto effects = bench.read(world.jointEffects, scene.rows.size());
    const auto impulses = bench.read(world.jointImpulses, scene.rows.size());
    const auto expected =
        prepareJointsReference(scene.joints, scene.rows, bench.read(world.steps, builder.bodyCount()));
    Contract contract("52_prepare_joints");
    checkPreparedJoints(contract, effects, impulses, expected);
    EXPECT_TRUE(contract.ok()) << contract.text();
    return effects;
  }
};

// A pull of two spheres of 2 and 4 mass units along x, which come apart with 3.
TEST_F(PrepareJointsTest, ByHandSmall) {
  WorldBuilder b;
  const int shape = b.sphere(1);
  const uint one = b.add(shape, {}, 2), two = b.add(shape, {3, 0, 0, 0}, 4);
  b.velocity(one).linear = {-1, 5, 0, 0};
  b.velocity(two).linear = {2, 0, 5, 0};
  b.forces(two).force = {4 * 60, 0, 0, 0};  // gains 1 in a step
  JointScene scene;
  scene.add(one, two);
  scene.addRow({1, 0, 0, 0}, {}, {-1, 0, 0, 0}, {}).linearA.w = 0.5f;
  const auto effects = expectAsReference(b, scene);
  EXPECT_FLOAT_EQ(effects[0].jac, 1 / (0.5f + 0.25f));
  EXPECT_FLOAT_EQ(effects[0].rhs, (0.5f + 4) / 0.75f);
  scene.joints[0].damping = 0.5f;
  EXPECT_FLOAT_EQ(expectAsReference(b, scene)[0].rhs, (0.5f + 2) / 0.75f);
}

// A row along which nothing yields, and rows that are no numbers, are not solved.
TEST_F(PrepareJointsTest, NothingToSolveSmall) {
  WorldBuilder b;
  const int shape = b.sphere(1);
  const uint body = b.add(shape, {}, 2);
  b.velocity(body).linear = {1, 1, 1, 0};
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  JointScene scene;
  scene.add(body, NO_INDEX);
  scene.addRow({}, {}, {1, 0, 0, 0}, {0, 1, 0, 0});  // held at the other end
  scene.addRow({nan, 0, 0, 0}, {}, {}, {});
  scene.addRow({1, 0, 0, 0}, {0, nan, 0, 0}, {}, {});
  scene.addRow({1, 0, 0, 0}, {}, {}, {}).linearA.w = inf;
  scene.addRow({1, 0, 0, 0}, {}, {}, {}).angularA.w = nan;
  scene.add(NO_INDEX, NO_INDEX);
  scene.addRow({1, 0, 0, 0}, {}, {-1, 0, 0, 0}, {});
  StageBench bench(queue(), scene.addTo(b.finish()));
  bench.run<ApplyForces>();
  bench.run<PrepareJoints>();
  for (const JointEffect& e : bench.read(bench.world().jointEffects, scene.rows.size())) {
    EXPECT_EQ(e.jac, 0);
    EXPECT_EQ(e.rhs, 0);
  }
}

TEST_F(PrepareJointsTest, RandomSmall) {
  std::mt19937 random(1);
  WorldBuilder b;
  RandomWorld what;
  what.bodies = 40;
  what.freeShare = what.staticShare = what.kinematicShare = what.planes = 0;
  b.addRandom(random, what);
  expectAsReference(b, randomJoints(random, std::vector<bool>(b.bodyCount(), true), 50));
}

TEST_F(PrepareJointsTest, Random) {
  std::mt19937 random(2);
  WorldBuilder b;
  RandomWorld what;
  what.bodies = 1001;
  what.freeShare = what.staticShare = what.kinematicShare = what.planes = 0;
  b.addRandom(random, what);
  for (uint i = 0; i < b.bodyCount(); ++i) b.forces(i) = {uniform3(random, -20, 20), uniform3(random, -5, 5)};
  std::vector<bool> moves(b.bodyCount(), true);
  for (uint i = 0; i < moves.size(); i += 7) moves[i] = false;
  expectAsReference(b, randomJoints(random, moves, 1500));
}

TEST_F(PrepareJointsTest, NothingAfterOverflowSmall) {
  WorldBuilder b;
  b.add(b.sphere(1), {}, 2);
  JointScene scene;
  scene.add(0, NO_INDEX);
  scene.addRow({1, 0, 0, 0}, {}, {}, {});
  StageBench bench(queue(), scene.addTo(b.finish()));
  StepCounters counters{};
  counters.overflow = OVERFLOW_PAIRS;
  bench.setCounters(counters);
  bench.poison(bench.world().jointEffects);
  bench.run<PrepareJoints>();
  EXPECT_TRUE(StageBench::isPoison(bench.read(bench.world().jointEffects, 1)[0]));
}

// ---- colours of joints, found on the host

void expectProperColours(const std::vector<Joint>& joints, uint bodies, const JointColours& colours) {
  std::vector<uint> times(joints.size(), 0);
  for (uint c = 0; c + 1 < colours.first.size(); ++c) {
    std::vector<uint> used(bodies, 0);
    for (uint i = colours.first[c]; i < colours.first[c + 1]; ++i) {
      const uint joint = colours.order[i];
      ++times[joint];
      EXPECT_TRUE(i == colours.first[c] || colours.order[i - 1] < joint) << "not ascending";
      if (c == colours.colourCount()) continue;  // the serial batch
      for (const uint body : {joints[joint].bodyA, joints[joint].bodyB}) {
        EXPECT_TRUE(body == NO_INDEX || used[body]++ == 0) << "body " << body << " twice in colour " << c;
      }
    }
  }
  for (size_t j = 0; j < joints.size(); ++j) {
    const bool moves = joints[j].bodyA != NO_INDEX || joints[j].bodyB != NO_INDEX;
    EXPECT_EQ(times[j], moves ? 1u : 0u) << "joint " << j;
  }
}

// As joints are solved: colour by colour.
std::vector<uint> positions(const std::vector<uint>& order) {
  std::vector<uint> position(order.size());
  for (uint i = 0; i < order.size(); ++i) position[order[i]] = i;
  return position;
}

bool shareBody(const Joint& a, const Joint& b) {
  const auto has = [&b](uint body) { return body != NO_INDEX && (body == b.bodyA || body == b.bodyB); };
  return has(a.bodyA) || has(a.bodyB);
}

// Each joint after all those of its bodies that come before it in Bullet's order.
void expectInOrder(const std::vector<Joint>& joints, uint bodies) {
  const JointColours colours = colourJoints(joints, bodies);
  expectProperColours(joints, bodies, colours);
  ASSERT_EQ(colours.order.size(), joints.size());
  const std::vector<uint> wanted = positions(orderOfJoints(joints, bodies)), position = positions(colours.order);
  for (uint i = 0; i < joints.size(); ++i) {
    for (uint j = 0; j < i; ++j) {
      if (!shareBody(joints[i], joints[j])) continue;
      EXPECT_EQ(position[j] < position[i], wanted[j] < wanted[i]) << j << ", " << i;
    }
  }
}

// Joints of one island that Bullet sorts end up in pieces, in which few have to wait for each other.
TEST(JointColours, ChainsKeepTheOrder) {
  for (const uint links : {1u, 2u, 9u, 16u, 17u, 100u, 1000u}) {
    JointScene scene;
    for (uint i = 0; i < links; ++i) scene.add(i, i + 1);
    SCOPED_TRACE(links);
    expectInOrder(scene.joints, links + 1);
    EXPECT_LE(colourJoints(scene.joints, links + 1).colourCount(), 7u);
  }
}

TEST(JointColours, KeepTheOrder) {
  std::mt19937 random(9);
  expectInOrder(randomJoints(random, std::vector<bool>(60, true), 40).joints, 60);
}

// By hand: quicksort around the middle element turns the three round that share an island; the joint without one comes
// first.
TEST(JointColours, OrderIsThatOfBulletsSort) {
  JointScene scene;
  for (uint i = 0; i < 3; ++i) scene.add(i, i + 1);
  EXPECT_EQ(orderOfJoints(scene.joints, 4), (std::vector<uint>{2, 1, 0}));
  scene.add(NO_INDEX, NO_INDEX);
  EXPECT_EQ(orderOfJoints(scene.joints, 4).front(), 3u);
}

// A net hangs together at too many places.
TEST(JointColours, LargeNetTakesFewColours) {
  constexpr uint kSide = 60;
  JointScene scene;
  for (uint y = 0; y < kSide; ++y) {
    for (uint x = 0; x < kSide; ++x) {
      if (x > 0) scene.add(y * kSide + x - 1, y * kSide + x);
      if (y > 0) scene.add((y - 1) * kSide + x, y * kSide + x);
    }
  }
  const JointColours colours = colourJoints(scene.joints, kSide * kSide);
  expectProperColours(scene.joints, kSide * kSide, colours);
  EXPECT_LE(colours.colourCount(), 7u);  // a greedy choice: a joint shares its bodies with six others
}

TEST(JointColours, BodiesThatAreHeldTakeNone) {
  JointScene scene;
  for (uint i = 0; i < 100; ++i) scene.add(i, NO_INDEX);
  scene.add(NO_INDEX, NO_INDEX);
  const JointColours colours = colourJoints(scene.joints, 100);
  expectProperColours(scene.joints, 100, colours);
  EXPECT_EQ(colours.colourCount(), 1u);
}

TEST(JointColours, HubNeedsTheSerialBatch) {
  JointScene scene;
  for (uint i = 1; i <= 70; ++i) scene.add(0, i);
  const JointColours colours = colourJoints(scene.joints, 71);
  expectProperColours(scene.joints, 71, colours);
  EXPECT_EQ(colours.colourCount(), static_cast<uint>(JOINT_COLOUR_LIMIT));
  EXPECT_EQ(colours.order.size() - colours.serialFirst(), 70u - JOINT_COLOUR_LIMIT);
}

TEST(JointColours, NoneAndRandom) {
  EXPECT_EQ(colourJoints({}, 0).colourCount(), 0u);
  std::mt19937 random(4);
  std::vector<bool> moves(200, true);
  for (size_t i = 0; i < moves.size(); i += 5) moves[i] = false;
  const JointScene scene = randomJoints(random, moves, 900);
  expectProperColours(scene.joints, 200, colourJoints(scene.joints, 200));
}

// Every joint with rows is in one lane of a block of its colour; those with most rows come first, and a block has room
// for the rows of its first one.
TEST(JointBlocks, HoldEachJointOnce) {
  std::mt19937 random(5);
  JointScene scene = randomJoints(random, std::vector<bool>(90, true), 150);
  for (uint i = 1; i < 80; ++i) scene.add(0, i).rowCount = 3;  // a hub: the serial batch
  const JointColours colours = colourJoints(scene.joints, 90);
  const JointBlocks blocks = blocksOf(colours, scene.joints);
  ASSERT_EQ(blocks.colours[0], colours.colourCount());
  ASSERT_EQ(blocks.colours.size(), colours.colourCount() + 2u);
  ASSERT_EQ(blocks.lanes.size(), JOINT_LANES * (blocks.rows.size() - 1));
  ASSERT_LT(colours.serialFirst(), colours.order.size());
  std::vector<uint> seen;
  for (uint c = 0; c < colours.colourCount(); ++c) {
    uint most = ~0u;
    for (uint block = blocks.colours[c + 1]; block < blocks.colours[c + 2]; ++block) {
      for (uint lane = 0; lane < JOINT_LANES; ++lane) {
        const uint j = blocks.lanes[block * JOINT_LANES + lane];
        if (j == NO_INDEX) continue;
        const auto first = colours.order.begin() + colours.first[c],
                   last = colours.order.begin() + colours.first[c + 1];
        EXPECT_NE(std::find(first, last, j), last) << "joint " << j << " is of another colour than " << c;
        EXPECT_LE(scene.joints[j].rowCount, most);
        EXPECT_LE(scene.joints[j].rowCount, blocks.rows[block + 1] - blocks.rows[block]);
        most = scene.joints[j].rowCount;
        seen.push_back(j);
      }
    }
  }
  std::vector<uint> wanted;
  for (uint i = 0; i < colours.serialFirst(); ++i) {
    if (scene.joints[colours.order[i]].rowCount > 0) wanted.push_back(colours.order[i]);
  }
  std::sort(seen.begin(), seen.end());
  std::sort(wanted.begin(), wanted.end());
  EXPECT_EQ(seen, wanted);
}

}  // namespace
}  // namespace btgpu
