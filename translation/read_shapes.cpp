// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "read_shapes.h"

#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>

#include "convert.h"
#include "exact_type.h"
#include "parallel.h"

BTGPU_TRANSLATION_BEGIN
namespace {

// Shapes that a compound may hold.
bool isInCompounds(int type) {
  return type == SHAPE_SPHERE || type == SHAPE_BOX || type == SHAPE_CAPSULE || type == SHAPE_HULL ||
         type == SHAPE_CYLINDER || type == SHAPE_CONE || type == SHAPE_MULTI_SPHERE || type == SHAPE_SUM ||
         type == SHAPE_PLANE || type == SHAPE_MESH;
}

bool isFinitePose(const BodyPose& pose) {
  const float4 &p = pose.position, &q = pose.orientation;
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(q.x) && std::isfinite(q.y) &&
         std::isfinite(q.z) && std::isfinite(q.w);
}

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

// Bullet's local AABB, which hulls keep: not always that of the points.
void readBounds(const btCollisionShape& shape, Shape& out) {
  btVector3 lower, upper;
  shape.getAabb(btTransform::getIdentity(), lower, upper);
  out.extents = toFloat4((upper - lower) * btScalar(0.5));
  out.centre = toFloat4((upper + lower) * btScalar(0.5));
}

bool hasPolyhedralFeatures(const btCollisionShape& shape) {
  return shape.isPolyhedral() && static_cast<const btPolyhedralConvexShape&>(shape).getConvexPolyhedron() != nullptr;
}

int hullVariant(const btCollisionShape& shape, const CorePoints& core) {
  int variant = core.isBox ? HULL_BOX : 0;
  if (isExactly<btTriangleShape>(shape)) variant |= HULL_TRIANGLE;
  if (hasPolyhedralFeatures(shape)) variant |= HULL_POLYHEDRAL;
  return variant;
}

// Bit for bit; w of the points is always 0.
bool sameCore(const CorePoints& a, const CorePoints& b) {
  return a.points.size() == b.points.size() && a.radii == b.radii && a.stretch == b.stretch &&
         a.terms.size() == b.terms.size() &&
         std::memcmp(a.terms.data(), b.terms.data(), a.terms.size() * sizeof(float4)) == 0 &&
         std::memcmp(static_cast<const void*>(a.points.data()), static_cast<const void*>(b.points.data()),
                     a.points.size() * sizeof(btVector3)) == 0;
}

bool isFiniteCore(const CorePoints& core) {
  for (const btVector3& p : core.points) {
    const float4 q = toFloat4(p);
    if (!std::isfinite(q.x) || !std::isfinite(q.y) || !std::isfinite(q.z)) return false;
  }
  for (const float radius : core.radii) {
    if (!std::isfinite(radius)) return false;
  }
  for (const float4& t : core.terms) {
    if (!std::isfinite(t.x) || !std::isfinite(t.y) || !std::isfinite(t.z) || !std::isfinite(t.w)) return false;
  }
  const float4 stretch = toFloat4(core.stretch);
  return std::isfinite(stretch.x) && std::isfinite(stretch.y) && std::isfinite(stretch.z);
}

// Nothing but a list: stage 44 has no use for faces of spheres.
HullFeatures makeSpheres(const CorePoints& core) {
  HullFeatures out;
  for (std::size_t i = 0; i < core.points.size(); ++i) {
    out.vertices.push_back(toFloat4(core.points[i], core.radii[i]));
  }
  out.vertices.push_back(toFloat4(core.stretch));
  return out;
}

HullFeatures makeFeatures(const CorePoints& core) {
  if (!core.terms.empty()) {
    HullFeatures terms;
    terms.vertices = core.terms;
    return terms;
  }
  if (!core.radii.empty()) return makeSpheres(core);
  std::vector<float4> points;
  for (const btVector3& p : core.points) points.push_back(toFloat4(p));
  return makeHullFeatures(points);
}

// `place`: where what was made of the points lies.
Shape placedShape(const btCollisionShape& shape, const CorePoints& core, const Shape& place) {
  Shape out = place;
  out.type = !core.terms.empty() ? SHAPE_SUM : core.radii.empty() ? SHAPE_HULL : SHAPE_MULTI_SPHERE;
  if (!core.radii.empty()) out.vertexCount -= 1;  // the last one is how they are stretched
  out.margin = static_cast<float>(core.margin);
  out.variant = hullVariant(shape, core);
  // The bounds of a sum's terms are not worth the search: Bullet's are a little tighter than the box around it.
  out.boundsMargins = out.type == SHAPE_SUM ? 0 : boundsMargins(shape);
  readBounds(shape, out);
  return out;
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
    out.variant = hasPolyhedralFeatures(box) ? HULL_POLYHEDRAL : 0;
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
  } else if (isExactly<btEmptyShape>(shape)) {
    out = Shape{};  // SHAPE_NONE: touches nothing
  } else {
    return readRoundShape(shape, out);
  }
  return true;
}

}  // namespace

