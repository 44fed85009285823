// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Faces and edges of hulls, checked by what they must be: every point behind every face, every edge between two faces,
// Euler's formula.
#include "translation/hull_features.h"

#include <algorithm>
#include <map>

#include "tests/lib/convex_shapes.h"

namespace btgpu {
namespace {

double sizeOf(const std::vector<float4>& points) {
  double size = 0;
  for (const float4& p : points) size = std::max(size, length(toDouble(p)));
  return size;
}

// Planes are rounded to float (a few 1e-7 of the size), and what lies within 2e-6 of a face's plane counts as on it
// (hull_features.cpp).
constexpr double kOnPlane = 4e-6;

void expectPolyhedron(const std::vector<float4>& points, const HullFeatures& h) {
  const double size = sizeOf(points), tolerance = kOnPlane * size;
  std::map<std::pair<uint, uint>, int> sides;
  for (const HullFace& f : h.faces) {
    EXPECT_NEAR(length(toDouble(f.plane)), 1, 1e-6);
    for (const float4& p : points) EXPECT_LE(dot(toDouble(f.plane), toDouble(p)), double(f.plane.w) + tolerance);
    ASSERT_GE(f.cornerCount, 3);
    Double3 turn;
    for (int k = 0; k < f.cornerCount; ++k) {
      const auto corner = [&](int i) { return h.corners[static_cast<size_t>(f.firstCorner + i % f.cornerCount)]; };
      const Double3 a = toDouble(h.vertices[corner(k)]), b = toDouble(h.vertices[corner(k + 1)]);
      EXPECT_NEAR(dot(toDouble(f.plane), a), f.plane.w, tolerance);
      turn = turn + cross(a - toDouble(h.vertices[corner(0)]), b - a);
      ++sides[{corner(k), corner(k + 1)}];
    }
    EXPECT_GT(dot(turn, toDouble(f.plane)), 0) << "corners run clockwise";
  }
  for (const auto& [side, times] : sides) {
    EXPECT_EQ(times, 1);
    EXPECT_EQ(sides.count({side.second, side.first}), 1u) << "a face without a neighbour";
  }
  EXPECT_EQ(h.edges.size() * 2, sides.size());
  for (const HullEdge& e : h.edges) {
    const Double3 direction = toDouble(h.vertices[static_cast<size_t>(e.to)] - h.vertices[static_cast<size_t>(e.from)]);
    const Double3 across = cross(toDouble(e.normalB), toDouble(e.normalA));
    EXPECT_GT(dot(direction, across), 0) << "an edge runs along normalB x normalA";
  }
  // Vertices inside a straight edge or a face, within rounding, belong to no face.
  std::map<uint, int> used;
  for (const uint c : h.corners) ++used[c];
  EXPECT_EQ(used.size() + h.faces.size(), h.edges.size() + 2) << "Euler";
}

TEST(HullFeatures, Cube) {
  std::vector<float4> points;
  for (int i = 0; i < 8; ++i) points.push_back({i & 1 ? 1.f : -1.f, i & 2 ? 2.f : -2.f, i & 4 ? 3.f : -3.f, 0});
  points.push_back({0, 0, 0, 0});     // inside
  points.push_back({1, 0, 0, 0});     // in a face
  points.push_back({1, 2, 0.5f, 0});  // in an edge
  points.push_back({1, 2, 3, 0});     // twice
  const HullFeatures h = makeHullFeatures(points);
  expectPolyhedron(points, h);
  EXPECT_EQ(h.faces.size(), 6u);
  EXPECT_EQ(h.edges.size(), 12u);
  for (const HullFace& f : h.faces) EXPECT_EQ(f.cornerCount, 4);
}

TEST(HullFeatures, PrismsWithLongFaces) {
  for (const int sides : {3, 8, 65, 100, 500}) {
    const auto points = prismPoints(sides, 1, 0.3f);
    const HullFeatures h = makeHullFeatures(points);
    expectPolyhedron(points, h);
    EXPECT_EQ(h.faces.size(), static_cast<size_t>(sides) + 2);
    EXPECT_EQ(std::count_if(h.faces.begin(), h.faces.end(), [=](const HullFace& f) { return f.cornerCount == sides; }),
              sides == 4 ? 6 : 2);
  }
}

// Turned, so that its coplanar points are coplanar within float rounding only.
TEST(HullFeatures, TurnedAndScaledPrisms) {
  Random random(1);
  for (int n = 0; n < 60; ++n) {
    const float4 turn = random.rotation();
    const float scale = random.magnitude(-2, 3);
    std::vector<float4> points;
    for (const float4& p : prismPoints(3 + n, 1, n % 3 ? 0.5f : 0.02f)) {
      const Double3 t = turned(turn, toDouble(p) * scale);
      points.push_back({float(t.x), float(t.y), float(t.z), 0});
    }
    const HullFeatures h = makeHullFeatures(points);
    expectPolyhedron(points, h);
    EXPECT_EQ(h.faces.size(), static_cast<size_t>(3 + n) + 2);
  }
}

TEST(HullFeatures, RandomPoints) {
  Random random(2);
  for (int n = 0; n < 60; ++n) {
    const float4 half = {random.magnitude(-2, 0), random.magnitude(-2, 0), random.magnitude(-2, 0), 0};
    auto points = ellipsoidPoints(random, 4 + random.below(200), half * random.magnitude(-2, 3));
    for (int k = 0; k < 20; ++k) points.push_back(points[static_cast<size_t>(k) % 4] * random.uniform(0, 0.9f));
    expectPolyhedron(points, makeHullFeatures(points));
  }
}

TEST(HullFeatures, PointSegmentPolygon) {
  const std::vector<float4> same(3, float4{1, 2, 3, 0});
  HullFeatures h = makeHullFeatures(same);
  EXPECT_EQ(h.vertices.size(), 1u);
  EXPECT_EQ(h.faces.size(), 6u);
  EXPECT_TRUE(h.edges.empty());

  h = makeHullFeatures({{0, 0, 0, 0}, {1, 1, 0, 0}, {3, 3, 0, 0}, {2, 2, 0, 0}});
  EXPECT_EQ(h.vertices.size(), 2u);
  EXPECT_EQ(h.faces.size(), 6u);
  EXPECT_EQ(h.edges.size(), 4u);

  std::vector<float4> polygon = {{0.5f, 0.5f, 0, 0}, {0.5f, 0, 0, 0}};  // inside, and in the middle of a side
  for (const float4 p : {float4{0, 0, 0, 0}, {1, 0, 0, 0}, {1, 1, 0, 0}, {0, 1, 0, 0}}) polygon.push_back(p);
  h = makeHullFeatures(polygon);
  EXPECT_EQ(h.vertices.size(), 4u);
  ASSERT_EQ(h.faces.size(), 2u);
  EXPECT_EQ(h.faces[0].cornerCount, 4);
  EXPECT_NEAR(std::fabs(h.faces[0].plane.z), 1, 1e-6);
  EXPECT_EQ(h.faces[0].plane.z, -h.faces[1].plane.z);
  EXPECT_EQ(h.edges.size(), 8u);
  for (const HullEdge& e : h.edges) {
    const float4 d = h.vertices[static_cast<size_t>(e.to)] - h.vertices[static_cast<size_t>(e.from)];
    EXPECT_GT(dot3(d, cross3(e.normalB, e.normalA)), 0);
  }
}

}  // namespace
}  // namespace btgpu
