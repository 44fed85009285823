// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/44_find_separating_axis.h"

#include <BulletCollision/CollisionDispatch/btBoxBoxDetector.h>

#include "gpu_engine/stages/44_find_separating_axis_reference.h"
#include "tests/support/box_pairs.h"
#include "tests/support/bullet_convert.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"

namespace btgpu {
namespace {

using reference::dot;
using reference::toVec;

struct Outcome {
  std::vector<SeparatingAxis> axes;
  std::vector<RawContacts> contacts;
};

class FindSeparatingAxisTest : public DeviceTest {
 protected:
  Outcome device(const PairWorld& p, size_t spare = 5, uint overflow = 0) {
    StageBench bench = benchForPairs(queue(), p, spare);
    DeviceWorld& w = bench.world();
    w.axes.resize(queue(), w.capacities.pairs);
    bench.poison(w.axes);
    bench.poison(w.contacts);
    bench.setOverflow(overflow);
    bench.run<FindSeparatingAxis>();
    Outcome out{bench.read(w.axes), bench.read(w.contacts)};
    const size_t boxPairs = overflow ? 0 : boxPairsOf(p);
    for (size_t k = boxPairs; k < out.axes.size(); ++k) EXPECT_TRUE(StageBench::isPoison(out.axes[k])) << k;
    out.axes.resize(boxPairs);
    return out;
  }

  static size_t boxPairsOf(const PairWorld& p) {
    return static_cast<size_t>(
        std::count_if(p.pairs.begin(), p.pairs.end(), [](const Pair& q) { return q.bucket == BUCKET_BOX_BOX; }));
  }