// False if one of its shapes can't be on the device. What is empty touches nothing and needs no slot.
bool ShapeReader::addLeaves(const btCompoundShape& compound, const btTransform& pose, int depth, WorldInput& input,
                            FallbackList& missing, FallbackList& shares, std::vector<CompoundLeaf>& leaves) {
  constexpr double kNoOrigin[3] = {0, 0, 0};
  for (int k = 0; k < compound.getNumChildShapes(); ++k) {
    const btCollisionShape* child = compound.getChildShape(k);
    const btTransform childPose = pose * compound.getChildTransform(k);
    if (isExactly<btCompoundShape>(*child)) {
      if (!addLeaves(static_cast<const btCompoundShape&>(*child), childPose, depth + 1, input, missing, shares,
                     leaves)) {
        return false;
      }
      continue;
    }
    const int index = read(child, input, missing, shares);
    if (index < 0) return false;
    const int type = input.shapes.values[static_cast<std::size_t>(index)].type;
    if (type == SHAPE_NONE) continue;
    if (!isInCompounds(type)) return false;
    leaves.push_back({index, depth, k, toPose(childPose, kNoOrigin)});
  }
  return true;
}

bool ShapeReader::convertCompound(const btCompoundShape& compound, std::uint32_t index, WorldInput& input,
                                  FallbackList& missing, FallbackList& shares, Shape& out) {
  out = Shape{};
  std::vector<CompoundLeaf> leaves;
  // The application may refuse pairs of shapes: it is asked on the host.
  const bool asks = gCompoundChildShapePairCallback || gCompoundCompoundChildShapePairCallback;
  if (asks || !addLeaves(compound, btTransform::getIdentity(), 1, input, missing, shares, leaves)) {
    m_compounds.erase(index);
    return false;
  }
  out.type = SHAPE_COMPOUND;
  out.margin = static_cast<float>(compound.getMargin());
  btVector3 lower, upper;
  compound.getAabb(btTransform::getIdentity(), lower, upper);
  out.extents = toFloat4((upper - lower) * btScalar(0.5));
  out.centre = toFloat4((upper + lower) * btScalar(0.5));
  for (const CompoundLeaf& leaf : leaves) {
    if (!isFinitePose(leaf.pose)) out.extents.x = INFINITY;  // what isFiniteShape looks for
  }
  m_compounds[index] = std::move(leaves);
  return true;
}

bool ShapeReader::convert(const btCollisionShape& shape, std::uint32_t index, WorldInput& input, FallbackList& missing,
                          FallbackList& shares, Shape& out, const char*& why) {
  const auto isOwn = [this](int type) { return (m_ownAlgorithms >> type & 1u) != 0; };
  const bool known = !isOwn(shape.getShapeType());
  if (known && isExactly<btCompoundShape>(shape)) {
    dropHull(index);
    m_meshes.drop(index);
    return convertCompound(static_cast<const btCompoundShape&>(shape), index, input, missing, shares, out);
  }
  m_compounds.erase(index);
  if (known && readCorePoints(shape, m_core)) {
    m_meshes.drop(index);
    out = Shape{};
    convertPoints(shape, index, input.hulls, out);
    return true;
  }
  dropHull(index);
  if (!known || isOwn(TRIANGLE_SHAPE_PROXYTYPE)) {  // what Bullet hands a mesh's triangles to
    m_meshes.drop(index);
  } else if (m_meshes.convert(shape, index, input.meshes, out, why)) {
    return true;
  }
  return known && convertSimple(shape, out);
}

