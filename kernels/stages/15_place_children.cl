// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/bounds.h"
#include "../lib/kernel.h"

static BodyPose placed(BodyPose body, BodyPose child) {
  BodyPose p;
  p.position = xyz(body.position) + rotate(body.orientation, child.position);
  p.orientation = quaternionProduct(body.orientation, child.orientation);
  return p;
}

// The shapes of compounds, each in a slot of its own, go with their bodies: pose, pose at the end of the step,
// activation, quarantine. childPoses[]: pose of each in its body's axes.
KERNEL placeChildren(CHECKS uint bodyCount, __global const StepCounters* counters, __global const BodyPose* childPoses,
                     __global BodyInfo* infos, __global BodyPose* poses, __global BodyStep* steps,
                     __global BodyActivation* activations) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    const uint flags = infos[i].flags;
    if (!(flags & BODY_CHILD)) continue;
    const uint body = infos[i].parent;
    ASSERT(!(AT(infos, body).flags & BODY_CHILD), i, body);
    poses[i] = placed(AT(poses, body), childPoses[i]);
    BodyPose predicted;
    predicted.position = AT(steps, body).predictedPosition;
    predicted.orientation = AT(steps, body).predictedOrientation;
    predicted = placed(predicted, childPoses[i]);
    steps[i].predictedPosition = predicted.position;
    steps[i].predictedOrientation = predicted.orientation;
    activations[i] = AT(activations, body);
    const uint quarantined = AT(infos, body).flags & BODY_QUARANTINED;
    if ((flags & BODY_QUARANTINED) != quarantined) infos[i].flags = (flags & ~BODY_QUARANTINED) | quarantined;
  }
}