  // Returns how many pairs had more than one acceptable axis.
  size_t expectAsReference(const PairWorld& p, size_t spare = 5) {
    const Outcome out = device(p, spare);
    RawContacts poison;
    std::memset(static_cast<void*>(&poison), StageBench::kPoison, sizeof poison);
    Contract contract("44_find_separating_axis");
    checkSeparatingAxes(contract, arraysOf(p), out.axes, std::vector<RawContacts>(p.pairs.size(), poison),
                        out.contacts);
    EXPECT_TRUE(contract.ok()) << contract.text();
    return static_cast<size_t>(std::count_if(p.pairs.begin(), p.pairs.end(), [&](const Pair& pair) {
      return pair.bucket == BUCKET_BOX_BOX && isAmbiguousAxis(projectionsOf(p, pair), pairSize(p, pair));
    }));
  }
};

TEST_F(FindSeparatingAxisTest, HandMadeSmall) {
  const PairWorld p = exactBoxPairs();
  expectAsReference(p);
  const Outcome out = device(p);
  const auto axisOf = [&](uint k) { return out.axes[k < kOtherBucket ? k : k - 1]; };
  const auto expect = [&](ExactBoxPair k, int code, float4 normalAndDepth) {
    EXPECT_EQ(axisOf(k).code, code) << "pair " << k;
    EXPECT_LE(sizeOf(axisOf(k).normal - normalAndDepth), 1e-6f) << "pair " << k;
    // An edge axis is widened by kEdgeSlack times the four half extents that lie across the edges.
    EXPECT_NEAR(axisOf(k).normal.w, normalAndDepth.w, code < 6 ? 2e-6f : 4e-5f + 2e-6f) << "pair " << k;
  };
  expect(kSameCube, 0, {1, 0, 0, 2});
  expect(kTouchingFaces, 2, {0, 0, 1, 0});
  EXPECT_EQ(axisOf(kOneUlpApart).code, -1);
  expect(kTouchingEdges, 0, {-1, 0, 0, 0});
  expect(kTouchingCorner, 0, {-1, 0, 0, 0});
  expect(kStacked, 1, {0, 1, 0, 0.25f});
  expect(kOverhanging, 1, {0, 1, 0, 0.25f});
  expect(kStackedTurned, 1, {0, -1, 0, 0.25f});
  expect(kThinOnThin, 1, {0, 1, 0, 1e-3f});
  expect(kEdgeOnEdge, 8, {0, 1, 0, 0.25f});
  EXPECT_EQ(axisOf(kEdgeOverEdge).code, -1);
  expect(kDiamondOnTop, 1, {0, 1, 0, 0.25f});
  EXPECT_EQ(axisOf(kFarApart).code, -1);
}

TEST_F(FindSeparatingAxisTest, NoBoxPairsSmall) {
  PairWorld p;
  const int ball = p.world.sphere(1);
  EXPECT_TRUE(device(p).axes.empty());
  for (int k = 0; k < 5; ++k) p.add(ball, at(0, 0, 0), ball, at(1, 0, 0));
  expectAsReference(p);
}

TEST_F(FindSeparatingAxisTest, NothingAfterAnOverflowSmall) {
  const Outcome out = device(exactBoxPairs(), 5, OVERFLOW_PAIRS);
  for (const RawContacts& raw : out.contacts) EXPECT_TRUE(StageBench::isPoison(raw));
}

TEST_F(FindSeparatingAxisTest, EachKindOfPose) {
  std::mt19937 random(1);
  for (const BoxPose kind : {BoxPose::Anyhow, BoxPose::Resting, BoxPose::Aligned, BoxPose::Crossed, BoxPose::Thin}) {
    PairWorld p;
    for (int k = 0; k < 500; ++k) addRandomBoxPair(random, p, kind);
    SCOPED_TRACE(static_cast<int>(kind));
    const size_t ambiguous = expectAsReference(p);
    // Where all axes are parallel, or nearly so, each face of A has one of B that is as good.
    if (kind == BoxPose::Anyhow || kind == BoxPose::Crossed || kind == BoxPose::Thin) { EXPECT_LT(ambiguous, 25u); }
    const std::vector<SeparatingAxis> axes = device(p).axes;
    const auto overlapping = std::count_if(axes.begin(), axes.end(), [](const auto& axis) { return axis.code >= 0; });
    EXPECT_GT(overlapping, 100);
    EXPECT_LT(overlapping, 499);
  }
}

TEST_F(FindSeparatingAxisTest, NearlyParallelEdgesNeverSeparateOrWin) {
  // Without the widening of edge axes, rounding would separate some of these, whose faces overlap by 1e-3.
  std::mt19937 random(5);
  PairWorld p;
  for (int k = 0; k < 2000; ++k) {
    const float4 a = uniform3(random, 1, 10), b = uniform3(random, 1, 10);
    const float tilt = std::pow(10.0f, uniform(random, -7, -4));
    const float4 axis = uniform3(random, -1, 1);
    float4 place = uniform3(random, -1, 1);
    place.y = a.y + b.y - 1e-3f;
    // B's lowest corner is deeper by the tilt times its width: at most 1e-4 * 10 * sqrt(2).
    const float4 base = randomTurn(random);
    p.add(p.world.box(a), at(0, 0, 0, base), p.world.box(b),
          {turned(base, place), turnProduct(base, turnAbout(axis, tilt))});
  }
  const auto axes = device(p).axes;
  for (size_t k = 0; k < axes.size(); ++k) {
    // Codes 6, 10 and 14 are those of the parallel edges; crossing ones may win, between two tilted faces.
    EXPECT_TRUE(axes[k].code >= 0 && (axes[k].code < 6 || (axes[k].code - 6) % 4 != 0)) << k << ": " << axes[k].code;
    EXPECT_NEAR(axes[k].normal.w, 1e-3f, 1.5e-3f) << k;
  }
}

TEST_F(FindSeparatingAxisTest, RandomSmall) {
  std::mt19937 random(2);
  expectAsReference(randomBoxPairs(random, 24));
}

TEST_F(FindSeparatingAxisTest, RandomOfAllCounts) {
  std::mt19937 random(3);
  for (const size_t count : {1u, 31u, 32u, 127u, 128u, 129u, 1500u}) {
    SCOPED_TRACE(count);
    expectAsReference(randomBoxPairs(random, count), count % 2);
  }
}

// The reference itself against dBoxBox2, through btBoxBoxDetector.
struct DeepestPoint : btDiscreteCollisionDetectorInterface::Result {
  btVector3 normal;
  btScalar distance = 1;
  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normalOnB, const btVector3&, btScalar depth) override {
    normal = normalOnB;
    distance = btMin(distance, depth);
  }
};

TEST(FindSeparatingAxisReference, AgreesWithBullet) {
  std::mt19937 random(4);
  const PairWorld p = randomBoxPairs(random, 2000);
  size_t separated = 0, faces = 0, edges = 0;
  for (const Pair& pair : p.pairs) {
    if (pair.bucket != BUCKET_BOX_BOX || isAmbiguousAxis(projectionsOf(p, pair), pairSize(p, pair))) continue;
    const SeparatingAxis axis = separatingAxisReference(p.shapeOf(pair.bodyA), p.world.pose(pair.bodyA),
                                                        p.shapeOf(pair.bodyB), p.world.pose(pair.bodyB));
    const btBoxShape a(toBullet(p.shapeOf(pair.bodyA).extents)), b(toBullet(p.shapeOf(pair.bodyB).extents));
    btDiscreteCollisionDetectorInterface::ClosestPointInput input;
    input.m_transformA = toBullet({{}, p.world.pose(pair.bodyA).orientation});
    input.m_transformB = toBullet({p.bFromA(pair), p.world.pose(pair.bodyB).orientation});
    DeepestPoint bullet;
    btBoxBoxDetector detector(&a, &b);
    detector.getClosestPoints(input, bullet, nullptr);
    if (axis.code < 0) {
      EXPECT_EQ(bullet.distance, 1);
      ++separated;
      continue;
    }
    ++(axis.code < 6 ? faces : edges);
    // A face's deepest corner may lie beside the face, and then it is cut off.
    ASSERT_LT(bullet.distance, 1) << "Bullet finds no contact";
    const auto code = static_cast<size_t>(axis.code);
    const AxisProjection chosen = projectionsOf(p, pair)[code];
    const double error = axisError(chosen, code, pairSize(p, pair));
    EXPECT_GE(bullet.distance, -axis.normal.w - error);
    EXPECT_TRUE(axis.code < 6 || std::fabs(bullet.distance + axis.normal.w) <= error);
    EXPECT_LE((bullet.normal + toBullet(axis.normal)).length(), 2 * kBoxTolerance / chosen.sine);
  }
  EXPECT_GT(separated, 100u);
  EXPECT_GT(faces, 100u);
  EXPECT_GT(edges, 100u);
}

}  // namespace
}  // namespace btgpu
