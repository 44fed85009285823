// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "read_queries.h"

#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
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
                    sameArrays(known.poses, read.poses) && sameArrays(known.forms, read.forms) &&
                    sameArrays(known.aabbs, read.aabbs);
  if (!same) std::swap(known, read);
  return !same;
}

}  // namespace

// An axis sweep casts its rays through a tree of its own. Its proxies' AABBs are none until one is updated, which may
// never happen (setForceUpdateAllAabbs).
template <typename Index>
struct AxisSweep : btAxisSweep3Internal<Index> {
  static bool hasTree(const btBroadphaseInterface& broadphase) {
    return static_cast<const btAxisSweep3Internal<Index>&>(broadphase).*&AxisSweep::m_raycastAccelerator != nullptr;
  }
  static const btDbvtProxy* leafOf(const btBroadphaseProxy& proxy) {
    return static_cast<const btDbvtProxy*>(
        static_cast<const typename btAxisSweep3Internal<Index>::Handle&>(proxy).m_dbvtProxy);
  }
};

LeafOf leafFinderOf(const btBroadphaseInterface& broadphase) {
  if (isExactly<btDbvtBroadphase>(broadphase)) {
    return [](const btBroadphaseProxy& proxy) { return static_cast<const btDbvtProxy*>(&proxy); };
  }
  if (isExactly<btAxisSweep3>(broadphase) && AxisSweep<unsigned short>::hasTree(broadphase)) {
    return AxisSweep<unsigned short>::leafOf;
  }
  if (isExactly<bt32BitAxisSweep3>(broadphase) && AxisSweep<unsigned>::hasTree(broadphase)) {
    return AxisSweep<unsigned>::leafOf;
  }
  return nullptr;
}

void QueryReader::read(const btDiscreteDynamicsWorld& world, QueryBounds bounds, const double (&origin)[3],
                       const std::vector<const btConvexShape*>& moving) {
  m_bounds = bounds;
  m_leafOf = leafFinderOf(*world.getBroadphase());
  findItems(world.getCollisionObjectArray(), moving);
  bool changed = m_world.version == 0 || !m_world.shapes.shapes.changed.empty() || m_world.shapes.hulls.changed ||
                 m_world.shapes.meshes.changed;
  m_world.shapes.clearChanges();
  m_newChildren.clear();
  fill(m_device, false, origin, m_newItems);
  changed = replace(m_world.device, m_newItems) || changed;
  if (!sameArrays(m_world.children, m_newChildren)) {
    std::swap(m_world.children, m_newChildren);
    changed = true;
  }
  if (!sameArrays(m_world.spheres, m_newSpheres)) {
    std::swap(m_world.spheres, m_newSpheres);
    changed = true;
  }
  fill(m_host, true, origin, m_newItems);
  changed = replace(m_world.host, m_newItems) || changed;
  m_world.isDouble = sizeof(btScalar) == sizeof(double);
  if (changed) ++m_world.version;
}

// What kernels/lib/closest_points.h knows. Where both have polyhedral features stock's contacts, which are what closest
// points are held against, are others.
bool QueryReader::isForPairs(int shapeIndex) const {
  const Shape& shape = m_world.shapes.shapes.values[static_cast<std::size_t>(shapeIndex)];
  if (shape.type == SHAPE_COMPOUND) {
    const auto& leaves = leavesOf(shapeIndex);
    // A plane is known on one side of a pair, and by the pair's own shape.
    return !leaves.empty() && std::all_of(leaves.begin(), leaves.end(), [this](const CompoundLeaf& leaf) {
      const int type = m_world.shapes.shapes.values[static_cast<std::size_t>(leaf.shapeIndex)].type;
      return type != SHAPE_PLANE && isForPairs(leaf.shapeIndex);
    });
  }
  const bool isHull = shape.type == SHAPE_HULL || shape.type == SHAPE_BOX;
  return shape.type >= SHAPE_SPHERE && shape.type <= SHAPE_MULTI_SPHERE && !(isHull && shape.variant & HULL_POLYHEDRAL);
}

