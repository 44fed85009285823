// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Batched queries: on the device if there is one and the batch is worth it, what it has no test
// for by Bullet itself, and all of it by Bullet on several threads where there is no device.
#include <algorithm>
#include <cmath>

#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>

#include "../translation/convert.h"
#include "../translation/exact_type.h"
#include "../translation/host_queries.h"
#include "../translation/parallel.h"
#include "batched_queries.h"
#include "batches.h"

BTGPU_TRANSLATION_BEGIN
namespace {

// Rays that go to the device at once; fewer where each may bring a list of objects for the host.
constexpr std::size_t kRays = 1 << 20, kRaysWithHost = 1 << 17;

// False for what hits nothing by definition.
bool isRay(const btGpuRay& ray) {
  return isFinite(ray.m_from) && isFinite(ray.m_to) && isFinite(ray.m_to - ray.m_from) &&
         (ray.m_to - ray.m_from).length2() > btScalar(0);
}
bool isForHost(const btGpuRay& ray) {
  return (ray.m_flags & btTriangleRaycastCallback::kF_UseGjkConvexCastRaytest) != 0;
}

HostRay toHost(const btGpuRay& ray) {
  return {ray.m_from,  ray.m_to,           ray.m_collisionFilterGroup, ray.m_collisionFilterMask,
          ray.m_flags, ray.m_ignoredObject};
}

void give(const HostRayHit& from, btGpuRayHit& to) {
  to.m_collisionObject = from.object;
  to.m_closestHitFraction = from.fraction;
  to.m_hitNormalWorld = from.normal;
  to.m_shapePart = from.part;
  to.m_triangleIndex = from.triangle;
}

class RayBatch {
 public:
  RayBatch(const btDiscreteDynamicsWorld& world, WorldState& state, const btGpuRay* rays, btGpuRayHit* hits)
      : m_world(world), m_objects(world.getCollisionObjectArray()), m_state(state), m_rays(rays), m_hits(hits) {}

  // False if the device failed: nothing has come of it.
  bool castOnDevice(Engine& engine, std::size_t count, bool broadphaseIsCurrent);
  void castOnHost(std::size_t first, std::size_t last, bool only(const btGpuRay&));
  std::size_t onHost() const { return m_onHost; }

 private:
  Ray toDevice(const btGpuRay& ray) const;
  void takeHits(std::size_t first, std::size_t count);
  void askHost(std::size_t first, std::size_t count);

  const btDiscreteDynamicsWorld& m_world;
  const btCollisionObjectArray& m_objects;
  WorldState& m_state;
  const btGpuRay* m_rays;
  btGpuRayHit* m_hits;
  double m_origin[3] = {0, 0, 0};
  bool m_threads = false;
  std::size_t m_onHost = 0;  // rays that the host cast
};

Ray RayBatch::toDevice(const btGpuRay& ray) const {
  Ray out;
  out.from = toLocal(ray.m_from, m_origin);
  out.to = toLocal(ray.m_to, m_origin);
  out.filterGroup = ray.m_collisionFilterGroup;
  out.filterMask = ray.m_collisionFilterMask;
  out.flags = ray.m_flags & (RAY_FILTER_BACKFACES | RAY_KEEP_UNFLIPPED_NORMAL | RAY_ALL_TRIANGLES);
  if (!isRay(ray) || isForHost(ray)) out.flags |= RAY_OFF;
  out.ignored = placeOfIgnored(m_state.queries, ray.m_ignoredObject);
  return out;
}

bool RayBatch::castOnDevice(Engine& engine, std::size_t count, bool broadphaseIsCurrent) {
  std::copy_n(m_state.reader.input().regionOrigin, 3, m_origin);
  const bool asks = broadphaseIsCurrent && !isExactly<btSimpleBroadphase>(*m_world.getBroadphase());
  {
    const Zone zone("readQueries");
    m_state.queries.read(m_world, asks ? QueryBounds::Broadphase : QueryBounds::Shapes, m_origin);
  }
  const bool host = !m_state.queries.world().host.infos.empty();
  m_threads = host && bearsThreads(m_objects);
  const std::size_t chunk = host ? kRaysWithHost : kRays;
  for (std::size_t first = 0; first < count; first += chunk) {
    const std::size_t n = std::min(chunk, count - first);
    m_state.deviceRays.resize(n);
    parallelFor(n, kBatchGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) m_state.deviceRays[i] = toDevice(m_rays[first + i]);
    });
    const Zone zone("castRays");
    if (engine.castRays(m_state.queries.world(), m_state.deviceRays.data(), n, m_state.rayResults) != Status::Ok)
      return false;
    takeHits(first, n);
    if (host) askHost(first, n);
  }
  for (const auto& share : m_state.queries.hostShares().entries()) m_state.fallbacks.addShare(share.what, share.reason);
  return true;
}

