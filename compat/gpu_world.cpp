// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The shells around WorldStep: a world class each, of which applications make objects.
#include <tuple>

#include "../translation/virtual_table.h"
#include "batched_queries.h"
#include "btGpuSoftRigidDynamicsWorld.h"
#include "world_state.h"
#include "world_step.h"

using btgpu::Path;
using btgpu::Zone;

template <typename Base>
void btGpuWorld<Base>::begin(const btGpuSettings& settings) {
  btgpu::replaceState(this, settings)->ownTable = btgpu::virtualTableOf(this);
}

template <typename Base>
btGpuWorld<Base>::~btGpuWorld() {
  btgpu::eraseState(this);
}

template <typename Base>
void btGpuWorld<Base>::configure(btGpuWorld* world, const btGpuSettings& settings) {
  const auto state = btgpu::findState(world);
  const auto hadProfile = state->zones.profile();
  state->zones.useFile(settings.m_profileFile);
  const auto engineSettings = [](const btGpuSettings& s) {
    return std::tie(s.m_device, s.m_profile, s.m_debugKernels, s.m_hostStages, s.m_checkStages);
  };
  const bool sameEngine =
      engineSettings(state->settings) == engineSettings(settings) && hadProfile == state->zones.profile();
  state->settings = settings;
  state->small.use(settings);
  state->crosscheck.reset();
  state->crosscheckAsked = false;
  state->rest.forget();
  if (sameEngine && state->engine) return;
  state->engine.reset();
  state->engineError.clear();
  state->engineRetry.forget();
  state->forgetWorld();
  if (state->lastPath == Path::Device) state->lastPath = Path::None;
}

template <typename Base>
void btGpuWorld<Base>::addCollisionObject(btCollisionObject* collisionObject, int collisionFilterGroup,
                                          int collisionFilterMask) {
  Base::addCollisionObject(collisionObject, collisionFilterGroup, collisionFilterMask);
  btgpu::findState(this)->reader.noteAdded(collisionObject);
}

template <typename Base>
std::vector<btGpuFallback> btGpuWorld<Base>::fallbackReport() const {
  std::vector<btGpuFallback> report;
  for (const auto& entry : btgpu::findState(this)->fallbacks.entries()) {
    report.push_back({entry.what, entry.reason, entry.count, entry.wholeStep});
  }
  return report;
}

template <typename Base>
btGpuStatistics btGpuWorld<Base>::statistics() const {
  return btgpu::findState(this)->statistics;
}

template <typename Base>
btGpuCrosscheckSummary btGpuWorld<Base>::crosscheck() const {
  const auto check = btgpu::findState(this)->crosscheck;
  return check ? check->summary() : btGpuCrosscheckSummary();
}

template <typename Base>
std::vector<btGpuStageTime> btGpuWorld<Base>::takeProfile() {
  std::vector<btGpuStageTime> times;
  const auto state = btgpu::findState(this);
  if (!state->engine) return times;
  for (const auto& t : state->engine->takeProfile()) times.push_back({t.stage, t.milliseconds, t.launches});
  return times;
}

template <typename Base>
int btGpuWorld<Base>::stepSimulation(btScalar timeStep, int maxSubSteps, btScalar fixedTimeStep) {
  const auto state = btgpu::findState(this);
  const btgpu::WorldScope scope(state->zones);
  const Zone zone("stepSimulation");
  const btgpu::StepSimulationScope inside(*state, btgpu::WorldStep(*this, nullptr).isAllOurs());
  return Base::stepSimulation(timeStep, maxSubSteps, fixedTimeStep);
}

template <typename Base>
void btGpuWorld<Base>::internalSingleStepSimulation(btScalar timeStep) {
  const btgpu::StockStep stock = [](btDiscreteDynamicsWorld& world, btScalar seconds) {
    static_cast<btGpuWorld&>(world).Base::internalSingleStepSimulation(seconds);
  };
  btgpu::WorldStep(*this, stock).run(timeStep);
}

template <typename Base>
void btGpuWorld<Base>::synchronizeMotionStates() {
  const Zone zone("synchronizeMotionStates");
  const auto state = btgpu::findState(this);
  if (this->m_synchronizeAllMotionStates) {
    Base::synchronizeMotionStates();
  } else if (!state->rest.isConfirmed()) {
    state->motionStates.write(*this, this->m_nonStaticRigidBodies);
  }
}

template <typename Base>
void btGpuWorld<Base>::applyGravity() {
  const Zone zone("applyGravity");
  if (btgpu::findState(this)->rest.isConfirmed()) return;
  btgpu::applyGravityTo(this->m_nonStaticRigidBodies);
}

