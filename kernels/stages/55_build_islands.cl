// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Simulation islands: bodies joined by overlapping pairs, found by a lock-free union-find whose root is always
// the lowest body index, whatever the order of the work items. An island falls asleep and wakes as a whole, by
// Bullet's rules (btSimulationIslandManager::buildIslands); then the manifolds to be solved are selected.
//
// While no body sleeps or wants to, all islands are awake whatever they are, and finding them would take as long as a
// tenth of the solver: then every body counts as an island of its own, which gives the same states and manifolds.
#include "../lib/group_scan.h"
#include "../lib/motion.h"
#include "../shared/contact.h"
#include "../shared/joint.h"
#include "../shared/shape.h"

#define ISLAND_AWAKE 1u   // holds a body that may not sleep
#define ISLAND_SOLVED 2u  // holds an active body, once the states are decided

// What somebody in the world does, in restless[]; it decides whether pairs have to be looked at.
#define SOMEBODY_RESTS 1u  // a body in an island sleeps, wants to, or is disabled
#define SOMEBODY_WAKES 2u  // there is a waker

// What the stage has to know of a body again and again, in one word.
#define KIND_MEMBER 1u       // in an island at all, if only its own
#define KIND_MERGES 2u       // joins islands by pairs
#define KIND_WAKER 4u        // kinematic and awake
#define KIND_NO_RESPONSE 8u
#define KIND_MOVES 16u       // the solver can move it
#define KIND_SLEEPS 32u      // once the states are decided
#define KIND_CHILD 64u       // one of a compound's shapes, and nothing else

static int keepsAwake(int state) { return state == STATE_ACTIVE || state == STATE_DISABLE_DEACTIVATION; }

static uint kindOf(uint flags, int state, BodyStep step) {
  if (flags & BODY_CHILD) return KIND_CHILD;
  uint kind = 0;
  if ((flags & BODY_PRESENT) && !isStaticOrKinematic(flags)) kind |= KIND_MEMBER;
  if ((kind & KIND_MEMBER) && !(flags & (BODY_NO_RESPONSE | BODY_QUARANTINED))) kind |= KIND_MERGES;
  if ((flags & BODY_KINEMATIC) && !(flags & BODY_NO_RESPONSE) && state != STATE_SLEEPING) kind |= KIND_WAKER;
  if (flags & BODY_NO_RESPONSE) kind |= KIND_NO_RESPONSE;
  if (step.angularVelocity.w != 0.0f) kind |= KIND_MOVES;
  return kind;
}

// Words that others may change at the same time. Any value that such a word has had will do, as long as it comes from
// memory: a parent of some time ago is still an ancestor, and a bit that is set stays. Oclgrind takes that for a race.
#ifdef BTGPU_ATOMIC_LOADS
#define LOAD(word) atomic_or(word, 0u)
#define LOWER(word, value) atomic_min(word, value)
#else
#define LOAD(word) (*(word))
#define LOWER(word, value) (*(word) = (value))
#endif

#define SET_BITS(word, bits) \
  if ((LOAD(word) & (bits)) != (bits)) atomic_or(word, bits)

static uint findRoot(CHECKS volatile __global uint* parents, uint i) {
  uint parent = LOAD(&AT(parents, i));
  ASSERT(parent <= i, parent, i);
  while (parent != i) {
    const uint grandparent = LOAD(&AT(parents, parent));
    if (grandparent == parent) return parent;
    LOWER(&AT(parents, i), grandparent);  // shortens the path; who has a parent never becomes a root again
    i = parent;
    parent = grandparent;
    ASSERT(parent <= i, parent, i);
  }
  return i;
}

// Only roots get a parent here, a lower one, and only if they are roots still.
static void unite(CHECKS volatile __global uint* parents, uint a, uint b) {
  while (true) {
    a = findRoot(WITH_CHECKS parents, a);
    b = findRoot(WITH_CHECKS parents, b);
    if (a == b) return;
    const uint low = min(a, b), high = max(a, b);
    const uint parent = atomic_cmpxchg(&AT(parents, high), high, low);
    if (parent == high) return;
    a = low;
    b = parent;
  }
}

