// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Batched sweeps, as rays are in batched_queries.cpp.
#include <LinearMath/btTransformUtil.h>

#include <algorithm>

#include "../translation/convert.h"
#include "../translation/exact_type.h"
#include "../translation/host_queries.h"
#include "../translation/parallel.h"
#include "batched_queries.h"
#include "batches.h"

BTGPU_TRANSLATION_BEGIN
namespace {

constexpr std::size_t kSweeps = 1 << 17;  // that go to the device at once

bool isSweep(const btGpuSweep& sweep) {
  const btVector3 along = sweep.m_to.getOrigin() - sweep.m_from.getOrigin();
  return sweep.m_shape && isFinite(sweep.m_from) && isFinite(sweep.m_to) && isFinite(along) &&
         along.length2() > btScalar(0);
}

HostSweep toHost(const btGpuSweep& sweep) {
  return {sweep.m_shape,
          sweep.m_from,
          sweep.m_to,
          sweep.m_collisionFilterGroup,
          sweep.m_collisionFilterMask,
          sweep.m_allowedCcdPenetration,
          sweep.m_ignoredObject};
}

void give(const HostSweepHit& from, btGpuSweepHit& to) {
  to.m_collisionObject = from.object;
  to.m_closestHitFraction = from.fraction;
  to.m_hitNormalWorld = from.normal;
  to.m_hitPointWorld = from.point;
}

float4 toQuaternion(const btQuaternion& q) {
  return {static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()), static_cast<float>(q.w())};
}

// Each shape once.
std::vector<const btConvexShape*> movingShapes(const btGpuSweep* sweeps, std::size_t count) {
  std::vector<const btConvexShape*> shapes;
  for (std::size_t i = 0; i < count; ++i) {
    if (sweeps[i].m_shape && (shapes.empty() || shapes.back() != sweeps[i].m_shape))
      shapes.push_back(sweeps[i].m_shape);
  }
  std::sort(shapes.begin(), shapes.end());
  shapes.erase(std::unique(shapes.begin(), shapes.end()), shapes.end());
  return shapes;
}

class SweepBatch {
 public:
  SweepBatch(const btDiscreteDynamicsWorld& world, WorldState& state, const btGpuSweep* sweeps, btGpuSweepHit* hits,
             std::size_t count)
      : m_world(world),
        m_objects(world.getCollisionObjectArray()),
        m_state(state),
        m_sweeps(sweeps),
        m_hits(hits),
        m_count(count),
        m_shapes(movingShapes(sweeps, count)) {
    m_bear = std::all_of(m_shapes.begin(), m_shapes.end(), [](const auto* shape) { return bearsThreads(*shape); });
  }

  // False if the device failed: nothing has come of it.
  bool castOnDevice(Engine& engine, QueryBounds bounds);
  // All of them, or those whose shape the device lacks. Returns how many.
  std::size_t castOnHost(bool all);

 private:
  bool isForDevice(const btGpuSweep& sweep) const { return m_state.sweepQueries.movingShape(sweep.m_shape) >= 0; }
  Sweep toDevice(const btGpuSweep& sweep) const;
  void takeHits(std::size_t first, std::size_t count);
  void askHost(std::size_t first, std::size_t count);

  const btDiscreteDynamicsWorld& m_world;
  const btCollisionObjectArray& m_objects;
  WorldState& m_state;
  const btGpuSweep* m_sweeps;
  btGpuSweepHit* m_hits;
  std::size_t m_count;
  std::vector<const btConvexShape*> m_shapes;
  bool m_bear;  // the shapes that move bear threads
  double m_origin[3] = {0, 0, 0};
};

Sweep SweepBatch::toDevice(const btGpuSweep& sweep) const {
  Sweep out{};
  out.shape = -1;
  out.ignored = NO_INDEX;
  if (!isSweep(sweep) || !isForDevice(sweep)) return out;
  out.shape = m_state.sweepQueries.movingShape(sweep.m_shape);
  out.from = toLocal(sweep.m_from.getOrigin(), m_origin);
  out.to = toLocal(sweep.m_to.getOrigin(), m_origin);
  out.orientation = toQuaternion(sweep.m_from.getRotation());
  btVector3 linear, angular, lower, upper;
  btTransformUtil::calculateVelocity(sweep.m_from, sweep.m_to, btScalar(1), linear, angular);
  out.turn = toFloat4(angular, static_cast<float>(angular.length() * sweep.m_shape->getAngularMotionDisc()));
  boundsOfSweep(toHost(sweep), lower, upper);
  out.lower = toFloat4(lower);
  out.upper = toFloat4(upper);
  out.filterGroup = sweep.m_collisionFilterGroup;
  out.filterMask = sweep.m_collisionFilterMask;
  out.allowedPenetration = static_cast<float>(sweep.m_allowedCcdPenetration);
  out.ignored = placeOfIgnored(m_state.sweepQueries, sweep.m_ignoredObject);
  return out;
}

