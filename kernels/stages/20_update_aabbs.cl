// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/bounds.h"
#include "../lib/kernel.h"

static Aabb grow(Aabb box, float by) {
  box.lower -= vec3(by, by, by);
  box.upper += vec3(by, by, by);
  return box;
}

// World AABB of every body, grown by the contact threshold and, for moving bodies, merged with the AABB of the
// predicted pose (btCollisionWorld::updateSingleAabb). A moving body too large or too fast to bound is disabled:
// stateIn -> stateOut. What takes no part gets an AABB that overlaps nothing. Of inactive bodies the old AABB is
// kept if the world says so. Shapes that only the host knows come with their AABB. A compound's shapes have
// their own; it itself needs one only where it moves.
KERNEL updateAabbs(CHECKS uint bodyCount, __global const StepParams* params, __global const BodyInfo* infos,
                   __global const Shape* shapes, __global const float4* hullVertices, __global const BodyPose* poses,
                   __global const BodyStep* steps, __global const Aabb* hostAabbs,
                   __global const BodyActivation* stateIn, __global const Aabb* oldAabbs, __global Aabb* aabbs,
                   __global BodyActivation* stateOut, __global StepCounters* counters) {
  const float threshold = params->contactThreshold;
  FOR_EACH(i, bodyCount) {
    const BodyInfo body = infos[i];
    BodyActivation activation = stateIn[i];
    Aabb box = emptyAabb();
    const Aabb old = oldAabbs[i];
    if (isCollidable(body) && AT(shapes, body.shapeIndex).type == SHAPE_HOST) {
      box = hostAabbs[i];
    } else if (isCollidable(body) && AT(shapes, body.shapeIndex).type != SHAPE_NONE) {
      const Shape shape = AT(shapes, body.shapeIndex);
      box = grow(shapeAabb(shape, poses[i], hullVertices), threshold);
      if ((params->flags & STEP_USE_CONTINUOUS) && (body.flags & BODY_RIGID) && !isStaticOrKinematic(body.flags)) {
        BodyPose predicted;
        predicted.position = steps[i].predictedPosition;
        predicted.orientation = steps[i].predictedOrientation;
        box = mergeAabb(box, grow(shapeAabb(shape, predicted, hullVertices), threshold));
      }
      const int keep = !(params->flags & STEP_FORCE_ALL_AABBS) && !isActiveState(activation.state);
      const int known = old.lower.x <= old.upper.x;
      const int tooLarge = !(body.flags & (BODY_STATIC | BODY_CHILD)) &&
                           !(lengthSqr3(box.upper - box.lower) < MOVING_AABB_LIMIT_SQR);
      if (tooLarge && !keep) {
        if (activation.state != STATE_DISABLE_SIMULATION && activation.state != STATE_DISABLE_DEACTIVATION) {
          activation.state = STATE_DISABLE_SIMULATION;
          atomic_inc(&counters->outOfBounds);
        }
      }
      if ((keep || tooLarge) && known) box = old;
      if (shape.type == SHAPE_COMPOUND && isStaticOrKinematic(body.flags)) box = emptyAabb();
    }
    aabbs[i] = box;
    stateOut[i] = activation;
  }
}
