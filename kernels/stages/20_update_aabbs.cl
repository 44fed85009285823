// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/bounds.h"
#include "../lib/kernel.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/bounds_wide.h"
#endif

static Aabb grow(Aabb box, float by) {
  box.lower -= vec3(by, by, by);
  box.upper += vec3(by, by, by);
  return box;
}

// What takes no part gets an AABB that overlaps nothing. A moving body too large or too fast to bound is disabled. Of
// inactive bodies the old AABB is kept if the world says so. Shapes that only the host knows come with their AABB. A
// compound's shapes have their own; it itself needs one only where it moves.
static void updateAabb(CHECKS uint i, __global const StepParams* params, __global const BodyInfo* infos,
                       __global const Shape* shapes, __global const float4* hullVertices,
                       __global const BodyPose* poses, __global const BodyStep* steps, __global const Aabb* hostAabbs,
                       __global const BodyActivation* stateIn, __global const Aabb* oldAabbs, __global Aabb* aabbs,
                       __global BodyActivation* stateOut, __global StepCounters* counters) {
  const float threshold = params->contactThreshold;
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

#ifdef BTGPU_SHAPE_CPU

// updateAabb() of BTGPU_WIDE neighbours, the first of which is body `first`. Returns the lanes that it is not right for.
WIDE LaneMask updateAabbsWide(CHECKS uint first, __global const StepParams* params, __global const BodyInfo* infos,
                              __global const Shape* shapes, __global const BodyPose* poses,
                              __global const BodyStep* steps, __global const BodyActivation* stateIn,
                              __global Aabb* aabbs, __global BodyActivation* stateOut) {
  uint shapeOf[BTGPU_WIDE];
  int usual[BTGPU_WIDE], types[BTGPU_WIDE], states[BTGPU_WIDE];
  float radii[BTGPU_WIDE];
  int any = 0;
  for (int lane = 0; lane < BTGPU_WIDE; ++lane) {
    const BodyInfo body = infos[first + lane];
    shapeOf[lane] = isCollidable(body) ? (uint)body.shapeIndex : 0;
    const Shape shape = AT(shapes, shapeOf[lane]);
    usual[lane] = isCollidable(body) && isBoundedByBox(shape) ? -1 : 0;
    if (shape.type == SHAPE_COMPOUND && isStaticOrKinematic(body.flags)) usual[lane] = 0;
    any |= usual[lane];
    types[lane] = shape.type;
    radii[lane] = shape.type == SHAPE_CAPSULE ? shape.margin : 0.0f;
    const BodyActivation activation = stateIn[first + lane];
    stateOut[first + lane] = activation;
    states[lane] = activation.state;
  }
  if (!any) return (LaneMask)(-1);
  const int16 flags = as_int16(gatherEvery((__global const float4*)(infos + first), sizeof(BodyInfo) / 16).y);
  const int16 type = vload16(0, types);
  WideShape shape;
  shape.sphere = type == SHAPE_SPHERE;
  shape.box = type == SHAPE_BOX;
  shape.reach = xyzWide(gatherWide(&shapes->extents, sizeof(Shape) / 16, shapeOf));
  const Lanes radius = vload16(0, radii);
  Lanes3 capsules;
  capsules.x = capsules.y = capsules.z = radius;
  shape.reach = pick3(shape.sphere | shape.box, shape.reach, addWide(shape.reach, capsules));
  shape.centre = xyzWide(gatherWide(&shapes->centre, sizeof(Shape) / 16, shapeOf));
  WideAabb box = shapeAabbWide(&shape, loadPoses(poses + first), params->contactThreshold);
  const LaneMask ahead = anyBit(flags, BODY_RIGID) & ~isStaticOrKinematicWide(flags);
  if (params->flags & STEP_USE_CONTINUOUS) {
    WidePose predicted;
    predicted.position = xyzWide(gatherEvery(&steps[first].predictedPosition, sizeof(BodyStep) / 16));
    predicted.orientation = gatherEvery(&steps[first].predictedOrientation, sizeof(BodyStep) / 16);
    box = mergeWhere(ahead, box, shapeAabbWide(&shape, predicted, params->contactThreshold));
  }
  const Lanes3 edges = subtractWide(box.upper, box.lower);
  const LaneMask bounded = (dotWide(edges, edges) < MOVING_AABB_LIMIT_SQR) | anyBit(flags, BODY_STATIC | BODY_CHILD);
  const LaneMask fresh =
      params->flags & STEP_FORCE_ALL_AABBS ? (LaneMask)(-1) : isActiveStateWide(vload16(0, states));
  scatterEvery(&aabbs[first].lower, sizeof(Aabb) / 16, box.lower, (Lanes)0.0f);
  scatterEvery(&aabbs[first].upper, sizeof(Aabb) / 16, box.upper, (Lanes)0.0f);
  return ~(vload16(0, usual) & bounded & fresh);
}

#endif

// World AABB of every body, grown by the contact threshold and, for moving bodies, merged with the AABB of the
// predicted pose (btCollisionWorld::updateSingleAabb), and what becomes of its state: stateIn -> stateOut.
KERNEL updateAabbs(CHECKS uint bodyCount, __global const StepParams* params, __global const BodyInfo* infos,
                   __global const Shape* shapes, __global const float4* hullVertices, __global const BodyPose* poses,
                   __global const BodyStep* steps, __global const Aabb* hostAabbs,
                   __global const BodyActivation* stateIn, __global const Aabb* oldAabbs, __global Aabb* aabbs,
                   __global BodyActivation* stateOut, __global StepCounters* counters) {
#ifdef BTGPU_SHAPE_CPU
  FOR_EACH_BLOCK(first, bodyCount) {
    const uint end = min(bodyCount, first + BTGPU_WIDE);
    LaneMask odd = (LaneMask)(-1);
    if (first + BTGPU_WIDE == end) {
      odd = updateAabbsWide(WITH_CHECKS first, params, infos, shapes, poses, steps, stateIn, aabbs, stateOut);
      if (!anyLane(odd)) continue;
    }
    int isOdd[BTGPU_WIDE];
    vstore16(odd, 0, isOdd);
    for (uint i = first; i < end; ++i) {
      if (!isOdd[i - first]) continue;
      updateAabb(WITH_CHECKS i, params, infos, shapes, hullVertices, poses, steps, hostAabbs, stateIn, oldAabbs, aabbs,
                 stateOut, counters);
    }
  }
#else
  FOR_EACH(i, bodyCount) {
    updateAabb(WITH_CHECKS i, params, infos, shapes, hullVertices, poses, steps, hostAabbs, stateIn, oldAabbs, aabbs,
               stateOut, counters);
  }
#endif
}