bool SweepBatch::castOnDevice(Engine& engine, QueryBounds bounds) {
  std::copy_n(m_state.reader.input().regionOrigin, 3, m_origin);
  {
    const Zone zone("readQueries");
    m_state.sweepQueries.read(m_world, bounds, m_origin, m_shapes);
  }
  const QueryWorld& world = m_state.sweepQueries.world();
  for (std::size_t first = 0; first < m_count; first += kSweeps) {
    const std::size_t n = std::min(kSweeps, m_count - first);
    m_state.deviceSweeps.resize(n);
    forEachQuery(n, m_bear, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) m_state.deviceSweeps[i] = toDevice(m_sweeps[first + i]);
    });
    const Zone zone("castSweeps");
    if (engine.castSweeps(world, m_state.deviceSweeps.data(), n, m_state.sweepResults) != Status::Ok) return false;
    takeHits(first, n);
    if (!world.host.infos.empty()) askHost(first, n);
  }
  for (const auto& share : m_state.sweepQueries.hostShares().entries()) {
    m_state.fallbacks.addShare(share.what, share.reason);
  }
  return true;
}

void SweepBatch::takeHits(std::size_t first, std::size_t count) {
  const btVector3 origin{btScalar(m_origin[0]), btScalar(m_origin[1]), btScalar(m_origin[2])};
  parallelFor(count, kBatchGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SweepHit& from = m_state.sweepResults.hits[i];
      btGpuSweepHit& to = m_hits[first + i];
      to = btGpuSweepHit();
      if (from.object == NO_INDEX) continue;
      to.m_collisionObject = m_objects[static_cast<int>(from.object)];
      to.m_closestHitFraction = btScalar(from.normal.w);
      to.m_hitNormalWorld = toBullet(from.normal);
      to.m_hitPointWorld = origin + toBullet(from.point);
    }
  });
}

// What the sweeps may hit of objects that the device has no test for.
void SweepBatch::askHost(std::size_t first, std::size_t count) {
  const Zone zone("sweepsOnHost");
  const SweepResults& r = m_state.sweepResults;
  forEachQuery(count, m_bear && bearsThreads(m_objects), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t from = r.hostFirst[i], to = r.hostFirst[i + 1];
      if (from == to) continue;
      btGpuSweepHit& known = m_hits[first + i];
      HostSweepHit hit;
      hit.object = known.m_collisionObject;
      hit.normal = known.m_hitNormalWorld;
      hit.point = known.m_hitPointWorld;
      hit.fraction = known.m_closestHitFraction;
      sweepAgainst(m_objects, &r.hostObjects[from], &r.hostEnters[from], to - from, toHost(m_sweeps[first + i]), hit);
      give(hit, known);
    }
  });
}

std::size_t SweepBatch::castOnHost(bool all) {
  const Zone zone("sweepsOnHost");
  const auto isMine = [&](const btGpuSweep& sweep) { return all || (isSweep(sweep) && !isForDevice(sweep)); };
  forEachQuery(m_count, m_bear && canCastAtOnce(m_world), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!isMine(m_sweeps[i])) continue;
      m_hits[i] = btGpuSweepHit();
      if (isSweep(m_sweeps[i])) give(sweepThroughWorld(m_world, toHost(m_sweeps[i])), m_hits[i]);
    }
  });
  return static_cast<std::size_t>(std::count_if(m_sweeps, m_sweeps + m_count, isMine));
}

}  // namespace

void convexSweepBatch(const btDiscreteDynamicsWorld& world, const btGpuSweep* sweeps, btGpuSweepHit* hits, int count) {
  if (count <= 0) return;
  const auto state = findState(&world);
  const WorldScope scope(state->zones);
  const Zone zone("convexSweepBatch");
  const auto n = static_cast<std::size_t>(count);
  SweepBatch batch(world, *state, sweeps, hits, n);
  const bool broadphaseIsCurrent = state->settings.m_hostQueries || state->lastPath != Path::Device;
  const bool asks = broadphaseIsCurrent && !isExactly<btSimpleBroadphase>(*world.getBroadphase());
  Engine* engine = engineFor(*state, count);
  const bool done = engine && batch.castOnDevice(*engine, asks ? QueryBounds::Broadphase : QueryBounds::Shapes);
  if (engine && !done) state->fallbacks.addShare("batched sweeps", engine->lastError());
  const bool anyForHost = !done || std::any_of(sweeps, sweeps + n, [&](const btGpuSweep& sweep) {
    return isSweep(sweep) && state->sweepQueries.movingShape(sweep.m_shape) < 0;
  });
  std::size_t onHost = 0;
  if (anyForHost) {
    if (!broadphaseIsCurrent) state->aabbs.update(const_cast<btDiscreteDynamicsWorld&>(world));
    onHost = batch.castOnHost(!done);
    if (done) state->fallbacks.addShare("batched sweeps", "of a shape that the device lacks, by Bullet's own test");
  }
  state->statistics.m_hostSweeps += onHost;
  state->statistics.m_deviceSweeps += n - onHost;
}

BTGPU_TRANSLATION_END
