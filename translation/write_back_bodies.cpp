// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "write_back_bodies.h"

#include <algorithm>
#include <atomic>

#include "../gpu_engine/zone.h"
#include "convert.h"
#include "parallel.h"
#include "prefetch.h"

BTGPU_TRANSLATION_BEGIN
namespace {

bool isActiveState(int state) {
  return state != ISLAND_SLEEPING && state != DISABLE_SIMULATION && state != FIXED_BASE_MULTI_BODY;
}

constexpr std::size_t kGrain = 256, kBlock = 32;  // bodies

bool isZero(const float4& v) { return v.x == 0 && v.y == 0 && v.z == 0; }

void writeVelocity(btRigidBody& body, const BodyVelocity& velocity) {
  body.setLinearVelocity(toBullet(velocity.linear));
  body.setAngularVelocity(toBullet(velocity.angular));
}

// A dynamic body that did not move in this step: stock still predicts it (predictUnconstraintMotion).
void predictResting(btRigidBody& body, btScalar timeStep) {
  body.applyDamping(timeStep);
  body.predictIntegratedTransform(timeStep, body.getInterpolationWorldTransform());
}

// What a step changed in a body. The reader's mirror takes it over.
struct Change {
  bool pose, velocity, deactivationTime, state;
  bool any() const { return pose || velocity || deactivationTime || state; }
};

Change takeOver(WorldInput& input, const StepResults& results, std::uint32_t i) {
  BodyPose& pose = input.poses.values[i];
  BodyVelocity& velocity = input.velocities.values[i];
  BodyActivation& activation = input.activations.values[i];
  const BodyActivation& after = results.activations[i];
  const Change change{!sameBits(pose, results.poses[i]), !sameBits(velocity, results.velocities[i]),
                      activation.deactivationTime != after.deactivationTime, activation.state != after.state};
  if (change.pose) pose = results.poses[i];
  if (change.velocity) velocity = results.velocities[i];
  activation = after;
  return change;
}

// `sweep`: of a body that it moves, or null.
void writeBack(WorldReader& reader, const StepResults& results, btScalar timeStep, std::uint32_t i,
               const Change& change, const Sweep* sweep = nullptr) {
  const double(&origin)[3] = reader.input().regionOrigin;
  BodySlot& slot = reader.slots()[i];
  btCollisionObject& object = *slot.object;
  const BodyActivation& activation = results.activations[i];
  if (activation.state != object.getActivationState()) object.forceActivationState(activation.state);
  if (change.deactivationTime) object.setDeactivationTime(btScalar(activation.deactivationTime));

  btRigidBody* body = btRigidBody::upcast(&object);
  if (!body) {
    slot.resting = true;
    return;
  }
  if (slot.integrated) body->setHitFraction(btScalar(1));
  const bool dynamic = slot.integrated && !body->isStaticOrKinematicObject();
  const BodyVelocity& velocity = results.velocities[i];
  if (dynamic && isActiveState(activation.state)) {
    writeVelocity(*body, velocity);
    if (sweep) {
      (*sweep)(*body);
    } else {
      body->proceedToTransform(change.pose ? toTransform(results.poses[i], origin) : body->getWorldTransform());
    }
  } else {
    slot.resting = !change.pose && (!dynamic || (isZero(velocity.linear) && isZero(velocity.angular)));
    if (dynamic) {
      predictResting(*body, timeStep);
      if (slot.resting) reader.restingTransform(i) = body->getInterpolationWorldTransform();
    }
    if (dynamic || change.velocity) writeVelocity(*body, velocity);
    if (change.pose) body->setWorldTransform(toTransform(results.poses[i], origin));
  }
  if (change.pose) {
    reader.knownTransform(i) = sweep ? toTransform(results.poses[i], origin) : body->getWorldTransform();
    slot.poseKnown = true;
  }
}

// Takes the results of a slot over; false if there is nothing to write of them.
bool beginWriteBack(WorldReader& reader, const StepResults& results, std::uint32_t i, Change& change) {
  change = takeOver(reader.input(), results, i);
  BodySlot& slot = reader.slots()[i];
  if (!slot.object || slot.quarantined) return false;
  if (slot.resting && !change.any() && !isActiveState(results.activations[i].state)) return false;
  slot.resting = false;
  return true;
}

// Those that there is something to write to are asked for together, since they lie anywhere in memory.
bool writeBackBlock(WorldReader& reader, const StepResults& results, btScalar timeStep, std::size_t first,
                    std::size_t last) {
  Change changes[kBlock];
  std::uint32_t found[kBlock];
  std::size_t count = 0;
  for (auto i = static_cast<std::uint32_t>(first); i < last; ++i) {
    if (!beginWriteBack(reader, results, i, changes[count])) continue;
    prefetchToWrite(reader.slots()[i].object, sizeof(btCollisionObject) + 3 * kLine);
    found[count++] = i;
  }
  for (std::size_t k = 0; k < count; ++k) writeBack(reader, results, timeStep, found[k], changes[k]);
  return count > 0;
}

}  // namespace

bool writeBackBodies(WorldReader& reader, const StepResults& results, btScalar timeStep) {
  const Zone zone("writeBackBodies");
  std::atomic<bool> wrote{false};
  parallelFor(reader.input().bodyCount, kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; i += kBlock) {
      const bool any = writeBackBlock(reader, results, timeStep, i, std::min(i + kBlock, last));
      if (any) wrote.store(true, std::memory_order_relaxed);
    }
  });
  return wrote;
}

std::vector<std::uint32_t> fastBodies(const WorldReader& reader, const StepResults& results, btScalar timeStep) {
  std::vector<std::uint32_t> fast;
  for (const std::uint32_t i : reader.sweptBodies()) {
    const BodySlot& slot = reader.slots()[i];
    if (!slot.object || slot.quarantined || slot.deviceQuarantined) continue;
    if (!isActiveState(results.activations[i].state)) continue;
    const btVector3 way = toBullet(results.velocities[i].linear) * timeStep;
    // Not with a fast body left out for the last digit of its way: Bullet looks again.
    constexpr btScalar kSlack = btScalar(0.999);
    if (way.length2() > kSlack * slot.object->getCcdSquareMotionThreshold()) fast.push_back(i);
  }
  std::sort(fast.begin(), fast.end());
  return fast;
}

void writeBackInOrder(WorldReader& reader, const StepResults& results, btScalar timeStep,
                      const btAlignedObjectArray<btRigidBody*>& bodies, const std::vector<std::uint32_t>& fast,
                      const Sweep& sweep) {
  const Zone zone("writeBackBodies");
  const auto write = [&](std::uint32_t i) {
    Change change;
    if (!beginWriteBack(reader, results, i, change)) return;
    const bool isFast = std::binary_search(fast.begin(), fast.end(), i);
    writeBack(reader, results, timeStep, i, change, isFast ? &sweep : nullptr);
  };
  std::vector<bool> done(reader.input().bodyCount, false);
  for (int k = 0; k < bodies.size(); ++k) {
    const std::uint32_t i = reader.slotOf(*bodies[k]);
    if (i == kNoSlot || done[i]) continue;
    done[i] = true;
    write(i);
  }
  for (std::uint32_t i = 0; i < reader.input().bodyCount; ++i) {
    if (!done[i]) write(i);
  }
}

BTGPU_TRANSLATION_END
