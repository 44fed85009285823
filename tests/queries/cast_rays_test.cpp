// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The kernels of batched queries against their references: rays through the tree against rays tried with every item,
// closest points against the same functions on the host.
#include "gpu_engine/queries/cast_rays_reference.h"
#include "gpu_engine/queries/closest_points.h"
#include "gpu_engine/queries/ray_caster.h"
#include "kernels/lib/bounds.h"
#include "kernels/lib/closest_points.h"
#include "tests/support/device_test.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

constexpr uint kShapes = 6;

// Items at random, as translation would make them of a world: every seventh a compound's child, every fifth the host's.
QueryWorld worldOf(std::mt19937& random, uint count, bool withHost, bool withPlane) {
  WorldBuilder b;
  std::vector<float4> points;
  for (int i = 0; i < 21; ++i) points.push_back(uniform3(random, -0.8f, 0.8f));
  const int shapes[kShapes] = {b.sphere(0.6f),           b.box({0.5f, 0.3f, 0.8f, 0}),
                               b.capsule(0, 0.4f, 0.5f), b.capsule(2, 0.2f, 0.9f),
                               b.hull(points),           b.hull(points, 0)};
  const int plane = b.plane({0, 1, 0, 0}, -6);
  b.add(shapes[0], {0, 0, 0, 0});
  QueryWorld world;
  world.version = 1;
  world.shapes = b.finish();
  const float extent = 0.7f * std::cbrt(static_cast<float>(count)) + 1;
  const auto add = [&](QueryItems& items, uint object, int shape, bool isHost, bool isChild) {
    const BodyPose pose{uniform3(random, -extent, extent), turnAbout(uniform3(random, -1, 1), uniform(random, -3, 3))};
    const Matrix3 r = matrixFromQuaternion(pose.orientation);
    const float4 grown{0.02f, 0.02f, 0.02f, 0};
    Aabb box =
        shapeAabb(world.shapes.shapes.values[static_cast<size_t>(shape)], pose, world.shapes.hulls.vertices.data());
    box = {box.lower - grown, box.upper + grown};
    BodyInfo info{};
    info.shapeIndex = isHost ? 0 : shape;
    info.flags = BODY_PRESENT;
    info.filterGroup = 1 << object % 3;
    info.filterMask = object % 4 == 0 ? 2 : -1;
    info.uniqueId = static_cast<int>(object);
    items.infos.push_back(info);
    items.aabbs.push_back(box);
    if (isHost) return;
    ItemPose at{withW(r.row0, pose.position.x), withW(r.row1, pose.position.y), withW(r.row2, pose.position.z)};
    items.poses.push_back(at);
    items.childOf.push_back(isChild ? static_cast<uint>(world.children.size()) : NO_INDEX);
    if (!isChild) return;
    CompoundChild child{};
    child.pose = at;
    child.objectAabb = box;
    child.childAabb = {{-0.7f, -1, -1, 0}, {1, 1, 1, 0}};
    child.child = static_cast<int>(object % 3);
    world.children.push_back(child);
  };
  for (uint i = 0; i < count; ++i) {
    const bool isHost = withHost && i % 5 == 4;
    add(isHost ? world.host : world.device, i, shapes[i % kShapes], isHost, i % 7 == 3);
  }
  world.device.treeCount = static_cast<uint>(world.device.infos.size());
  world.host.treeCount = static_cast<uint>(world.host.infos.size());
  if (withPlane) add(world.device, count, plane, false, false);
  if (withPlane && withHost) add(world.host, count + 1, plane, true, false);
  return world;
}

std::vector<Ray> raysFor(std::mt19937& random, uint items, uint count) {
  const float extent = 1.5f * std::cbrt(static_cast<float>(items)) + 2;
  std::vector<Ray> rays(count);
  for (uint i = 0; i < count; ++i) {
    Ray& ray = rays[i];
    ray.from = uniform3(random, -extent, extent);
    ray.to = uniform3(random, -extent, extent);
    if (i % 5 == 0) ray.to = ray.from + float4{0, -2 * extent, 0, 0};  // along an axis
    ray.filterGroup = i % 3 ? 1 : 2;
    ray.filterMask = i % 4 ? -1 : 3;
    ray.flags = i % 11 == 0 ? RAY_OFF : i % 4;
    ray.ignored = i % 2 ? NO_INDEX : i % (items + 1);
  }
  return rays;
}

