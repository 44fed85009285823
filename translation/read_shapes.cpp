// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "read_shapes.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>

#include "convert.h"
#include "exact_type.h"
#include "parallel.h"

BTGPU_TRANSLATION_BEGIN
namespace {

bool isFiniteShape(const Shape& s) {
  return std::isfinite(s.extents.x) && std::isfinite(s.extents.y) && std::isfinite(s.extents.z) &&
         std::isfinite(s.extents.w) && std::isfinite(s.margin) && std::isfinite(s.breakingThreshold);
}

std::uint32_t takeIndex(std::vector<std::uint32_t>& unused, Tracked<Shape>& shapes) {
  if (!unused.empty()) {
    const std::uint32_t index = unused.back();
    unused.pop_back();
    return index;
  }
  shapes.values.push_back({});
  return static_cast<std::uint32_t>(shapes.values.size() - 1);
}

void setPlace(const Shape& place, Shape& shape) {
  shape.firstVertex = place.firstVertex;
  shape.firstFace = place.firstFace;
  shape.firstEdge = place.firstEdge;
}

// Bullet's local AABB of a hull, which it keeps: not always that of its points.
void readHullBounds(const btConvexHullShape& hull, Shape& out) {
  btVector3 lower, upper;
  hull.getAabb(btTransform::getIdentity(), lower, upper);
  out.extents = toFloat4((upper - lower) * btScalar(0.5));
  out.centre = toFloat4((upper + lower) * btScalar(0.5));
}

// Shapes that are a few numbers; false for all others. A class derived from Bullet's counts as another shape, since it
// may override anything.
bool convertSimple(const btCollisionShape& shape, Shape& out) {
  out = Shape{};
  out.margin = static_cast<float>(shape.getMargin());
  if (isExactly<btSphereShape>(shape)) {
    const auto& sphere = static_cast<const btSphereShape&>(shape);
    out.type = SHAPE_SPHERE;
    out.extents.x = static_cast<float>(sphere.getRadius());
  } else if (isExactly<btBoxShape>(shape)) {
    const auto& box = static_cast<const btBoxShape&>(shape);
    out.type = SHAPE_BOX;
    out.extents = toFloat4(box.getHalfExtentsWithMargin());
  } else if (isExactly<btStaticPlaneShape>(shape)) {
    const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
    out.type = SHAPE_PLANE;
    out.extents = toFloat4(plane.getPlaneNormal(), static_cast<float>(plane.getPlaneConstant()));
  } else if (isExactly<btCapsuleShape, btCapsuleShapeX, btCapsuleShapeZ>(shape)) {
    const auto& capsule = static_cast<const btCapsuleShape&>(shape);
    btVector3 half(0, 0, 0);
    half[capsule.getUpAxis()] = capsule.getHalfHeight();
    out.type = SHAPE_CAPSULE;
    out.extents = toFloat4(half);
    out.margin = static_cast<float>(capsule.getRadius());
  } else {
    return false;
  }
  return true;
}

}  // namespace

bool ShapeReader::convert(const btCollisionShape& shape, std::uint32_t index, WorldInput& input, Shape& out,
                          const char*& why) {
  if (isExactly<btConvexHullShape>(shape)) {
    m_meshes.drop(index);
    out = Shape{};
    out.margin = static_cast<float>(shape.getMargin());
    return convertHull(static_cast<const btConvexHullShape&>(shape), index, input.hulls, out);
  }
  dropHull(index);
  if (m_meshes.convert(shape, index, input.meshes, out, why)) return true;
  return convertSimple(shape, out);
}

bool ShapeReader::convertHull(const btConvexHullShape& shape, std::uint32_t index, HullArrays& hulls, Shape& out) {
  const int count = shape.getNumPoints();
  // With polyhedral features stock leaves the margins of two such shapes out.
  if (count == 0 || shape.getConvexPolyhedron()) {
    dropHull(index);
    return false;
  }
  for (int i = 0; i < count; ++i) {
    const float4 p = toFloat4(shape.getScaledPoint(i));
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) continue;
    dropHull(index);
    out.extents.x = INFINITY;  // what isFiniteShape looks for
    return true;
  }
  const btVector3* points = shape.getUnscaledPoints();
  const auto it = m_hulls.find(index);
  const bool same = it != m_hulls.end() && it->second.points.size() == static_cast<std::size_t>(count) &&
                    it->second.scaling == shape.getLocalScaling() &&
                    std::memcmp(static_cast<const void*>(it->second.points.data()), static_cast<const void*>(points),
                                static_cast<std::size_t>(count) * sizeof(btVector3)) == 0;
  if (!same) {
    dropHull(index);
    Hull& hull = m_hulls[index];
    hull.points.assign(points, points + count);
    hull.scaling = shape.getLocalScaling();
    std::vector<float4> scaled;
    for (int i = 0; i < count; ++i) scaled.push_back(toFloat4(shape.getScaledPoint(i)));
    hull.features = makeHullFeatures(scaled);
    hull.place = appendHull(hull.features, hulls);
  }
  const float margin = out.margin;
  out = m_hulls[index].place;
  out.type = SHAPE_HULL;
  out.margin = margin;
  readHullBounds(shape, out);
  return true;
}