void RayBatch::takeHits(std::size_t first, std::size_t count) {
  parallelFor(count, kBatchGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const RayHit& from = m_state.rayResults.hits[i];
      btGpuRayHit& to = m_hits[first + i];
      to.m_collisionObject = from.object == NO_INDEX ? nullptr : m_objects[static_cast<int>(from.object)];
      to.m_closestHitFraction = btScalar(from.normal.w);
      to.m_hitNormalWorld = toBullet(from.normal);
      to.m_shapePart = from.part;
      to.m_triangleIndex = from.triangle;
    }
  });
}

// What the rays may hit of objects that the device has no test for.
void RayBatch::askHost(std::size_t first, std::size_t count) {
  const Zone zone("raysOnHost");
  const RayResults& r = m_state.rayResults;
  forEachQuery(count, m_threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t from = r.hostFirst[i], to = r.hostFirst[i + 1];
      if (from == to) continue;
      btGpuRayHit& known = m_hits[first + i];
      HostRayHit hit;
      hit.object = known.m_collisionObject;
      hit.normal = known.m_hitNormalWorld;
      hit.fraction = known.m_closestHitFraction;
      hit.part = known.m_shapePart;
      hit.triangle = known.m_triangleIndex;
      castAgainst(m_objects, &r.hostObjects[from], &r.hostEnters[from], to - from, toHost(m_rays[first + i]), hit);
      give(hit, known);
    }
  });
}

// The rays that `only` lets through.
void RayBatch::castOnHost(std::size_t first, std::size_t last, bool only(const btGpuRay&)) {
  const Zone zone("raysOnHost");
  forEachQuery(last - first, canCastAtOnce(m_world), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = first + begin; i < first + end; ++i) {
      if (only(m_rays[i]))
        give(isRay(m_rays[i]) ? castThroughWorld(m_world, toHost(m_rays[i])) : HostRayHit(), m_hits[i]);
    }
  });
  m_onHost += static_cast<std::size_t>(std::count_if(m_rays + first, m_rays + last, only));
}

// ---- closest points ------------------------------------------------------------------------------------------

class ClosestBatch {
 public:
  ClosestBatch(btDiscreteDynamicsWorld& world, WorldState& state, const btGpuClosestQuery* queries,
               btGpuClosestPoints* answers, std::size_t count)
      : m_world(world), m_state(state), m_queries(queries), m_answers(answers), m_count(count) {}

  void find(Engine* engine);

 private:
  // Each pair is the device's, the host's or makes no sense.
  void sort();
  bool isPair(const btGpuClosestQuery& query) const;
  int shapeOf(const btCollisionObject* object) const;
  bool isPlane(int shape) const { return shape >= 0 && typeOf(shape) == SHAPE_PLANE; }
  int typeOf(int shape) const { return world().shapes.shapes.values[static_cast<std::size_t>(shape)].type; }
  const QueryWorld& world() const { return m_state.pairQueries.world(); }
  void addQueries(const btGpuClosestQuery& query, int shapeA, int shapeB);
  void give(const btGpuClosestQuery& query, const ClosestAnswer& from, btGpuClosestPoints& to) const;
  void askContactTest(const btGpuClosestQuery& query, btGpuClosestPoints& to);

  btDiscreteDynamicsWorld& m_world;
  WorldState& m_state;
  const btGpuClosestQuery* m_queries;
  btGpuClosestPoints* m_answers;
  std::size_t m_count;
  // A pair for the device: one of its shapes with each other, [first, last) of m_down.
  struct Ours {
    std::size_t query, first, last;
  };
  std::vector<Ours> m_ours;
  std::vector<std::size_t> m_others;  // positions
  std::vector<ClosestQuery> m_down;
  std::vector<ClosestAnswer> m_up;
};