// Of the two words in restless[] this step takes number `turn`; it was cleared in the step before, and the other one is
// here for the next step, even in one that is to be repeated.
KERNEL islandInit(uint bodyCount, uint turn, __global const StepCounters* counters, __global const BodyInfo* infos,
                  __global const BodyActivation* activations, __global const BodyStep* steps, __global uint* kinds,
                  __global uint* parents, __global uint* islandFlags, __global uint* wake, __global uint* solved,
                  volatile __global uint* restless) {
  if (get_global_id(0) == 0) restless[1 - turn] = 0;
  RETURN_ON_OVERFLOW(counters);
  uint somebody = 0;
  FOR_EACH(i, bodyCount) {
    const int state = activations[i].state;
    const uint kind = kindOf(infos[i].flags, state, steps[i]);
    kinds[i] = kind;
    parents[i] = i;
    islandFlags[i] = 0;
    wake[i] = 0;
    solved[i] = 0;
    if ((kind & KIND_MEMBER) && !keepsAwake(state)) somebody |= SOMEBODY_RESTS;
    if (kind & KIND_WAKER) somebody |= SOMEBODY_WAKES;
  }
  if (somebody) SET_BITS(&restless[turn], somebody);
}

// Bullet: an awake kinematic body wakes what it may touch, that is every pair that has a manifold, with points or, as a
// setting, only with them.
static int mayTouch(__global const Manifold* m, int byContact) {
  return m->bucket != BUCKET_NONE && !(byContact && m->pointCount == 0);
}

static void wakeOther(CHECKS uint bodyA, uint bodyB, uint kindA, uint kindB, volatile __global uint* wake) {
  if (kindA & KIND_WAKER) atomic_or(&AT(wake, bodyB), 1u);
  if (kindB & KIND_WAKER) atomic_or(&AT(wake, bodyA), 1u);
}

KERNEL islandUnite(CHECKS uint pairCapacity, uint turn, __global const StepCounters* counters,
                   __global const StepParams* params, __global const Pair* pairs, __global const Manifold* manifolds,
                   __global const BodyInfo* infos, __global const uint* kinds, __global const uint* restless,
                   volatile __global uint* parents, volatile __global uint* wake) {
  RETURN_ON_OVERFLOW(counters);
  const uint somebody = restless[turn] | (params->flags & STEP_ISLAND_ROOTS ? SOMEBODY_RESTS : 0u);
  if (!somebody) return;
  const int byContact = (params->flags & STEP_WAKE_BY_CONTACT) != 0;
  FOR_EACH(i, itemCount(pairCapacity, &counters->pairCount)) {
    Pair pair = AT(pairs, i);
    uint kindA = AT(kinds, pair.bodyA), kindB = AT(kinds, pair.bodyB);
    if ((kindA | kindB) & KIND_CHILD) {
      if (kindA & KIND_CHILD) pair.bodyA = AT(infos, pair.bodyA).parent;
      if (kindB & KIND_CHILD) pair.bodyB = AT(infos, pair.bodyB).parent;
      kindA = AT(kinds, pair.bodyA);
      kindB = AT(kinds, pair.bodyB);
    }
    if (kindA & kindB & KIND_MERGES) {
      if (somebody & SOMEBODY_RESTS) unite(WITH_CHECKS parents, pair.bodyA, pair.bodyB);
    } else if (((kindA | kindB) & KIND_WAKER) && mayTouch(&AT(manifolds, i), byContact)) {
      wakeOther(WITH_CHECKS pair.bodyA, pair.bodyB, kindA, kindB, wake);
    }
  }
  if (!byContact) return;
  // Whether a pair of the host's touches is known by its manifolds, which lie behind those of the pairs.
  FOR_EACH(k, params->hostManifoldCount) {
    __global const Manifold* m = &AT(manifolds, counters->pairCount + k);
    const uint a = m->bodyA, b = m->bodyB;
    if (m->pointCount > 0) wakeOther(WITH_CHECKS a, b, AT(kinds, a), AT(kinds, b), wake);
  }
}

// Enabled joints unite islands as pairs do, but also those of bodies without contact response.
KERNEL islandUniteJoints(CHECKS uint jointCount, uint turn, __global const StepCounters* counters,
                         __global const StepParams* params, __global const Joint* joints,
                         __global const uint* restless, volatile __global uint* parents) {
  RETURN_ON_OVERFLOW(counters);
  if (!(restless[turn] & SOMEBODY_RESTS) && !(params->flags & STEP_ISLAND_ROOTS)) return;
  FOR_EACH(i, jointCount) {
    const Joint joint = joints[i];
    if (joint.enabled && joint.islandA != NO_INDEX && joint.islandB != NO_INDEX) {
      unite(WITH_CHECKS parents, joint.islandA, joint.islandB);
    }
  }
}

