// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Simulation islands: bodies joined by overlapping pairs, found by a lock-free union-find whose root is always
// the lowest body index, whatever the order of the work items. An island falls asleep and wakes as a whole, by
// Bullet's rules (btSimulationIslandManager::buildIslands); then the manifolds to be solved are selected.
#include "../lib/kernel.h"
#include "../lib/motion.h"
#include "../shared/contact.h"
#include "../shared/joint.h"
#include "../shared/shape.h"

#define ISLAND_AWAKE 1u   // holds a body that may not sleep
#define ISLAND_SOLVED 2u  // holds an active body, once the states are decided

static int isIslandMember(uint flags) { return (flags & BODY_PRESENT) && !isStaticOrKinematic(flags); }
static int mergesIslands(uint flags) {
  return isIslandMember(flags) && !(flags & (BODY_NO_RESPONSE | BODY_QUARANTINED));
}

// Parents are read and written by many work items at once, so every access is atomic.
static uint loadParent(volatile __global uint* parent) { return atomic_or(parent, 0u); }

static uint findRoot(CHECKS volatile __global uint* parents, uint i) {
  uint parent = loadParent(&AT(parents, i));
  ASSERT(parent <= i, parent, i);
  while (parent != i) {
    const uint grandparent = loadParent(&AT(parents, parent));
    atomic_min(&AT(parents, i), grandparent);  // shortens the path; parents only ever get lower
    i = parent;
    parent = grandparent;
    ASSERT(parent <= i, parent, i);
  }
  return i;
}

static void unite(CHECKS volatile __global uint* parents, uint a, uint b) {
  while (true) {
    a = findRoot(WITH_CHECKS parents, a);
    b = findRoot(WITH_CHECKS parents, b);
    if (a == b) return;
    const uint low = min(a, b), high = max(a, b);
    if (atomic_cmpxchg(&AT(parents, high), high, low) == high) return;
  }
}

KERNEL islandInit(uint bodyCount, __global uint* parents, __global uint* islandFlags, __global uint* wake) {
  FOR_EACH(i, bodyCount) {
    parents[i] = i;
    islandFlags[i] = 0;
    wake[i] = 0;
  }
}

// Bullet: an awake kinematic body wakes what it may touch, that is every pair that has a manifold, with points or, as a
// setting, only with them.
static int mayTouch(Pair pair) {
  if (pair.bucket == BUCKET_HOST) return 1;
  return pair.bucket != BUCKET_NONE && (pair.bucket != BUCKET_CARRY || pair.oldManifold != NO_INDEX);
}
static int wakes(BodyInfo body, int state) {
  return (body.flags & BODY_KINEMATIC) && !(body.flags & BODY_NO_RESPONSE) && state != STATE_SLEEPING;
}

static void wakeOther(CHECKS uint bodyA, uint bodyB, BodyInfo a, BodyInfo b, __global const BodyActivation* activations,
                      volatile __global uint* wake) {
  if (wakes(a, AT(activations, bodyA).state)) atomic_or(&AT(wake, bodyB), 1u);
  if (wakes(b, AT(activations, bodyB).state)) atomic_or(&AT(wake, bodyA), 1u);
}

KERNEL islandUnite(CHECKS uint pairCapacity, __global const StepCounters* counters, __global const StepParams* params,
                   __global const Pair* pairs, __global const Manifold* manifolds, __global const BodyInfo* infos,
                   __global const BodyActivation* activations, volatile __global uint* parents,
                   volatile __global uint* wake) {
  RETURN_ON_OVERFLOW(counters);
  const int byContact = (params->flags & STEP_WAKE_BY_CONTACT) != 0;
  FOR_EACH(i, itemCount(pairCapacity, &counters->pairCount)) {
    const Pair pair = AT(pairs, i);
    const BodyInfo a = AT(infos, pair.bodyA), b = AT(infos, pair.bodyB);
    if (mergesIslands(a.flags) && mergesIslands(b.flags)) {
      unite(WITH_CHECKS parents, pair.bodyA, pair.bodyB);
    } else if (mayTouch(pair) && !(byContact && AT(manifolds, i).pointCount == 0)) {
      wakeOther(WITH_CHECKS pair.bodyA, pair.bodyB, a, b, activations, wake);
    }
  }
  if (!byContact) return;
  // Whether a pair of the host's touches is known by its manifolds, which lie behind those of the pairs.
  FOR_EACH(k, params->hostManifoldCount) {
    __global const Manifold* m = &AT(manifolds, counters->pairCount + k);
    const uint a = m->bodyA, b = m->bodyB;
    if (m->pointCount > 0) wakeOther(WITH_CHECKS a, b, AT(infos, a), AT(infos, b), activations, wake);
  }
}

// Enabled joints unite islands as pairs do, but also those of bodies without contact response.
KERNEL islandUniteJoints(CHECKS uint jointCount, __global const StepCounters* counters, __global const Joint* joints,
                         volatile __global uint* parents) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, jointCount) {
    const Joint joint = joints[i];
    if (joint.enabled && joint.islandA != NO_INDEX && joint.islandB != NO_INDEX) {
      unite(WITH_CHECKS parents, joint.islandA, joint.islandB);
    }
  }
}