bool ClosestBatch::isPair(const btGpuClosestQuery& q) const {
  const auto isPlaced = [](const btCollisionObject& o) {
    return o.getCollisionShape() && isFinite(o.getWorldTransform());
  };
  if (!q.m_objectA || q.m_objectA == q.m_objectB || !(q.m_maxDistance == q.m_maxDistance)) return false;
  if (!isPlaced(*q.m_objectA)) return false;
  return q.m_objectB ? isPlaced(*q.m_objectB) : isFinite(q.m_point) && q.m_radius >= 0 && q.m_radius < BT_LARGE_FLOAT;
}

// Of one that is in the world, and has a shape for the device; else -1.
int ClosestBatch::shapeOf(const btCollisionObject* object) const {
  const int position = m_state.pairQueries.positionOf(object);
  return position < 0 ? -1 : m_state.pairQueries.shapeOf(position);
}

void ClosestBatch::sort() {
  for (std::size_t i = 0; i < m_count; ++i) {
    const btGpuClosestQuery& q = m_queries[i];
    m_answers[i] = btGpuClosestPoints();
    if (!isPair(q)) continue;
    const int a = shapeOf(q.m_objectA), b = q.m_objectB ? shapeOf(q.m_objectB) : -1;
    if (a < 0 || (q.m_objectB && b < 0) || (isPlane(a) && isPlane(b))) {
      m_others.push_back(i);
    } else {
      const std::size_t first = m_down.size();
      addQueries(q, a, b);
      m_ours.push_back({i, first, m_down.size()});
    }
  }
}

// A shape that is in no compound, and where.
struct PlacedLeaf {
  int shape;
  btTransform pose;
};

void addLeaves(const QueryReader& reader, int shape, const btTransform& pose, std::vector<PlacedLeaf>& leaves) {
  leaves.clear();
  if (shape < 0 || reader.world().shapes.shapes.values[static_cast<std::size_t>(shape)].type != SHAPE_COMPOUND) {
    leaves.push_back({shape, pose});
    return;
  }
  for (const CompoundLeaf& leaf : reader.leavesOf(shape)) {
    const float4& q = leaf.pose.orientation;
    const btQuaternion turn(btScalar(q.x), btScalar(q.y), btScalar(q.z), btScalar(q.w));
    leaves.push_back({leaf.shapeIndex, pose * btTransform(turn, toBullet(leaf.pose.position))});
  }
}

ItemPose poseFrom(const btTransform& t, const btVector3& origin) {
  const btVector3 at = t.getOrigin() - origin;
  const btMatrix3x3& m = t.getBasis();
  return {toFloat4(m[0], static_cast<float>(at.x())), toFloat4(m[1], static_cast<float>(at.y())),
          toFloat4(m[2], static_cast<float>(at.z()))};
}

// One for each two shapes of theirs; relative to A's position.
void ClosestBatch::addQueries(const btGpuClosestQuery& q, int shapeA, int shapeB) {
  thread_local std::vector<PlacedLeaf> ofA, ofB;
  const btTransform& a = q.m_objectA->getWorldTransform();
  const btTransform point(btQuaternion::getIdentity(), q.m_point);
  addLeaves(m_state.pairQueries, shapeA, a, ofA);
  addLeaves(m_state.pairQueries, shapeB, q.m_objectB ? q.m_objectB->getWorldTransform() : point, ofB);
  ClosestQuery out;
  out.radiusB = static_cast<float>(q.m_radius);
  out.limit = static_cast<float>(std::min(q.m_maxDistance, btScalar(BT_LARGE_FLOAT)));
  for (const PlacedLeaf& leafA : ofA) {
    out.poseA = poseFrom(leafA.pose, a.getOrigin());
    out.shapeA = leafA.shape;
    for (const PlacedLeaf& leafB : ofB) {
      out.poseB = poseFrom(leafB.pose, a.getOrigin());
      out.shapeB = leafB.shape;
      m_down.push_back(out);
    }
  }
}

void ClosestBatch::give(const btGpuClosestQuery& query, const ClosestAnswer& from, btGpuClosestPoints& to) const {
  if (!from.found) return;
  const btVector3& origin = query.m_objectA->getWorldTransform().getOrigin();
  to.m_found = true;
  to.m_distance = btScalar(from.normal.w);
  to.m_normalOnB = toBullet(from.normal);
  to.m_pointOnA = origin + toBullet(from.onA);
  to.m_pointOnB = origin + toBullet(from.onB);
}