int QueryReader::readForPairs(const btCollisionShape& shape) {
  if (shape.isConcave() && !isExactly<btStaticPlaneShape>(shape)) return -1;
  const int index = isExactly<btCompoundShape>(shape) ? readShape(shape) : formOf(shape).shapeIndex;
  return index >= 0 && isForPairs(index) ? index : -1;
}

int QueryReader::readShape(const btCollisionShape& shape) {
  FallbackList ignored;
  return m_shapes.read(&shape, m_world.shapes, ignored, ignored);
}

const QueryReader::Form& QueryReader::formOf(const btCollisionShape& shape) {
  if (&shape == m_lastShape) return *m_lastForm;  // as neighbours in the world often are
  const auto [it, isNew] = m_forms.try_emplace(&shape);
  if (isNew) it->second = m_kind == QueryKind::Rays ? readForm(shape) : readSolidForm(shape);
  m_lastShape = &shape;
  m_lastForm = &it->second;
  return it->second;
}

static bool hasEvenScaling(const btCollisionShape& shape) {
  const btVector3& s = shape.getLocalScaling();
  return s.x() == s.y() && s.y() == s.z() && s.x() > btScalar(0);
}

// What sweeps meet, and what moves: the core and the margin that stage 44 knows, but where that is on purpose not what
// stock has (docs/decisions/0022-curved-shapes.md).
QueryReader::Form QueryReader::readSolidForm(const btCollisionShape& shape) {
  Form form;
  if (shape.isConvex()) {
    btScalar scale = 1;
    const btConvexShape& inner = innermostShape(static_cast<const btConvexShape&>(shape), scale);
    if (isExactly<btConvexPointCloudShape, btMultiSphereShape>(inner) && !hasEvenScaling(inner)) return form;
  }
  form.shapeIndex = readShape(shape);
  if (form.shapeIndex < 0) return form;
  const int type = m_world.shapes.shapes.values[static_cast<std::size_t>(form.shapeIndex)].type;
  if (!(type >= SHAPE_SPHERE && type <= SHAPE_MULTI_SPHERE) && type != SHAPE_MESH) form.shapeIndex = -1;
  return form;
}

QueryReader::Form QueryReader::readForm(const btCollisionShape& shape) {
  Form form;
  const btCollisionShape* inner = &shape;
  float4& scaling = form.item.scaling;
  if (shape.isConvex()) {
    btScalar scale = 1;
    inner = &innermostShape(static_cast<const btConvexShape&>(shape), scale);
    scaling = toFloat4(btVector3(scale, scale, scale));
  } else if (isExactly<btScaledBvhTriangleMeshShape>(shape)) {
    const auto& scaled = static_cast<const btScaledBvhTriangleMeshShape&>(shape);
    inner = scaled.getChildShape();
    scaling = toFloat4(scaled.getLocalScaling());
  } else if (isExactly<btHeightfieldTerrainShape>(shape)) {
    const HeightFieldRays rays = raysThrough(static_cast<const btHeightfieldTerrainShape&>(shape));
    if (!rays.sameTriangles) return form;
    form.item.flags = FORM_HEIGHT_FIELD | (rays.otherWinding ? FORM_OTHER_WINDING : 0);
  }
  form.shapeIndex = readShape(*inner);
  if (!isCastAt(*inner, form)) {
    form.shapeIndex = -1;
  } else if (isExactly<btMultiSphereShape>(*inner)) {
    addSpheres(static_cast<const btMultiSphereShape&>(*inner), form.item);
  }
  return form;
}

// Those that kernels/lib/ray_cast.h has a test for: in a double world only what does not need Bullet's own bits.
bool QueryReader::isCastAt(const btCollisionShape& inner, const Form& form) const {
  if (form.shapeIndex < 0) return false;
  const int type = m_world.shapes.shapes.values[static_cast<std::size_t>(form.shapeIndex)].type;
  if (type == SHAPE_PLANE || type == SHAPE_MESH) return true;
  if (sizeof(btScalar) == sizeof(double)) return type == SHAPE_SPHERE && form.item.scaling.x == 1;
  if (isExactly<btConvexPointCloudShape>(inner)) {
    // Stock looks for the farthest of the points as they are without it.
    if (!hasEvenScaling(inner)) return false;
  }
  return (type >= SHAPE_SPHERE && type <= SHAPE_MULTI_SPHERE);
}

