// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "write_back_bodies.h"

#include <cstring>

#include "../gpu_engine/zone.h"
#include "convert.h"
#include "parallel.h"

BTGPU_TRANSLATION_BEGIN
namespace {

bool isActiveState(int state) {
  return state != ISLAND_SLEEPING && state != DISABLE_SIMULATION && state != FIXED_BASE_MULTI_BODY;
}

bool sameVelocity(const BodyVelocity& a, const BodyVelocity& b) { return std::memcmp(&a, &b, sizeof a) == 0; }
bool samePose(const BodyPose& a, const BodyPose& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

void writeVelocity(btRigidBody& body, const BodyVelocity& velocity) {
  body.setLinearVelocity(toBullet(velocity.linear));
  body.setAngularVelocity(toBullet(velocity.angular));
}

// A dynamic body that did not move in this step: stock still predicts it (predictUnconstraintMotion).
void predictResting(btRigidBody& body, btScalar timeStep) {
  body.applyDamping(timeStep);
  body.predictIntegratedTransform(timeStep, body.getInterpolationWorldTransform());
}

void writeBack(WorldReader& reader, const StepResults& results, btScalar timeStep, std::uint32_t i) {
  const WorldInput& before = reader.input();
  BodySlot& slot = reader.slots()[i];
  if (!slot.object || slot.quarantined) return;
  btCollisionObject& object = *slot.object;
  const BodyActivation& activation = results.activations[i];
  if (activation.state != object.getActivationState()) object.forceActivationState(activation.state);
  if (activation.deactivationTime != before.activations.values[i].deactivationTime) {
    object.setDeactivationTime(btScalar(activation.deactivationTime));
  }

  btRigidBody* body = btRigidBody::upcast(&object);
  if (!body) return;
  if (reader.isIntegrated(i)) body->setHitFraction(btScalar(1));
  const bool dynamic = reader.isIntegrated(i) && !body->isStaticOrKinematicObject();
  const bool moved = !samePose(results.poses[i], before.poses.values[i]);
  const bool velocityChanged = !sameVelocity(results.velocities[i], before.velocities.values[i]);
  if (dynamic && isActiveState(activation.state)) {
    writeVelocity(*body, results.velocities[i]);
    body->proceedToTransform(moved ? toTransform(results.poses[i], before.regionOrigin) : body->getWorldTransform());
  } else {
    if (dynamic) predictResting(*body, timeStep);
    if (dynamic || velocityChanged) writeVelocity(*body, results.velocities[i]);
    if (moved) body->setWorldTransform(toTransform(results.poses[i], before.regionOrigin));
  }
  if (moved) {
    slot.lastTransform = body->getWorldTransform();
    slot.poseKnown = true;
  }
}

}  // namespace

void writeBackBodies(WorldReader& reader, const StepResults& results, btScalar timeStep) {
  const Zone zone("writeBackBodies");
  parallelFor(reader.input().bodyCount, 512, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) writeBack(reader, results, timeStep, static_cast<std::uint32_t>(i));
  });
}

BTGPU_TRANSLATION_END