void ClosestBatch::askContactTest(const btGpuClosestQuery& query, btGpuClosestPoints& to) {
  btSphereShape ball(query.m_radius);
  btCollisionObject probe;
  probe.setCollisionShape(&ball);
  probe.setWorldTransform(btTransform(btQuaternion::getIdentity(), query.m_point));
  const HostClosest closest =
      closestByContactTest(m_world, *query.m_objectA, query.m_objectB ? *query.m_objectB : probe, query.m_maxDistance);
  if (!closest.found) return;
  to.m_found = true;
  to.m_distance = closest.distance;
  to.m_normalOnB = closest.normalOnB;
  to.m_pointOnA = closest.onA;
  to.m_pointOnB = closest.onB;
}

// Without a device the same functions run on the host.
void ClosestBatch::find(Engine* engine) {
  m_state.pairQueries.read(m_world, QueryBounds::Shapes, m_state.reader.input().regionOrigin);
  sort();
  const bool onDevice = engine && engine->closestPoints(world(), m_down, m_up) == Status::Ok;
  if (engine && !onDevice) m_state.fallbacks.addShare("batched closest points", engine->lastError());
  if (!onDevice) closestOnHost(world(), m_down, m_up);
  parallelFor(m_ours.size(), kBatchGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      const Ours& ours = m_ours[k];
      const ClosestAnswer* nearest = &m_up[ours.first];
      for (std::size_t i = ours.first + 1; i < ours.last; ++i) {
        if (m_up[i].found && (!nearest->found || m_up[i].normal.w < nearest->normal.w)) nearest = &m_up[i];
      }
      give(m_queries[ours.query], *nearest, m_answers[ours.query]);
    }
  });
  for (const std::size_t i : m_others) askContactTest(m_queries[i], m_answers[i]);
  if (!m_others.empty()) {
    m_state.fallbacks.addShare("closest points", "pairs with a shape that the device lacks, by contactPairTest",
                               m_others.size());
  }
  m_state.statistics.m_devicePairs += onDevice ? m_ours.size() : 0;
  m_state.statistics.m_hostPairs += m_count - (onDevice ? m_ours.size() : 0);
}

}  // namespace

void rayTestBatch(const btDiscreteDynamicsWorld& world, const btGpuRay* rays, btGpuRayHit* hits, int count) {
  if (count <= 0) return;
  const auto state = findState(&world);
  const WorldScope scope(state->zones);
  const Zone zone("rayTestBatch");
  const auto n = static_cast<std::size_t>(count);
  RayBatch batch(world, *state, rays, hits);
  const bool broadphaseIsCurrent = state->settings.m_hostQueries || state->lastPath != Path::Device;
  Engine* engine = engineFor(*state, count);
  bool done = engine && batch.castOnDevice(*engine, n, broadphaseIsCurrent);
  if (engine && !done) state->fallbacks.addShare("batched rays", engine->lastError());
  const bool anyForHost = std::any_of(rays, rays + n, isForHost);
  if ((!done || anyForHost) && !broadphaseIsCurrent) state->aabbs.update(const_cast<btDiscreteDynamicsWorld&>(world));
  if (!done) batch.castOnHost(0, n, [](const btGpuRay&) { return true; });
  if (done && anyForHost) {
    batch.castOnHost(0, n, isForHost);
    state->fallbacks.addShare("kF_UseGjkConvexCastRaytest", "batched rays by Bullet's own test on the CPU");
  }
  state->statistics.m_hostRays += batch.onHost();
  state->statistics.m_deviceRays += n - batch.onHost();
}

void closestPointsBatch(const btDiscreteDynamicsWorld& world, const btGpuClosestQuery* queries,
                        btGpuClosestPoints* answers, int count) {
  if (count <= 0) return;
  const auto state = findState(&world);
  const WorldScope scope(state->zones);
  const Zone zone("closestPointsBatch");
  // contactPairTest is not const, but leaves the world as it is.
  ClosestBatch batch(const_cast<btDiscreteDynamicsWorld&>(world), *state, queries, answers,
                     static_cast<std::size_t>(count));
  batch.find(engineFor(*state, count));
}

BTGPU_TRANSLATION_END