// With what stock puts around them and takes off again: it counts in the last bit.
void QueryReader::addSpheres(const btMultiSphereShape& spheres, ItemForm& form) {
  const btVector3& scaling = spheres.getLocalScaling();
  m_newSpheres.push_back(toFloat4(scaling, static_cast<float>(spheres.getMargin())));
  form.firstSphere = static_cast<int>(m_newSpheres.size());
  form.sphereCount = spheres.getSphereCount();
  for (int i = 0; i < form.sphereCount; ++i) {
    m_newSpheres.push_back(
        toFloat4(spheres.getSpherePosition(i) * scaling, static_cast<float>(spheres.getSphereRadius(i))));
  }
}

void QueryReader::findItems(const btCollisionObjectArray& objects, const std::vector<const btConvexShape*>& moving) {
  m_device.clear();
  m_host.clear();
  m_hostShares.clear();
  m_positions.clear();
  for (int k = 0; k < objects.size(); ++k) m_positions.emplace_back(objects[k], k);
  std::sort(m_positions.begin(), m_positions.end());
  m_shapeOf.assign(static_cast<std::size_t>(objects.size()), -1);
  m_newSpheres.clear();
  m_forms.clear();
  m_lastShape = nullptr;
  m_shapes.begin();
  for (int k = 0; k < objects.size(); ++k) {
    const btCollisionObject& object = *objects[k];
    const auto position = static_cast<std::uint32_t>(k);
    // What has no proxy Bullet's queries don't find either; nor what is nowhere.
    if (!object.getBroadphaseHandle() || !object.getCollisionShape() || !isFinite(object.getWorldTransform())) continue;
    const btCollisionShape& shape = *object.getCollisionShape();
    if (isExactly<btEmptyShape>(shape)) continue;  // nothing meets it
    if (m_kind == QueryKind::Pairs) {
      m_shapeOf[static_cast<std::size_t>(k)] = readForPairs(shape);
      continue;
    }
    if (isExactly<btCompoundShape>(shape) && addChildren(object, position)) continue;
    const Form& form = formOf(shape);
    if (form.shapeIndex >= 0) {
      m_device.push_back({&object, position, form.shapeIndex, -1, form.item});
    } else {
      m_host.push_back({&object, position, 0, -1, form.item});
      m_hostShares.addShare(std::string(shape.getName()) + " shape", "batched queries by Bullet's own test on the CPU");
    }
  }
  for (const btConvexShape* shape : moving) formOf(*shape);
  m_shapes.end(m_world.shapes);
}

int QueryReader::movingShape(const btConvexShape* shape) const {
  const auto it = m_forms.find(shape);
  return it == m_forms.end() || shape->isConvex2d() ? -1 : it->second.shapeIndex;
}

int QueryReader::positionOf(const btCollisionObject* object) const {
  const auto it = std::lower_bound(m_positions.begin(), m_positions.end(), std::make_pair(object, 0));
  return it != m_positions.end() && it->first == object ? it->second : -1;
}

// Each child of a compound is an item; false if one of them is nothing for the device.
bool QueryReader::addChildren(const btCollisionObject& object, std::uint32_t position) {
  const auto& compound = *static_cast<const btCompoundShape*>(object.getCollisionShape());
  const std::size_t before = m_device.size();
  for (int c = 0; c < compound.getNumChildShapes(); ++c) {
    const btCollisionShape& shape = *compound.getChildShape(c);
    if (isExactly<btEmptyShape>(shape)) continue;
    const Form& form = formOf(shape);
    if (form.shapeIndex < 0 || !isFinite(compound.getChildTransform(c))) {
      m_device.resize(before);
      return false;
    }
    m_device.push_back({&object, position, form.shapeIndex, c, form.item});
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
  if (!m_leafOf) return toAabb(proxy->m_aabbMin, proxy->m_aabbMax, origin);
  const btDbvtVolume& volume = m_leafOf(*proxy)->leaf->volume;
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
  items.forms.resize(onHost ? 0 : count);
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
      items.forms[to] = f.form;
      items.forms[to].child = child[i];
      items.poses[to] = toItemPose(transform, origin);
    }
  });
}

BTGPU_TRANSLATION_END