class QueriesTest : public DeviceTest {
 protected:
  void compare(const QueryWorld& world, const std::vector<Ray>& rays, bool expectHits) {
    RayCaster caster(device());
    RayResults results;
    caster.cast(queue(), world, rays.data(), rays.size(), results);
    const auto expected = castRaysReference(world, rays);
    size_t hits = 0;
    ASSERT_EQ(results.hits.size(), rays.size());
    for (size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(results.hits[i].object, expected[i].object) << "ray " << i;
      ASSERT_EQ(results.hits[i].normal.w, expected[i].normal.w) << "ray " << i;
      ASSERT_EQ(results.hits[i].part, expected[i].part) << "ray " << i;
      ASSERT_EQ(results.hits[i].triangle, expected[i].triangle) << "ray " << i;
      for (int k = 0; k < 3; ++k) {
        // A unit vector, rounded once more.
        ASSERT_NEAR(component(results.hits[i].normal, k), component(expected[i].normal, k), 1e-6f) << "ray " << i;
      }
      hits += expected[i].object != NO_INDEX;
    }
    EXPECT_TRUE(!expectHits || hits > rays.size() / 6) << hits;
    compareHostItems(world, rays, results);
  }

  void compareHostItems(const QueryWorld& world, const std::vector<Ray>& rays, const RayResults& results) {
    if (world.host.infos.empty()) {
      EXPECT_TRUE(results.hostFirst.empty());
      return;
    }
    const auto expected = hostItemsReference(world, rays, results.hits);
    ASSERT_EQ(results.hostFirst.size(), rays.size() + 1);
    size_t all = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
      const auto first = results.hostObjects.begin() + results.hostFirst[i];
      std::vector<std::uint32_t> found(first, results.hostObjects.begin() + results.hostFirst[i + 1]);
      std::sort(found.begin(), found.end());
      ASSERT_EQ(found, expected[i]) << "ray " << i;
      all += found.size();
    }
    EXPECT_GT(all, 0u);
  }

  std::mt19937 random{5};
};

TEST_F(QueriesTest, RaysThroughFewItemsSmall) {
  const QueryWorld world = worldOf(random, 90, true, true);
  compare(world, raysFor(random, 90, 150), true);
}

TEST_F(QueriesTest, RaysThroughNothingSmall) {
  QueryWorld world = worldOf(random, 0, false, false);
  compare(world, raysFor(random, 1, 20), false);
  compare(world, {}, false);
}

TEST_F(QueriesTest, RaysThroughCountsOfAllKinds) {
  for (const uint count : {1u, 2u, 7u, 8u, 9u, 64u, 65u, 513u, 5000u}) {
    for (const bool others : {false, true}) {
      SCOPED_TRACE(count);
      compare(worldOf(random, count, others && count > 4, others), raysFor(random, count, 500), count > 100);
    }
  }
}

TEST_F(QueriesTest, RaysThroughAChangedWorld) {
  RayCaster caster(device());
  RayResults results;
  for (std::uint64_t version = 1; version < 4; ++version) {
    QueryWorld world = worldOf(random, 400 - 90 * static_cast<uint>(version), false, true);
    world.version = version;
    const auto rays = raysFor(random, 400, 300);
    caster.cast(queue(), world, rays.data(), rays.size(), results);
    const auto expected = castRaysReference(world, rays);
    for (size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(results.hits[i].object, expected[i].object) << "ray " << i;
  }
}

// Every two of some items, and a ball at each.
TEST_F(QueriesTest, ClosestPointsSmall) {
  const QueryWorld world = worldOf(random, 12, false, true);
  const HullArrays& h = world.shapes.hulls;
  const Hulls hulls{h.vertices.data(), h.faces.data(), h.corners.data(), h.edges.data()};
  std::vector<ClosestQuery> queries;
  for (size_t a = 0; a < world.device.infos.size(); ++a) {
    for (size_t b = 0; b < world.device.infos.size(); ++b) {
      const int shapeA = world.device.infos[a].shapeIndex, shapeB = world.device.infos[b].shapeIndex;
      if (a == b) continue;
      queries.push_back({world.device.poses[a], world.device.poses[b], shapeA, shapeB, 0, b % 3 ? 1e18f : 1.0f});
      if (b == 0) queries.push_back({world.device.poses[a], world.device.poses[b], shapeA, -1, 0.3f, 1e18f});
    }
  }
  ClosestPoints stage(device());
  std::vector<ClosestAnswer> answers;
  stage.find(queue(), world, queries, answers);
  ASSERT_EQ(answers.size(), queries.size());
  int found = 0, inside = 0;
  for (size_t i = 0; i < queries.size(); ++i) {
    const ClosestAnswer expected = closestPointsOf(queries[i], world.shapes.shapes.values.data(), hulls);
    ASSERT_EQ(answers[i].found, expected.found) << i;
    if (!expected.found) continue;
    ++found;
    if (expected.normal.w < 0) ++inside;
    // The same operations.
    ASSERT_EQ(answers[i].normal.w, expected.normal.w) << i;
    ASSERT_EQ(answers[i].onA.x, expected.onA.x) << i;
    ASSERT_EQ(answers[i].onB.z, expected.onB.z) << i;
  }
  EXPECT_GT(found, 60);
  EXPECT_GT(inside, 3);
}

}  // namespace
}  // namespace btgpu
