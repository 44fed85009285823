// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/46_clip_faces.h"

#include <BulletCollision/CollisionDispatch/btBoxBoxDetector.h>

#include <algorithm>

#include "gpu_engine/stages/44_find_separating_axis_reference.h"
#include "gpu_engine/stages/46_clip_faces_reference.h"
#include "tests/support/box_pairs.h"
#include "tests/support/bullet_convert.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"

namespace btgpu {
namespace {

using reference::dot;
using reference::toVec;
using reference::Vec;

// What stage 44 would have left, by the reference: one axis a position in the bucket.
struct Axes {
  std::vector<SeparatingAxis> axes;
  std::vector<uint> pairOf;  // the pair at each position

  size_t overlapping() const {
    return static_cast<size_t>(std::count_if(axes.begin(), axes.end(), [](const auto& a) { return a.code >= 0; }));
  }
};

Axes axesOf(const PairWorld& p) {
  Axes out;
  for (uint i = 0; i < p.pairs.size(); ++i) {
    const Pair& pair = p.pairs[i];
    if (pair.bucket != BUCKET_BOX_BOX) continue;
    out.axes.push_back(separatingAxisReference(p.shapeOf(pair.bodyA), p.world.pose(pair.bodyA), p.shapeOf(pair.bodyB),
                                               p.world.pose(pair.bodyB)));
    out.pairOf.push_back(i);
  }
  return out;
}

std::vector<CandidatePoint> referencePoints(const PairWorld& p, const Pair& pair, const SeparatingAxis& axis) {
  return clipBoxesReference(p.shapeOf(pair.bodyA), p.world.pose(pair.bodyA), p.shapeOf(pair.bodyB),
                            p.world.pose(pair.bodyB), axis);
}

class ClipFacesTest : public DeviceTest {
 protected:
  std::vector<RawContacts> device(const PairWorld& p, const Axes& axes, uint overflow = 0, size_t spare = 5) {
    StageBench bench = benchForPairs(queue(), p, spare);
    DeviceWorld& w = bench.world();
    w.axes.resize(queue(), w.capacities.pairs);
    bench.poison(w.axes);
    bench.write(w.axes, axes.axes);
    bench.poison(w.contacts);
    bench.setOverflow(overflow);
    bench.run<ClipFaces>();
    return bench.read(w.contacts);
  }