void ShapeReader::dropHull(std::uint32_t index) {
  const auto it = m_hulls.find(index);
  if (it == m_hulls.end()) return;
  m_deadVertices += it->second.features.vertices.size();
  m_hulls.erase(it);
}

void ShapeReader::configure(btScalar threshold, bool relative) {
  m_threshold = threshold;
  m_relative = relative;
}

void ShapeReader::begin() {
  ++m_stamp;
  m_used.clear();
  m_lastShape = nullptr;
}

int ShapeReader::read(const btCollisionShape* shape, WorldInput& input, FallbackList& missing, FallbackList& shares) {
  Tracked<Shape>& shapes = input.shapes;
  if (shape == m_lastShape) return m_lastEntry.supported ? static_cast<int>(m_lastEntry.index) : -1;
  auto [it, isNew] = m_entries.try_emplace(shape, Entry{0, m_stamp - 1, false});
  Entry& entry = it->second;
  if (isNew) {
    entry.index = takeIndex(m_free, shapes);
    shapes.values[entry.index] = Shape{};
    shapes.changed.push_back(entry.index);
  }
  if (entry.stamp != m_stamp) {
    entry.stamp = m_stamp;
    m_used.push_back({shape, &entry, false});
    readEntry(shape, entry, input, missing, shares);
  }
  m_lastShape = shape;
  m_lastEntry = entry;
  return entry.supported ? static_cast<int>(entry.index) : -1;
}

void ShapeReader::readEntry(const btCollisionShape* shape, Entry& entry, WorldInput& input, FallbackList& missing,
                            FallbackList& shares) {
  const auto name = [shape] { return std::string(shape->getName()) + " shape"; };
  Shape read;
  const char* why = "contacts by Bullet's own algorithm on the CPU";
  if (convert(*shape, entry.index, input, read, why)) {
    read.breakingThreshold = breakingThreshold(*shape);
  } else {
    read = Shape{};
    read.type = SHAPE_HOST;
    shares.addShare(name(), why);
  }
  entry.supported = isFiniteShape(read);
  Shape& known = input.shapes.values[entry.index];
  if (!entry.supported) {
    missing.add(name(), "its size is not finite");
  } else if (!sameBits(known, read)) {
    known = read;
    input.shapes.changed.push_back(entry.index);
  }
}

float ShapeReader::breakingThreshold(const btCollisionShape& shape) const {
  return static_cast<float>(m_relative ? shape.getContactBreakingThreshold(m_threshold) : m_threshold);
}

bool ShapeReader::isUnchanged(const btCollisionShape& shape, const Entry& entry, const WorldInput& input) const {
  Shape read;
  if (!entry.supported || !convertSimple(shape, read)) return false;
  read.breakingThreshold = breakingThreshold(shape);
  return sameBits(input.shapes.values[entry.index], read);
}

bool ShapeReader::readKnown(WorldInput& input, FallbackList& missing, FallbackList& shares) {
  constexpr std::size_t kGrain = 128;
  parallelFor(m_used.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      m_used[i].unchanged = isUnchanged(*m_used[i].shape, *m_used[i].entry, input);
    }
  });
  bool same = true;
  for (const Used& used : m_used) {
    if (used.unchanged) continue;
    Entry& entry = *used.entry;
    const bool supported = entry.supported;
    const auto type = input.shapes.values[entry.index].type;
    readEntry(used.shape, entry, input, missing, shares);
    same = same && entry.supported == supported && input.shapes.values[entry.index].type == type;
  }
  return same;
}

void ShapeReader::end(WorldInput& input) {
  constexpr std::size_t kUnused = 64;  // not worth a walk over the table
  if (m_entries.size() >= 2 * m_used.size() + kUnused) {
    for (auto it = m_entries.begin(); it != m_entries.end();) {
      if (it->second.stamp == m_stamp) {
        ++it;
      } else {
        dropHull(it->second.index);
        m_meshes.drop(it->second.index);
        m_free.push_back(it->second.index);
        it = m_entries.erase(it);
      }
    }
    // Hash order is no order: the next new shape gets the lowest free index.
    std::sort(m_free.begin(), m_free.end(), std::greater<>());
  }
  if (m_meshes.reclaim(input.meshes)) {
    m_meshes.forEachPlace([&input](std::uint32_t index, int place) {
      input.shapes.values[index].firstVertex = place;
      input.shapes.changed.push_back(index);
    });
  }
  constexpr std::size_t kDead = 4096;  // vertices, likewise
  if (m_deadVertices < input.hulls.vertices.size() / 2 + kDead) return;
  input.hulls = HullArrays{};
  input.hulls.changed = true;
  m_deadVertices = 0;
  for (auto& [index, hull] : m_hulls) {
    hull.place = appendHull(hull.features, input.hulls);
    Shape& shape = input.shapes.values[index];
    setPlace(hull.place, shape);
    input.shapes.changed.push_back(index);
  }
}

void ShapeReader::clear() {
  m_entries.clear();
  m_hulls.clear();
  m_meshes.clear();
  m_deadVertices = 0;
  m_used.clear();
  m_free.clear();
  m_lastShape = nullptr;
}

BTGPU_TRANSLATION_END
