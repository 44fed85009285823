// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "quality.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bullet_file.h"
#include "free_run.h"

namespace btgpu::tool {
namespace {

constexpr int kLastSteps = 60;

template <typename Joint>
double pivotGap(const Joint& j, const btVector3& inA, const btVector3& inB) {
  return double((j.getRigidBodyA().getWorldTransform() * inA).distance(j.getRigidBodyB().getWorldTransform() * inB));
}

// Distance of the points that a joint is to hold together; nullopt where there are no such points.
std::optional<double> gapOf(const btTypedConstraint& joint) {
  switch (joint.getConstraintType()) {
    case POINT2POINT_CONSTRAINT_TYPE: {
      const auto& j = static_cast<const btPoint2PointConstraint&>(joint);
      return pivotGap(j, j.getPivotInA(), j.getPivotInB());
    }
    case HINGE_CONSTRAINT_TYPE: {
      const auto& j = static_cast<const btHingeConstraint&>(joint);
      return pivotGap(j, j.getAFrame().getOrigin(), j.getBFrame().getOrigin());
    }
    case CONETWIST_CONSTRAINT_TYPE: {
      const auto& j = static_cast<const btConeTwistConstraint&>(joint);
      return pivotGap(j, j.getAFrame().getOrigin(), j.getBFrame().getOrigin());
    }
    case FIXED_CONSTRAINT_TYPE: {
      const auto& j = static_cast<const btFixedConstraint&>(joint);
      return pivotGap(j, j.getFrameOffsetA().getOrigin(), j.getFrameOffsetB().getOrigin());
    }
    default:
      return std::nullopt;
  }
}

double highestOf(const btDiscreteDynamicsWorld& world) {
  double highest = -1e30;
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    const btCollisionObject* o = world.getCollisionObjectArray()[i];
    if (!o->isStaticOrKinematicObject()) highest = std::max(highest, double(o->getWorldTransform().getOrigin().y()));
  }
  return highest;
}

double energyOf(const WorldFigures& f) { return (f.kineticEnergy + f.potentialEnergy) * f.moving; }

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// What is summed up over the last steps.
struct Resting {
  double energy = 0, gaps = 0, largestGap = 0;
  long gapCount = 0;
  std::vector<double> depths;

  void add(const btDiscreteDynamicsWorld& world, btDispatcher& dispatcher, const WorldFigures& figures) {
    energy += figures.kineticEnergy / kLastSteps;
    for (int i = 0; i < world.getNumConstraints(); ++i) {
      const auto gap = gapOf(*world.getConstraint(i));
      if (!gap) continue;
      gaps += *gap;
      largestGap = std::max(largestGap, *gap);
      ++gapCount;
    }
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
      const btPersistentManifold* m = dispatcher.getManifoldByIndexInternal(i);
      for (int k = 0; k < m->getNumContacts(); ++k) {
        depths.push_back(std::max(0.0, -double(m->getContactPoint(k).getDistance())));
      }
    }
  }
};

template <typename World>
Quality run(TestWorld<World>& test, const QualityScene& scene) {
  using Clock = std::chrono::steady_clock;
  World& world = test.world();
  const WorldFigures start = measureWorld(world, -1e30);
  Quality q;
  q.heightAtStart = start.meanHeight;
  q.topAtStart = highestOf(world);
  Resting resting;
  std::vector<double> times;
  WorldFigures now = start;
  for (int step = 0; step < scene.steps; ++step) {
    const auto began = Clock::now();
    world.stepSimulation(static_cast<btScalar>(scene.timeStep), 0);
    times.push_back(std::chrono::duration<double, std::milli>(Clock::now() - began).count());
    now = measureWorld(world, -1e30);
    q.gainedEnergy = std::max(q.gainedEnergy, energyOf(now) - energyOf(start));
    if (step >= scene.steps - kLastSteps) resting.add(world, test.dispatcher(), now);
  }
  q.heightAtEnd = now.meanHeight;
  q.topAtEnd = highestOf(world);
  q.lostEnergy = energyOf(start) - energyOf(now);
  q.restingEnergy = resting.energy;
  q.meanGap = resting.gapCount > 0 ? resting.gaps / static_cast<double>(resting.gapCount) : 0;
  q.largestGap = resting.largestGap;
  q.depth99 = percentile(resting.depths, 0.99);
  q.milliseconds = percentile(times, 0.5);
  q.joints = world.getNumConstraints();
  return q;
}

}  // namespace

Quality measureQuality(const QualityScene& scene, std::optional<btGpuSolver> solver, const btGpuSettings& wanted) {
  if (!solver) {
    TestWorld<btDiscreteDynamicsWorld> test(scene.build);
    return run(test, scene);
  }
  btGpuSettings settings = wanted;
  settings.m_solver = solver;
  settings.m_smallWorld = 0;
  TestWorld<btGpuDynamicsWorld> test(scene.build, settings);
  const Quality q = run(test, scene);
  if (test.world().statistics().m_stockSteps > 0)
    throw InputError("a step of " + scene.name + " ran on the stock path");
  return q;
}

}  // namespace btgpu::tool
