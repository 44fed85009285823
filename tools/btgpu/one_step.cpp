// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "one_step.h"

#include "gpu_engine/slots.h"

namespace btgpu::tool {

// Nothing ever leaves these worlds: object i is slot i of the device.
OneStepComparison::OneStepComparison(const Builder& build, const scenes::Expectations& expectations, btScalar timeStep)
    : m_contents(build(m_oracle)),
      m_check(m_oracle, expectations.otherDepths, expectations.scattered ? Limits::WithChance : Limits::Exact),
      m_timeStep(timeStep) {
  const btCollisionObjectArray& objects = m_oracle.getCollisionObjectArray();
  std::vector<btCollisionObject*> bySlot;
  for (int i = 0; i < objects.size(); ++i) bySlot.push_back(objects[i]);
  m_oracle.setObjects(bySlot);
}

OneStepComparison::~OneStepComparison() = default;

void OneStepComparison::beforeStep(const btDynamicsWorld& gpuWorld) {
  m_before.clear();
  const btCollisionObjectArray& objects = gpuWorld.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) m_before.push_back(captureState(*objects[i]));
  m_jointsBefore = captureJoints(gpuWorld);
}

void OneStepComparison::afterStep(const btDynamicsWorld& gpuWorld, const WorldInput& input, const StepResults& results,
                                  bool converged) {
  takeKinematicStates(gpuWorld, input, m_before);
  takeMotors(gpuWorld, m_jointsBefore);
  std::vector<BodyEnd> after;
  const btCollisionObjectArray& objects = gpuWorld.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) after.push_back(captureEnd(*objects[i]));
  m_check.compare({m_timeStep, m_before, m_jointsBefore, input, results, after, &m_cache, true, converged});
  m_cache.assign(results.manifolds.begin(), results.manifolds.begin() + static_cast<long>(results.counters.pairCount));
  nameSlots(input.infos.values, results.matchedKeys, m_cache);
}

void OneStepComparison::addTo(Series& series) const {
  series.gpu.residual.push_back(m_check.ourResidual());
  series.stock.residual.push_back(m_check.stockResidual());
  series.pose.push_back(m_check.lastPose());
}

}  // namespace btgpu::tool
