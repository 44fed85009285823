// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "read_queries.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/NarrowPhaseCollision/btConvexCast.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "convert.h"
#include "exact_type.h"
#include "parallel.h"

BTGPU_TRANSLATION_BEGIN
namespace {

constexpr std::size_t kChunk = 512;  // items a thread fills at a time
// Wider bounds say nothing and would stretch the tree: a plane's.
constexpr float kBoundless = 1e12f;

ItemPose toItemPose(const btTransform& t, const double (&origin)[3]) {
  const float4 o = toLocal(t.getOrigin(), origin);
  const btMatrix3x3& m = t.getBasis();
  return {toFloat4(m[0], o.x), toFloat4(m[1], o.y), toFloat4(m[2], o.z)};
}

bool isFinite(const btTransform& t) {
  btScalar sum = t.getOrigin().x() + t.getOrigin().y() + t.getOrigin().z();
  for (int k = 0; k < 3; ++k) sum += t.getBasis()[k].x() + t.getBasis()[k].y() + t.getBasis()[k].z();
  return std::isfinite(double(sum));
}

Aabb toAabb(const btVector3& lower, const btVector3& upper, const double (&origin)[3]) {
  return {toLocal(lower, origin), toLocal(upper, origin)};
}

// NaN counts as boundless.
bool isBounded(const Aabb& box) {
  const float4 size = box.upper - box.lower;
  return size.x < kBoundless && size.y < kBoundless && size.z < kBoundless;
}

template <typename T>
bool sameArrays(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(static_cast<const void*>(a.data()), static_cast<const void*>(b.data()),
                                   a.size() * sizeof(T)) == 0);
}

// Takes over what was read anew; true if it is something else.
bool replace(QueryItems& known, QueryItems& read) {
  const bool same = known.treeCount == read.treeCount && sameArrays(known.infos, read.infos) &&
                    sameArrays(known.poses, read.poses) && sameArrays(known.childOf, read.childOf) &&
                    sameArrays(known.aabbs, read.aabbs);
  if (!same) std::swap(known, read);
  return !same;
}

}  // namespace

void QueryReader::read(const btDiscreteDynamicsWorld& world, QueryBounds bounds, const double (&origin)[3]) {
  m_bounds = bounds;
  m_dbvt = isExactly<btDbvtBroadphase>(*world.getBroadphase());
  findItems(world.getCollisionObjectArray());
  bool changed = m_world.version == 0 || !m_world.shapes.shapes.changed.empty() || m_world.shapes.hulls.changed;
  m_world.shapes.clearChanges();
  m_newChildren.clear();
  fill(m_device, false, origin, m_newItems);
  changed = replace(m_world.device, m_newItems) || changed;
  if (!sameArrays(m_world.children, m_newChildren)) {
    std::swap(m_world.children, m_newChildren);
    changed = true;
  }
  fill(m_host, true, origin, m_newItems);
  changed = replace(m_world.host, m_newItems) || changed;
  m_world.isDouble = sizeof(btScalar) == sizeof(double);
  if (changed) ++m_world.version;
}

// Of the shapes that the reader knows, those that kernels/lib/closest_points.h knows, too. What the device takes for a
// hull though Bullet has a class of its own for it may answer otherwise there.
bool QueryReader::isConvexOrPlane(const btCollisionShape& from, int shapeIndex) const {
  if (shapeIndex < 0) return false;
  const Shape& shape = m_world.shapes.shapes.values[static_cast<std::size_t>(shapeIndex)];
  if (shape.type == SHAPE_HULL) return isExactly<btConvexHullShape>(from) && shape.variant == 0;
  if (shape.type == SHAPE_BOX) return isExactly<btBoxShape>(from) && shape.variant == 0;
  return shape.type == SHAPE_SPHERE || shape.type == SHAPE_PLANE || shape.type == SHAPE_CAPSULE;
}

// Those that kernels/lib/ray_cast.h has a test for: in a double world only what does not need Bullet's own bits.
bool QueryReader::isTested(const btCollisionShape& from, int shapeIndex) const {
  if (!isConvexOrPlane(from, shapeIndex)) return false;
  if (sizeof(btScalar) == sizeof(float)) return true;
  const int type = m_world.shapes.shapes.values[static_cast<std::size_t>(shapeIndex)].type;
  return type == SHAPE_SPHERE || type == SHAPE_PLANE;
}

void QueryReader::findItems(const btCollisionObjectArray& objects) {
  m_device.clear();
  m_host.clear();
  m_hostShares.clear();
  m_positions.clear();
  for (int k = 0; k < objects.size(); ++k) m_positions.emplace_back(objects[k], k);
  std::sort(m_positions.begin(), m_positions.end());
  m_shapeOf.assign(static_cast<std::size_t>(objects.size()), -1);
  m_shapes.begin();
  FallbackList ignored;
  for (int k = 0; k < objects.size(); ++k) {
    const btCollisionObject& object = *objects[k];
    const auto position = static_cast<std::uint32_t>(k);
    // What has no proxy Bullet's queries don't find either; nor what is nowhere.
    if (!object.getBroadphaseHandle() || !object.getCollisionShape() || !isFinite(object.getWorldTransform())) continue;
    const btCollisionShape& shape = *object.getCollisionShape();
    if (isExactly<btCompoundShape>(shape) && addChildren(object, position)) continue;
    const int index = m_shapes.read(&shape, m_world.shapes, ignored, ignored);
    if (isConvexOrPlane(shape, index)) m_shapeOf[static_cast<std::size_t>(k)] = index;
    if (isTested(shape, index)) {
      m_device.push_back({&object, position, index, -1});
    } else {
      m_host.push_back({&object, position, 0, -1});
      m_hostShares.addShare(std::string(shape.getName()) + " shape", "batched queries by Bullet's own test on the CPU");
    }
  }
  m_shapes.end(m_world.shapes);
}