KERNEL islandFlatten(CHECKS uint bodyCount, __global const StepCounters* counters, __global const BodyInfo* infos,
                     __global const BodyActivation* activations, volatile __global uint* parents, __global uint* roots,
                     volatile __global uint* islandFlags) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    const uint root = findRoot(WITH_CHECKS parents, i);
    const int state = activations[i].state;
    ASSERT(root <= i, root, i);
    roots[i] = root;
    if (isIslandMember(infos[i].flags) && (state == STATE_ACTIVE || state == STATE_DISABLE_DEACTIVATION)) {
      atomic_or(&AT(islandFlags, root), ISLAND_AWAKE);
    }
  }
}

// btCollisionObject::setActivationState: the two DISABLE states stick.
static int changedState(int state, int wanted) {
  return state == STATE_DISABLE_DEACTIVATION || state == STATE_DISABLE_SIMULATION ? state : wanted;
}

KERNEL islandStates(CHECKS uint bodyCount, __global const StepCounters* counters, __global const BodyInfo* infos,
                    __global const uint* roots, __global const uint* wake, volatile __global uint* islandFlags,
                    __global BodyActivation* activations) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    if (!isIslandMember(infos[i].flags)) continue;
    BodyActivation activation = activations[i];
    if (!(atomic_or(&AT(islandFlags, roots[i]), 0u) & ISLAND_AWAKE)) {
      activation.state = changedState(activation.state, STATE_SLEEPING);
    } else if (activation.state == STATE_SLEEPING) {
      activation.state = STATE_WANTS_DEACTIVATION;
      activation.deactivationTime = 0.0f;
    }
    if (wake[i]) {
      activation.state = changedState(activation.state, STATE_ACTIVE);
      activation.deactivationTime = 0.0f;
    }
    if (isActiveState(activation.state)) atomic_or(&AT(islandFlags, roots[i]), ISLAND_SOLVED);
    activations[i] = activation;
  }
}

// solved[i]: the solver writes this body's velocity back. Bodies outside islands are marked by selectManifolds.
KERNEL islandSolved(CHECKS uint bodyCount, __global const StepCounters* counters, __global const BodyInfo* infos,
                    __global const uint* roots, __global const uint* islandFlags, __global uint* solved) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    solved[i] = isIslandMember(infos[i].flags) && (AT(islandFlags, roots[i]) & ISLAND_SOLVED) ? 1u : 0u;
  }
}

static int movesOutsideIslands(uint flags, BodyStep step) {
  return !isIslandMember(flags) && step.angularVelocity.w != 0.0f;
}

// jointSolved[i] = 1 for the joints that the solver gets: those of an island that is solved, disabled ones included.
KERNEL selectJoints(CHECKS uint jointCount, __global const StepCounters* counters, __global const Joint* joints,
                    __global const BodyInfo* infos, __global const BodyStep* steps, __global const uint* roots,
                    __global const uint* islandFlags, volatile __global uint* solved, __global uint* jointSolved) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, jointCount) {
    const Joint joint = joints[i];
    const uint member = joint.islandA != NO_INDEX ? joint.islandA : joint.islandB;
    const int selected = member != NO_INDEX && (AT(islandFlags, AT(roots, member)) & ISLAND_SOLVED);
    jointSolved[i] = selected ? 1u : 0u;
    if (!selected || joint.rowCount == 0) continue;
    const uint a = joint.bodyA, b = joint.bodyB;
    if (a != NO_INDEX && movesOutsideIslands(AT(infos, a).flags, AT(steps, a))) atomic_or(&AT(solved, a), 1u);
    if (b != NO_INDEX && movesOutsideIslands(AT(infos, b).flags, AT(steps, b))) atomic_or(&AT(solved, b), 1u);
  }
}

// flags[i] = 1 for the manifolds that the solver gets: with points, with response, not between sleeping bodies,
// in an island that is solved, and with a body that can move.
KERNEL selectManifolds(CHECKS uint capacity, __global StepCounters* counters, __global const StepParams* params,
                       __global const Manifold* manifolds, __global const BodyInfo* infos,
                       __global const BodyActivation* activations, __global const BodyStep* steps,
                       __global const uint* roots, __global const uint* islandFlags, volatile __global uint* solved,
                       __global uint* flags) {
  RETURN_ON_OVERFLOW(counters);
  uint points = 0;
  FOR_EACH(i, min(capacity, counters->pairCount + params->hostManifoldCount)) {
    const uint a = AT(manifolds, i).bodyA, b = AT(manifolds, i).bodyB;
    const uint flagsA = AT(infos, a).flags, flagsB = AT(infos, b).flags;
    const uint member = isIslandMember(flagsA) ? a : b;
    points += manifolds[i].pointCount;
    const int selected = manifolds[i].pointCount > 0 && !((flagsA | flagsB) & BODY_NO_RESPONSE) &&
                         isIslandMember(AT(infos, member).flags) &&
                         (AT(activations, a).state != STATE_SLEEPING || AT(activations, b).state != STATE_SLEEPING) &&
                         (AT(islandFlags, AT(roots, member)) & ISLAND_SOLVED) &&
                         (AT(steps, a).angularVelocity.w != 0.0f || AT(steps, b).angularVelocity.w != 0.0f);
    AT(flags, i) = selected ? 1u : 0u;
    if (selected && movesOutsideIslands(flagsA, AT(steps, a))) atomic_or(&AT(solved, a), 1u);
    if (selected && movesOutsideIslands(flagsB, AT(steps, b))) atomic_or(&AT(solved, b), 1u);
  }
  if (points) atomic_add(&counters->contactPoints, points);
}

// Single work item: notes how many manifolds were selected.
SINGLE_KERNEL countConstraints(__global const uint* total, __global StepCounters* counters) {
  if (!counters->overflow) counters->constraintCount = *total;
}
