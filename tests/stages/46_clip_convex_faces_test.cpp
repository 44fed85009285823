// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/46_clip_convex_faces.h"

#include "gpu_engine/stages/44_find_closest_features.h"
#include "gpu_engine/stages/46_clip_convex_faces_reference.h"
#include "tests/support/convex_pairs.h"
#include "tests/support/device_test.h"
#include "tests/support/stage_bench.h"

namespace btgpu {
namespace {

using namespace reference;

class ClipConvexFacesTest : public DeviceTest {
 protected:
  // Stages 44 and 46 on the pairs; contacts by pair. The axes go to `closest`, by position.
  std::vector<RawContacts> device(const PairWorld& p, std::vector<ClosestFeatures>* closest = nullptr,
                                  uint overflow = 0) {
    StageBench bench = benchForPairs(queue(), p, m_spare);
    bench.run<FindClosestFeatures>();
    if (overflow) bench.poison(bench.world().contacts);
    bench.setOverflow(overflow);
    bench.run<ClipConvexFaces>();
    if (closest) *closest = bench.read(bench.world().closest);
    return bench.read(bench.world().contacts, p.pairs.size());
  }

  void expectAsReference(const PairWorld& p) {
    std::vector<ClosestFeatures> closest;
    const auto contacts = device(p, &closest);
    const WorldInput in = p.world.finish();
    size_t position = 0;
    for (const size_t i : convexOrder(p)) {
      SCOPED_TRACE(testing::Message() << "pair " << i);
      expectAsReference(p, in, i, contacts[i], closest[position++]);
    }
  }

  void expectAsReference(const PairWorld& p, const WorldInput& in, size_t i, const RawContacts& raw,
                         const ClosestFeatures& c) {
    const PairReference e = referenceOf(p, in, i);
    const Shape &a = p.shapeOf(p.pairs[i].bodyA), &b = p.shapeOf(p.pairs[i].bodyB);
    const double margins = double(a.margin) + b.margin, tolerance = 2e-5 * e.size;
    if (e.closest.separation > e.limit - tolerance) return;
    m_touching++;
    ASSERT_GE(raw.count, 1);
    ASSERT_LE(raw.count, 4);
    const Vec axis = e.rotationA * toVec(c.normal);
    EXPECT_LE(length(toVec(raw.normal) + axis), 1e-5) << "on B, towards A";
    // The deepest last, as deep as the cores are.
    for (int k = 0; k < raw.count; ++k) EXPECT_GE(raw.points[k].w, raw.points[raw.count - 1].w - tolerance);
    EXPECT_NEAR(raw.points[raw.count - 1].w, e.closest.separation - margins, tolerance);
    // Each is the closest point or a corner of the region in which the two faces lie over each other.
    auto corners = regionCornersReference(e.a, e.b, axis, 0.9949);
    corners.push_back({e.rotationA * toVec(c.onB), c.normal.w});
    double farthest = 0;
    for (int k = 0; k < raw.count; ++k) {
      const Vec onB = toVec(raw.points[k]) + axis * b.margin;  // of the core
      double nearest = INFINITY, gapError = 0;
      for (const RegionCorner& corner : corners) {
        if (length(corner.onB - onB) > nearest) continue;
        nearest = length(corner.onB - onB);
        gapError = std::fabs(corner.gap - margins - raw.points[k].w);
      }
      // A corner where sides nearly in line cross is known to its rounding over the sine of their angle.
      EXPECT_LE(nearest, 2e-3 * e.size);
      EXPECT_LE(gapError, 2e-4 * e.size);
      farthest = std::max(farthest, length(toVec(raw.points[k]) - toVec(raw.points[raw.count - 1])));
    }
    // No corner that touches lies farther from the deepest point than the one chosen as the farthest.
    const Vec deepest = toVec(raw.points[raw.count - 1]) + axis * b.margin;
    for (const RegionCorner& corner : regionCornersReference(e.a, e.b, axis, 0.9951)) {
      if (corner.gap > e.limit - tolerance) continue;
      const Vec offset = corner.onB - deepest;
      const double across = length(offset - axis * dot(offset, axis));
      if (across < e.limit) continue;  // one with the deepest point
      EXPECT_LE(across, farthest + 2e-3 * e.size)
          << corner.gap << " sep " << e.closest.separation << " lim " << e.limit << " count " << raw.count;
    }
    m_several += raw.count > 1;
  }

  size_t m_spare = 0, m_touching = 0, m_several = 0;
};

TEST_F(ClipConvexFacesTest, RandomSmall) {
  std::mt19937 random(1);
  expectAsReference(randomConvexPairs(random, 18));
}

TEST_F(ClipConvexFacesTest, Random) {
  std::mt19937 random(2);
  m_spare = 3;
  expectAsReference(randomConvexPairs(random, 900));
  EXPECT_GT(m_touching, 300u);
  EXPECT_GT(m_several, 100u);
}

// A face of 100 corners on another one, a box on it, a capsule along it.
TEST_F(ClipConvexFacesTest, FacesOnFacesSmall) {
  PairWorld p;
  const int drum = p.world.hull(prismPoints(100, 1, 0.5f)), disc = p.world.hull(prismPoints(64, 0.6f, 0.1f));
  const int box = p.world.box({0.3f, 0.3f, 0.3f, 0}), capsule = p.world.capsule(0, 0.2f, 0.4f);
  const size_t onDrum = p.add(drum, at(0, 0, 0), disc, at(0.2f, 0.675f, 0));
  const size_t boxOnDrum = p.add(drum, at(0, 0, 0), box, at(0.1f, 0.835f, 0.1f, turnAbout({0, 1, 0, 0}, 0.3f)));
  const size_t lying = p.add(drum, at(0, 0, 0), capsule, at(0, 0.735f, 0.1f));
  p.add(box, at(0, 0, 0), capsule, at(0.1f, 0.495f, 0));
  p.add(disc, at(0, 0, 0), drum, at(0.7f, 0.67f, 0.3f, turnAbout({1, 0, 0.3f, 0}, 0.01f)));
  const auto raw = device(p);
  expectAsReference(p);
  EXPECT_EQ(raw[onDrum].count, 4);
  EXPECT_EQ(raw[boxOnDrum].count, 4);
  EXPECT_EQ(raw[lying].count, 2);
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(raw[onDrum].points[k].w, -0.005f, 2e-6f);
}

TEST_F(ClipConvexFacesTest, NothingAfterAnOverflowSmall) {
  std::mt19937 random(3);
  for (const RawContacts& raw : device(randomConvexPairs(random, 6), nullptr, OVERFLOW_PAIRS)) {
    EXPECT_TRUE(StageBench::isPoison(raw));
  }
}

}  // namespace
}  // namespace btgpu