KERNEL islandFlatten(CHECKS uint bodyCount, __global const StepCounters* counters, __global const uint* kinds,
                     __global const BodyActivation* activations, volatile __global uint* parents, __global uint* roots,
                     volatile __global uint* islandFlags) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    const uint root = findRoot(WITH_CHECKS parents, i);
    const int state = activations[i].state;
    ASSERT(root <= i, root, i);
    LOWER(&AT(parents, i), root);
    roots[i] = root;
    if ((kinds[i] & KIND_MEMBER) && keepsAwake(state)) {
      SET_BITS(&AT(islandFlags, root), ISLAND_AWAKE);
    }
  }
}

// btCollisionObject::setActivationState: the two DISABLE states stick.
static int changedState(int state, int wanted) {
  return state == STATE_DISABLE_DEACTIVATION || state == STATE_DISABLE_SIMULATION ? state : wanted;
}

KERNEL islandStates(CHECKS uint bodyCount, __global const StepCounters* counters, __global const uint* roots,
                    volatile __global const uint* wake, __global uint* kinds, volatile __global uint* islandFlags,
                    __global BodyActivation* activations) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    BodyActivation activation = activations[i];
    if (kinds[i] & KIND_MEMBER) {
      if (!(LOAD(&AT(islandFlags, roots[i])) & ISLAND_AWAKE)) {
        activation.state = changedState(activation.state, STATE_SLEEPING);
      } else if (activation.state == STATE_SLEEPING) {
        activation.state = STATE_WANTS_DEACTIVATION;
        activation.deactivationTime = 0.0f;
      }
      if (wake[i]) {
        activation.state = changedState(activation.state, STATE_ACTIVE);
        activation.deactivationTime = 0.0f;
      }
      if (isActiveState(activation.state)) {
        SET_BITS(&AT(islandFlags, roots[i]), ISLAND_SOLVED);
      }
      activations[i] = activation;
    }
    if (activation.state == STATE_SLEEPING) kinds[i] |= KIND_SLEEPS;
  }
}

static int movesOutsideIslands(uint kind) { return (kind & KIND_MOVES) && !(kind & KIND_MEMBER); }

// jointSolved[i] = 1 for the joints that the solver gets: those of an island that is solved, disabled ones included.
KERNEL selectJoints(CHECKS uint jointCount, __global const StepCounters* counters, __global const Joint* joints,
                    __global const uint* kinds, __global const uint* roots,
                    volatile __global const uint* islandFlags, volatile __global uint* solved,
                    __global uint* jointSolved) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, jointCount) {
    const Joint joint = joints[i];
    const uint member = joint.islandA != NO_INDEX ? joint.islandA : joint.islandB;
    const int selected = member != NO_INDEX && (AT(islandFlags, AT(roots, member)) & ISLAND_SOLVED);
    jointSolved[i] = selected ? 1u : 0u;
    if (!selected || joint.rowCount == 0) continue;
    const uint a = joint.bodyA, b = joint.bodyB;
    if (a != NO_INDEX && movesOutsideIslands(AT(kinds, a))) atomic_or(&AT(solved, a), 1u);
    if (b != NO_INDEX && movesOutsideIslands(AT(kinds, b))) atomic_or(&AT(solved, b), 1u);
  }
}

#ifdef BTGPU_SHAPE_CPU
// All that comes between islandInit and selectManifolds, one after the other by a single work item.
SINGLE_KERNEL islandsByOne(CHECKS uint bodyCount, uint pairCapacity, uint jointCount, uint turn,
                           __global const StepCounters* counters, __global const StepParams* params,
                           __global const Pair* pairs, __global const Manifold* manifolds,
                           __global const BodyInfo* infos, __global const Joint* joints,
                           __global const uint* restless, __global uint* kinds, volatile __global uint* parents,
                           volatile __global uint* wake, __global uint* roots, volatile __global uint* islandFlags,
                           __global BodyActivation* activations, volatile __global uint* solved,
                           __global uint* jointSolved) {
  islandUnite(WITH_CHECKS pairCapacity, turn, counters, params, pairs, manifolds, infos, kinds, restless, parents, wake);
  islandUniteJoints(WITH_CHECKS jointCount, turn, counters, params, joints, restless, parents);
  islandFlatten(WITH_CHECKS bodyCount, counters, kinds, activations, parents, roots, islandFlags);
  islandStates(WITH_CHECKS bodyCount, counters, roots, wake, kinds, islandFlags, activations);
  selectJoints(WITH_CHECKS jointCount, counters, joints, kinds, roots, islandFlags, solved,
               jointSolved);
}
#endif