template <typename Base>
void btGpuWorld<Base>::clearForces() {
  const Zone zone("clearForces");
  const auto state = btgpu::findState(this);
  state->substeps.endStepSimulation();
  if (state->rest.isConfirmed()) return;
  btgpu::clearForcesOf(this->m_nonStaticRigidBodies);
}

template <typename Base>
void btGpuWorld<Base>::saveKinematicState(btScalar timeStep) {
  const Zone zone("saveKinematicState");
  const auto state = btgpu::findState(this);
  state->substeps.startStepSimulation(double(timeStep));
  if (state->inStepSimulation) {
    const auto watch = state->settings.m_watchSleepers ? btgpu::Watch::Everything : btgpu::Watch::Activations;
    if (state->rest.isUndisturbed(this->m_collisionObjects, this->m_nonStaticRigidBodies, this->m_constraints,
                                  state->reader, watch)) {
      return;
    }
  }
  const btCollisionObjectArray& objects = this->m_collisionObjects;
  for (const int i : btgpu::awakeKinematicBodies(objects)) {
    if (i >= objects.size()) break;  // the motion state that was asked last took bodies out
    btRigidBody* body = btRigidBody::upcast(objects[i]);
    if (body && body->isKinematicObject()) body->saveKinematicState(timeStep);
  }
}

template <typename Base>
void btGpuWorld<Base>::rayTestBatch(const btGpuRay* rays, btGpuRayHit* hits, int count) const {
  btgpu::rayTestBatch(*this, rays, hits, count);
}
template <typename Base>
void btGpuWorld<Base>::rayTestBatch(const std::vector<btGpuRay>& rays, std::vector<btGpuRayHit>& hits) const {
  hits.resize(rays.size());
  btgpu::rayTestBatch(*this, rays.data(), hits.data(), static_cast<int>(rays.size()));
}

template <typename Base>
void btGpuWorld<Base>::convexSweepBatch(const btGpuSweep* sweeps, btGpuSweepHit* hits, int count) const {
  btgpu::convexSweepBatch(*this, sweeps, hits, count);
}
template <typename Base>
void btGpuWorld<Base>::convexSweepBatch(const std::vector<btGpuSweep>& sweeps, std::vector<btGpuSweepHit>& hits) const {
  hits.resize(sweeps.size());
  btgpu::convexSweepBatch(*this, sweeps.data(), hits.data(), static_cast<int>(sweeps.size()));
}

template <typename Base>
void btGpuWorld<Base>::closestPointsBatch(const btGpuClosestQuery* queries, btGpuClosestPoints* answers,
                                          int count) const {
  btgpu::closestPointsBatch(*this, queries, answers, count);
}
template <typename Base>
void btGpuWorld<Base>::closestPointsBatch(const std::vector<btGpuClosestQuery>& queries,
                                          std::vector<btGpuClosestPoints>& answers) const {
  answers.resize(queries.size());
  btgpu::closestPointsBatch(*this, queries.data(), answers.data(), static_cast<int>(queries.size()));
}

template class btGpuWorld<btDiscreteDynamicsWorld>;
template class btGpuWorld<btSoftRigidDynamicsWorld>;

btGpuDynamicsWorld::btGpuDynamicsWorld(btDispatcher* dispatcher, btBroadphaseInterface* pairCache,
                                       btConstraintSolver* constraintSolver,
                                       btCollisionConfiguration* collisionConfiguration)
    : btGpuDynamicsWorld(dispatcher, pairCache, constraintSolver, collisionConfiguration, btGpuSettings()) {}

btGpuDynamicsWorld::btGpuDynamicsWorld(btDispatcher* dispatcher, btBroadphaseInterface* pairCache,
                                       btConstraintSolver* constraintSolver,
                                       btCollisionConfiguration* collisionConfiguration, const btGpuSettings& settings)
    : btGpuWorld(settings, dispatcher, pairCache, constraintSolver, collisionConfiguration) {}

btGpuSoftRigidDynamicsWorld::btGpuSoftRigidDynamicsWorld(btDispatcher* dispatcher, btBroadphaseInterface* pairCache,
                                                         btConstraintSolver* constraintSolver,
                                                         btCollisionConfiguration* collisionConfiguration,
                                                         btSoftBodySolver* softBodySolver)
    : btGpuSoftRigidDynamicsWorld(dispatcher, pairCache, constraintSolver, collisionConfiguration, softBodySolver,
                                  btGpuSettings()) {}

btGpuSoftRigidDynamicsWorld::btGpuSoftRigidDynamicsWorld(btDispatcher* dispatcher, btBroadphaseInterface* pairCache,
                                                         btConstraintSolver* constraintSolver,
                                                         btCollisionConfiguration* collisionConfiguration,
                                                         btSoftBodySolver* softBodySolver,
                                                         const btGpuSettings& settings)
    : btGpuWorld(settings, dispatcher, pairCache, constraintSolver, collisionConfiguration, softBodySolver) {}