int QueryReader::positionOf(const btCollisionObject* object) const {
  const auto it = std::lower_bound(m_positions.begin(), m_positions.end(), std::make_pair(object, 0));
  return it != m_positions.end() && it->first == object ? it->second : -1;
}

// Each child of a compound is an item; false if one of them is nothing for the device.
bool QueryReader::addChildren(const btCollisionObject& object, std::uint32_t position) {
  const auto& compound = *static_cast<const btCompoundShape*>(object.getCollisionShape());
  const std::size_t before = m_device.size();
  FallbackList ignored;
  for (int c = 0; c < compound.getNumChildShapes(); ++c) {
    const int index = m_shapes.read(compound.getChildShape(c), m_world.shapes, ignored, ignored);
    if (!isTested(*compound.getChildShape(c), index) || !isFinite(compound.getChildTransform(c))) {
      m_device.resize(before);
      return false;
    }
    m_device.push_back({&object, position, index, c});
  }
  return true;
}

Aabb QueryReader::boundsOf(const Found& found, const double (&origin)[3]) const {
  const btCollisionObject& object = *found.object;
  const btBroadphaseProxy* proxy = object.getBroadphaseHandle();
  if (m_bounds == QueryBounds::Shapes) {
    btVector3 lower, upper;
    object.getCollisionShape()->getAabb(object.getWorldTransform(), lower, upper);
    const btVector3 threshold(gContactBreakingThreshold, gContactBreakingThreshold, gContactBreakingThreshold);
    return toAabb(lower - threshold, upper + threshold, origin);
  }
  if (!m_dbvt) return toAabb(proxy->m_aabbMin, proxy->m_aabbMax, origin);
  const btDbvtVolume& volume = static_cast<const btDbvtProxy*>(proxy)->leaf->volume;
  return toAabb(volume.Mins(), volume.Maxs(), origin);
}

// The bounds of a child: where it is now. They only lead the ray there; what stock asks is in CompoundChild.
static Aabb boundsOfChild(const btCollisionShape& shape, const btTransform& transform, const double (&origin)[3]) {
  btVector3 lower, upper;
  shape.getAabb(transform, lower, upper);
  // Further than Bullet's casts reach around a shape (MAX_CONVEX_CAST_EPSILON).
  const btScalar reach = btScalar(1.01) * btSqrt(MAX_CONVEX_CAST_EPSILON);
  const btVector3 around(reach, reach, reach);
  return toAabb(lower - around, upper + around, origin);
}

static CompoundChild childOf(const btCollisionObject& object, int child, const Aabb& objectAabb,
                             const double (&origin)[3]) {
  const auto& compound = *static_cast<const btCompoundShape*>(object.getCollisionShape());
  CompoundChild out{};
  out.pose = toItemPose(object.getWorldTransform(), origin);
  out.objectAabb = objectAabb;
  out.child = child;
  const btVector3 all(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT);
  btVector3 lower = -all, upper = all;
  if (compound.getDynamicAabbTree()) {
    const auto& node = *const_cast<btCompoundShape&>(compound).getChildList()[child].m_node;
    lower = node.volume.Mins();
    upper = node.volume.Maxs();
  }
  out.childAabb = {toFloat4(lower), toFloat4(upper)};
  return out;
}

void QueryReader::fill(const std::vector<Found>& found, bool onHost, const double (&origin)[3], QueryItems& items) {
  const std::size_t count = found.size();
  items.infos.resize(count);
  items.aabbs.resize(count);
  items.poses.resize(onHost ? 0 : count);
  items.childOf.resize(onHost ? 0 : count);
  // Bounded items first, each kind in the order in which they were found.
  std::vector<Aabb> bounds(count);
  std::vector<std::uint32_t> place(count), child(count, NO_INDEX);
  parallelFor(count, kChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) bounds[i] = boundsOf(found[i], origin);
  });
  std::uint32_t bounded = 0, boundless = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (isBounded(bounds[i]) || found[i].child >= 0) ++bounded;
    if (found[i].child < 0) continue;
    child[i] = static_cast<std::uint32_t>(m_newChildren.size());
    m_newChildren.emplace_back();
  }
  items.treeCount = bounded;
  for (std::size_t i = 0; i < count; ++i) {
    place[i] =
        isBounded(bounds[i]) || found[i].child >= 0 ? items.treeCount - bounded-- : items.treeCount + boundless++;
  }
  parallelFor(count, kChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const Found& f = found[i];
      const btBroadphaseProxy& proxy = *f.object->getBroadphaseHandle();
      const std::uint32_t to = place[i];
      items.infos[to] = BodyInfo{};
      items.infos[to].shapeIndex = f.shapeIndex;
      items.infos[to].flags = BODY_PRESENT;
      items.infos[to].filterGroup = proxy.m_collisionFilterGroup;
      items.infos[to].filterMask = proxy.m_collisionFilterMask;
      items.infos[to].uniqueId = static_cast<int>(f.position);
      items.aabbs[to] = bounds[i];
      if (onHost) continue;
      btTransform transform = f.object->getWorldTransform();
      if (f.child >= 0) {
        const auto& compound = *static_cast<const btCompoundShape*>(f.object->getCollisionShape());
        transform = transform * compound.getChildTransform(f.child);
        items.aabbs[to] = boundsOfChild(*compound.getChildShape(f.child), transform, origin);
        m_newChildren[child[i]] = childOf(*f.object, f.child, bounds[i], origin);
      }
      items.childOf[to] = child[i];
      items.poses[to] = toItemPose(transform, origin);
    }
  });
}

BTGPU_TRANSLATION_END