void ShapeReader::convertPoints(const btCollisionShape& shape, std::uint32_t index, HullArrays& hulls, Shape& out) {
  if (!isFiniteCore(m_core)) {
    dropHull(index);
    out.extents.x = INFINITY;  // what isFiniteShape looks for
    return;
  }
  const auto it = m_hulls.find(index);
  if (it == m_hulls.end() || !sameCore(it->second.core, m_core)) {
    dropHull(index);
    Hull& hull = m_hulls[index];
    hull.core = m_core;
    hull.features = makeFeatures(m_core);
    hull.place = appendHull(hull.features, hulls);
  }
  out = placedShape(shape, m_core, m_hulls[index].place);
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
    m_used.push_back({shape, &entry, false, {}, {}});
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
  // A compound reads other shapes, which may move the table's arrays, but not the entry.
  if (convert(*shape, entry.index, input, missing, shares, read, why)) {
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
  if (!entry.supported || (m_ownAlgorithms >> shape.getShapeType() & 1u)) return false;
  Shape read;
  thread_local CorePoints core;
  if (readCorePoints(shape, core)) {
    const auto it = m_hulls.find(entry.index);
    if (it == m_hulls.end() || !sameCore(it->second.core, core)) return false;
    read = placedShape(shape, core, it->second.place);
  } else if (!convertSimple(shape, read)) {
    return false;
  }
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
  for (std::size_t i = 0; i < m_used.size(); ++i) {  // a compound may add to them
    const Used used = m_used[i];
    if (used.unchanged) continue;
    Entry& entry = *used.entry;
    const bool supported = entry.supported;
    const auto type = input.shapes.values[entry.index].type;
    readEntry(used.shape, entry, input, missing, shares);
    same = same && entry.supported == supported && input.shapes.values[entry.index].type == type;
  }
  return same;
}

void ShapeReader::remember(const WorldInput& input) {
  for (Used& used : m_used) {
    used.unchanged = isUnchanged(*used.shape, *used.entry, input);
    if (!used.unchanged) used.shape->getAabb(btTransform::getIdentity(), used.lower, used.upper);
  }
}

bool ShapeReader::hasChanged(const WorldInput& input) const {
  constexpr std::size_t kGrain = 128;
  std::atomic<bool> changed{false};
  parallelFor(m_used.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const Used& used = m_used[i];
      if (used.unchanged && !isUnchanged(*used.shape, *used.entry, input)) changed.store(true);
    }
  });
  // Among these are shapes of the application's own, for the caller's thread.
  return changed || std::any_of(m_used.begin(), m_used.end(), [](const Used& used) {
           if (used.unchanged) return false;
           btVector3 lower, upper;
           used.shape->getAabb(btTransform::getIdentity(), lower, upper);
           return lower != used.lower || upper != used.upper;
         });
}

void ShapeReader::end(WorldInput& input) {
  constexpr std::size_t kUnused = 64;  // not worth a walk over the table
  if (m_entries.size() >= 2 * m_used.size() + kUnused) {
    for (auto it = m_entries.begin(); it != m_entries.end();) {
      if (it->second.stamp == m_stamp) {
        ++it;
      } else {
        dropHull(it->second.index);
        m_compounds.erase(it->second.index);
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
  m_compounds.clear();
  m_meshes.clear();
  m_deadVertices = 0;
  m_used.clear();
  m_free.clear();
  m_lastShape = nullptr;
}

BTGPU_TRANSLATION_END