// Whether the body is in an island that is solved.
static int isInSolved(CHECKS uint body, uint kind, __global const uint* roots, __global const uint* islandFlags) {
  return (kind & KIND_MEMBER) && (AT(islandFlags, AT(roots, body)) & ISLAND_SOLVED);
}

// solved[i]: the solver writes this body's velocity back, since its island is solved; bodies outside islands are marked
// along with what moves them.
// flags[i] = 1 for the manifolds that the solver gets: with points, with response, not between sleeping bodies,
// in an island that is solved, and with a body that can move. Where islands are not split Bullet's solver gets all
// manifolds that there are; here not those of sleepers, of which nothing moves there either.
// chunkSums[g]: how many there are in chunk g.
KERNEL selectManifolds(CHECKS uint capacity, uint bodyCount, __global StepCounters* counters,
                       __global const StepParams* params, __global const Manifold* manifolds,
                       __global const uint* kinds, __global const uint* roots, __global const uint* islandFlags,
                       volatile __global uint* solved, __global uint* flags, __global uint* chunkSums) {
  SCRATCH;
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    if ((kinds[i] & KIND_MEMBER) && (AT(islandFlags, roots[i]) & ISLAND_SOLVED)) solved[i] = 1;
  }
  const int oneIsland = (params->flags & STEP_ONE_ISLAND) != 0;
  uint points = 0, count = 0;
  FOR_CHUNK(i, min(capacity, counters->pairCount + params->hostManifoldCount)) {
    if (i + ITEMS_AHEAD < i_end) prefetchSoon(&manifolds[i + ITEMS_AHEAD], 32);
    const uint a = AT(manifolds, i).bodyA, b = AT(manifolds, i).bodyB;
    const uint kindA = AT(kinds, a), kindB = AT(kinds, b);
    const uint member = (kindA & KIND_MEMBER) ? a : b;
    points += manifolds[i].pointCount;
    int selected = manifolds[i].pointCount > 0 && (oneIsland || !((kindA | kindB) & KIND_NO_RESPONSE)) &&
                   ((kindA | kindB) & KIND_MEMBER) && !(kindA & kindB & KIND_SLEEPS) && ((kindA | kindB) & KIND_MOVES);
    // One body without response, which joins no island by contacts, may be awake while the other one sleeps.
    selected = selected && (isInSolved(WITH_CHECKS member, kindA | kindB, roots, islandFlags) ||
                            (oneIsland && isInSolved(WITH_CHECKS b, kindB, roots, islandFlags)));
    AT(flags, i) = selected ? 1u : 0u;
    if (!selected) continue;
    ++count;
    if (movesOutsideIslands(kindA)) atomic_or(&AT(solved, a), 1u);
    if (movesOutsideIslands(kindB)) atomic_or(&AT(solved, b), 1u);
  }
  points = GROUP_SUM(points);
  count = GROUP_SUM(count);
  if (get_local_id(0) != 0) return;
  if (points) atomic_add(&counters->contactPoints, points);
  chunkSums[get_group_id(0)] = count;
}

// The indices of the flagged manifolds, ascending, and how many there are.
KERNEL listConstraints(CHECKS uint capacity, __global StepCounters* counters, __global const StepParams* params,
                       __global const uint* flags, __global const uint* chunkSums, __global uint* constraints,
                       __global uint* constraintCount) {
  SCRATCH;
  RETURN_ON_OVERFLOW(counters);
  const uint count = min(capacity, counters->pairCount + params->hostManifoldCount), group = get_group_id(0);
#ifdef BTGPU_SHAPE_CPU
  uint next = 0;
  for (uint g = 0; g < group; ++g) next += chunkSums[g];
  FOR_CHUNK(i, count) {
    if (!flags[i]) continue;
    AT(constraints, next) = i;
    ++next;
  }
#else
  uint next = groupSumBelow(chunkSums, group, scratch);
  const uint end = CHUNK_BEGIN(count, group + 1, get_num_groups(0));
  for (uint tile = CHUNK_BEGIN(count, group, get_num_groups(0)); tile < end; tile += GROUP_SIZE) {
    const uint i = tile + get_local_id(0), flag = i < end ? flags[i] : 0;
    uint total;
    const uint before = groupExclusiveScan(flag, scratch, &total);
    if (flag) AT(constraints, next + before) = i;
    next += total;
  }
#endif
  if (group + 1 < get_num_groups(0) || get_local_id(0) != 0) return;
  *constraintCount = next;
  counters->constraintCount = next;
}
