// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The kernels of batched queries against their references: rays through the tree against rays tried with every item,
// closest points against the same functions on the host.
#define BTGPU_TRIANGLE_CORES  // as in the engine's references
#include "gpu_engine/queries/cast_rays_reference.h"
#include "gpu_engine/queries/cast_sweeps_reference.h"
#include "gpu_engine/queries/closest_points.h"
#include "gpu_engine/queries/convex_sweeper.h"
#include "gpu_engine/queries/ray_caster.h"
#include "kernels/lib/bounds.h"
#include "kernels/lib/closest_points.h"
#include "kernels/lib/convex_sweep.h"
#include "tests/support/device_test.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

constexpr uint kShapes = 11;

// A square of hills, or a heap of triangles, as three corners each.
std::vector<float4> hills(std::mt19937& random, int side) {
  std::vector<float> heights;
  for (int i = 0; i <= side * (side + 2); ++i) heights.push_back(uniform(random, -0.3f, 0.3f));
  std::vector<float4> corners;
  const float step = 2.0f / static_cast<float>(side);
  const auto at = [&](int x, int z) {
    return float4{step * static_cast<float>(x) - 1, heights[static_cast<size_t>(z * (side + 1) + x)],
                  step * static_cast<float>(z) - 1, 0};
  };
  for (int z = 0; z < side; ++z) {
    for (int x = 0; x < side; ++x) {
      for (const float4& p : {at(x, z), at(x, z + 1), at(x + 1, z), at(x + 1, z), at(x, z + 1), at(x + 1, z + 1)})
        corners.push_back(p);
    }
  }
  return corners;
}
std::vector<float4> heap(std::mt19937& random, int count) {
  std::vector<float4> corners;
  for (int i = 0; i < 3 * count; ++i) corners.push_back(uniform3(random, -0.8f, 0.8f));
  return corners;
}

// Items at random, as translation would make them of a world: every seventh a compound's child, every fifth the host's.
QueryWorld worldOf(std::mt19937& random, uint count, bool withHost, bool withPlane) {
  WorldBuilder b;
  std::vector<float4> points;
  for (int i = 0; i < 21; ++i) points.push_back(uniform3(random, -0.8f, 0.8f));
  const int shapes[kShapes] = {b.sphere(0.6f),
                               b.box({0.5f, 0.3f, 0.8f, 0}),
                               b.capsule(0, 0.4f, 0.5f),
                               b.capsule(2, 0.2f, 0.9f),
                               b.hull(points),
                               b.hull(points, 0),
                               b.cylinder(1, 0.5f, 0.6f),
                               b.cone(2, 0.5f, 0.7f),
                               b.mesh(hills(random, 12)),
                               b.mesh(heap(random, 40)),
                               b.mesh({{-1, 0, -1, 0}, {0, 0, 1, 0}, {1, 0, -1, 0}})};  // flat: no height in its tree
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
    ItemForm form{{1, 1, 1, 0}, isChild ? static_cast<uint>(world.children.size()) : NO_INDEX, 0, 0, 0};
    const int type = world.shapes.shapes.values[static_cast<size_t>(shape)].type;
    if (object % 3 == 1 && type != SHAPE_PLANE) form.scaling = {0.9f, 0.9f, 0.9f, 0};
    if (type == SHAPE_MESH && object % 2) form.scaling = {0.5f, 0.9f, 0.8f, 0};
    if (type == SHAPE_MESH && object % 5 == 2) form.flags = FORM_HEIGHT_FIELD | FORM_OTHER_WINDING;
    items.forms.push_back(form);
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
    ray.flags = i % 11 == 0 ? RAY_OFF : i % 4 | (i % 3 == 1 ? RAY_ALL_TRIANGLES : 0);
    ray.ignored = i % 2 ? NO_INDEX : i % (items + 1);
  }
  return rays;
}