  void expectAsReference(const PairWorld& p, const Axes& axes, size_t spare = 5) {
    const auto contacts = device(p, axes, 0, spare);
    RawContacts poison;
    std::memset(static_cast<void*>(&poison), StageBench::kPoison, sizeof poison);
    Contract contract("46_clip_faces");
    checkClippedFaces(contract, arraysOf(p), axes.axes, std::vector<RawContacts>(p.pairs.size(), poison), contacts);
    EXPECT_TRUE(contract.ok()) << contract.text();
    for (size_t i = p.pairs.size(); i < contacts.size(); ++i) EXPECT_TRUE(StageBench::isPoison(contacts[i])) << i;
  }
};

TEST_F(ClipFacesTest, HandMadeSmall) {
  const PairWorld p = exactBoxPairs();
  const Axes axes = axesOf(p);
  expectAsReference(p, axes);
  const auto raw = device(p, axes);
  const auto countBelow = [&](ExactBoxPair k, float distance) {
    return std::count_if(raw[k].points, raw[k].points + raw[k].count, [&](float4 q) { return q.w <= distance; });
  };
  EXPECT_EQ(raw[kSameCube].count, 4);
  EXPECT_EQ(countBelow(kSameCube, -2), 4);
  EXPECT_EQ(raw[kTouchingFaces].count, 4);
  EXPECT_EQ(countBelow(kTouchingFaces, -1e-6f), 0);
  EXPECT_GE(raw[kTouchingEdges].count, 2);  // a face without area: each end may come twice
  EXPECT_GE(raw[kTouchingCorner].count, 1);
  EXPECT_EQ(raw[kStacked].count, 4);
  EXPECT_EQ(countBelow(kStacked, -0.25f), 4);
  EXPECT_EQ(raw[kOverhanging].count, 4);
  for (int k = 0; k < raw[kOverhanging].count; ++k) EXPECT_LE(raw[kOverhanging].points[k].x, 4.0f);
  EXPECT_EQ(raw[kStackedTurned].count, 4);
  EXPECT_EQ(raw[kThinOnThin].count, 4);
  EXPECT_EQ(raw[kEdgeOnEdge].count, 1);
  EXPECT_NEAR(raw[kEdgeOnEdge].points[0].x, 0.25f, 1e-5f);  // B's lower edge runs along z above x = 0.25
  EXPECT_NEAR(raw[kEdgeOnEdge].points[0].z, 0, 1e-5f);      // A's upper one along x at z = 0
  EXPECT_NEAR(raw[kEdgeOnEdge].points[0].y, std::sqrt(2.0f) - 0.25f, 1e-5f);
  EXPECT_EQ(raw[kDiamondOnTop].count, 2);
  EXPECT_EQ(countBelow(kDiamondOnTop, -0.25f + 1e-5f), 2);
}

TEST_F(ClipFacesTest, EightCornersSmall) {
  // A square over a square turned by 45 degrees: an octagon.
  PairWorld p;
  const int slab = p.world.box({1, 0.5f, 1, 0});
  p.add(slab, at(0, 0, 0), slab, at(0, 0.9375f, 0, turnAbout({0, 1, 0, 0}, 0.78539816f)));
  p.add(slab, at(0, 0, 0, turnAbout({0, 1, 0, 0}, 0.78539816f)), slab, at(0, -0.9375f, 0));
  const Axes axes = axesOf(p);
  expectAsReference(p, axes);
  for (const uint i : {0u, 1u}) EXPECT_EQ(device(p, axes)[i].count, 8);
}

TEST_F(ClipFacesTest, OnlyOverlappingPairsAreWrittenSmall) {
  std::mt19937 random(1);
  const PairWorld p = randomBoxPairs(random, 30);
  Axes axes = axesOf(p);
  ASSERT_GT(axes.overlapping(), 5u);
  for (size_t k = 0; k < axes.axes.size(); k += 2) axes.axes[k].code = -1;
  expectAsReference(p, axes);
  for (SeparatingAxis& axis : axes.axes) axis.code = -1;
  expectAsReference(p, axes);
}

TEST_F(ClipFacesTest, NothingAfterAnOverflowSmall) {
  const PairWorld p = exactBoxPairs();
  for (const RawContacts& raw : device(p, axesOf(p), OVERFLOW_PAIRS)) EXPECT_TRUE(StageBench::isPoison(raw));
}

TEST_F(ClipFacesTest, EachKindOfPose) {
  std::mt19937 random(2);
  for (const BoxPose kind : {BoxPose::Anyhow, BoxPose::Resting, BoxPose::Aligned, BoxPose::Crossed, BoxPose::Thin}) {
    PairWorld p;
    for (int k = 0; k < 600; ++k) addRandomBoxPair(random, p, kind);
    SCOPED_TRACE(static_cast<int>(kind));
    const Axes axes = axesOf(p);
    EXPECT_GT(axes.overlapping(), 100u);
    expectAsReference(p, axes);
  }
}

TEST_F(ClipFacesTest, RandomOfAllCounts) {
  std::mt19937 random(3);
  for (const size_t count : {1u, 31u, 32u, 127u, 128u, 129u, 1500u}) {
    SCOPED_TRACE(count);
    const PairWorld p = randomBoxPairs(random, count);
    expectAsReference(p, axesOf(p), count % 2);
  }
}

// The reference itself against dBoxBox2, through btBoxBoxDetector: its points (the best four) are among ours,
// and its deepest is our deepest.
struct BulletPoints : btDiscreteCollisionDetectorInterface::Result {
  std::vector<std::pair<btVector3, btScalar>> points;
  btVector3 normal;
  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normalOnB, const btVector3& pointOnB, btScalar depth) override {
    normal = normalOnB;
    points.push_back({pointOnB, depth});
  }
};

TEST(ClipFacesReference, AgreesWithBullet) {
  std::mt19937 random(4);
  const PairWorld p = randomBoxPairs(random, 3000);
  const Axes axes = axesOf(p);
  size_t faces = 0, edges = 0;
  for (size_t position = 0; position < axes.axes.size(); ++position) {
    const Pair& pair = p.pairs[axes.pairOf[position]];
    const SeparatingAxis& axis = axes.axes[position];
    if (axis.code < 0) continue;
    const btBoxShape a(toBullet(p.shapeOf(pair.bodyA).extents)), b(toBullet(p.shapeOf(pair.bodyB).extents));
    btDiscreteCollisionDetectorInterface::ClosestPointInput input;
    input.m_transformA = toBullet({{}, p.world.pose(pair.bodyA).orientation});
    input.m_transformB = toBullet({p.bFromA(pair), p.world.pose(pair.bodyB).orientation});
    BulletPoints bullet;
    btBoxBoxDetector detector(&a, &b);
    detector.getClosestPoints(input, bullet, nullptr);
    if (hasTwoFeatures(p.world.pose(pair.bodyA), p.world.pose(pair.bodyB), axis) ||
        isAmbiguousAxis(projectionsOf(p, pair), pairSize(p, pair)))
      continue;
    ++(axis.code < 6 ? faces : edges);

    EXPECT_FALSE(bullet.points.empty());
    const auto expected = referencePoints(p, pair, axis);
    const double size = pairSize(p, pair);
    double deepest = 0, bulletsDeepest = 0;
    for (const CandidatePoint& e : expected) deepest = std::min(deepest, e.distance);
    for (const auto& point : bullet.points) {
      bulletsDeepest = std::min<double>(bulletsDeepest, point.second);
      bool found = false;
      for (const CandidatePoint& e : expected) {
        const double sine = axis.code < 6 ? e.sine : e.sine * e.sine;
        const double error = (2 * kBoxTolerance + (axis.code < 6 ? 0 : kEdgeSlack)) * size / sine;
        const Vec at{point.first.x(), point.first.y(), point.first.z()};
        found = found || (length(at - e.onB) <= error && std::fabs(point.second - e.distance) <= error);
      }
      EXPECT_TRUE(found) << "code " << axis.code << " at " << point.second;
    }
    EXPECT_NEAR(deepest, bulletsDeepest, (2 * kBoxTolerance + (axis.code < 6 ? 0 : 2 * kEdgeSlack)) * size);
  }
  EXPECT_GT(faces, 500u);
  EXPECT_GT(edges, 100u);
}

}  // namespace
}  // namespace btgpu