class QueriesTest : public DeviceTest {
 protected:
  void compare(const QueryWorld& world, const std::vector<Ray>& rays, bool expectHits) {
    RayCaster caster(device());
    QueryArrays arrays(device());
    RayResults results;
    caster.cast(queue(), arrays, world, rays.data(), rays.size(), results);
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

  template <typename Asking, typename Results>
  void compareHostItems(const QueryWorld& world, const std::vector<Asking>& rays, const Results& results) {
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
  QueryArrays arrays(device());
  RayResults results;
  for (std::uint64_t version = 1; version < 4; ++version) {
    QueryWorld world = worldOf(random, 400 - 90 * static_cast<uint>(version), false, true);
    world.version = version;
    const auto rays = raysFor(random, 400, 300);
    caster.cast(queue(), arrays, world, rays.data(), rays.size(), results);
    const auto expected = castRaysReference(world, rays);
    for (size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(results.hits[i].object, expected[i].object) << "ray " << i;
  }
}

// Shapes of the world through it; every other one turns on its way.
std::vector<Sweep> sweepsFor(std::mt19937& random, const QueryWorld& world, uint items, uint count) {
  const float extent = 1.5f * std::cbrt(static_cast<float>(items)) + 2;
  std::vector<Sweep> sweeps(count);
  for (uint i = 0; i < count; ++i) {
    Sweep& s = sweeps[i];
    s = Sweep{};
    s.shape = i % 13 == 12 ? -1 : static_cast<int>(i % 8);
    const Shape& shape = world.shapes.shapes.values[i % 8];
    s.from = uniform3(random, -extent, extent);
    s.to = uniform3(random, -extent, extent);
    s.orientation = turnAbout(uniform3(random, -1, 1), uniform(random, -3, 3));
    const float reach = length3(shape.centre) + length3(shape.extents) + shape.margin;
    if (i % 2) {
      s.turn = uniform3(random, -0.4f, 0.4f);
      s.turn.w = length3(s.turn) * reach;
    }
    s.lower = {-reach, -reach, -reach, 0};
    s.upper = {reach, reach, reach, 0};
    s.filterGroup = i % 3 ? 1 : 2;
    s.filterMask = i % 4 ? -1 : 3;
    s.ignored = i % 2 ? NO_INDEX : i % (items + 1);
    s.allowedPenetration = i % 5 ? 0.0f : 0.03f;
  }
  return sweeps;
}

class SweepsTest : public QueriesTest {
 protected:
  void compareSweeps(const QueryWorld& world, const std::vector<Sweep>& sweeps) {
    ConvexSweeper sweeper(device());
    QueryArrays arrays(device());
    SweepResults results;
    sweeper.cast(queue(), arrays, world, sweeps.data(), sweeps.size(), results);
    const auto expected = castSweepsReference(world, sweeps);
    ASSERT_EQ(results.hits.size(), sweeps.size());
    size_t hits = 0, others = 0;
    for (size_t i = 0; i < sweeps.size(); ++i) {
      const SweepHit &ours = results.hits[i], &theirs = expected[i];
      hits += theirs.object != NO_INDEX;
      if (i % 2 == 0) {  // no sines and cosines: the same operations
        ASSERT_EQ(ours.object, theirs.object) << "sweep " << i;
        ASSERT_EQ(ours.normal.w, theirs.normal.w) << "sweep " << i;
        ASSERT_EQ(ours.normal.x, theirs.normal.x) << "sweep " << i;
        ASSERT_EQ(ours.point.y, theirs.point.y) << "sweep " << i;
      } else if (ours.object != theirs.object) {
        ++others;
      } else if (ours.object != NO_INDEX) {
        // Both end within SWEEP_NEAR of the surface.
        const float closing = fabs(dot3(sweeps[i].to - sweeps[i].from, theirs.normal));
        ASSERT_LE(fabs(ours.normal.w - theirs.normal.w) * closing, 1.1f * SWEEP_NEAR + sweeps[i].turn.w * 0.01f) << i;
      }
    }
    EXPECT_TRUE(world.device.infos.size() < 9 || hits > sweeps.size() / 8) << hits;
    EXPECT_LE(others, sweeps.size() / 100) << "passing by as near as rounding";
    compareHostItems(world, sweeps, results);
  }
};

TEST_F(SweepsTest, SweepsThroughFewItemsSmall) {
  const QueryWorld world = worldOf(random, 60, true, true);
  compareSweeps(world, sweepsFor(random, world, 60, 60));
}
TEST_F(SweepsTest, SweepsThroughCountsOfAllKinds) {
  for (const uint count : {1u, 9u, 65u, 800u}) {
    SCOPED_TRACE(count);
    const QueryWorld world = worldOf(random, count, count > 4, true);
    compareSweeps(world, sweepsFor(random, world, count, 300));
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
      const auto isAsked = [&](int shape) {
        return world.shapes.shapes.values[static_cast<size_t>(shape)].type <= SHAPE_MULTI_SPHERE;
      };
      if (a == b || !isAsked(shapeA) || !isAsked(shapeB)) continue;
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
  EXPECT_GT(inside, 1);
}

}  // namespace
}  // namespace btgpu
