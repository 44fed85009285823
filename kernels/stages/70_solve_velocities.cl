// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Projected Gauss-Seidel over the coloured constraint slots: slots of one colour move different bodies and are
// solved in parallel, colours one after the other. Which rows a launch solves is given by `passes`; of a slot's rows
// the normal ones go first (docs/decisions/0014-friction-after-each-manifold.md).
#include "../lib/solve_joint.h"
#include "../lib/solve_slot.h"
#include "../shared/team.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/solve_team.h"
#else
#include "../lib/resident.h"
#endif

#ifdef BTGPU_SHAPE_CPU

// `repeats` times the passes of `sequence`, the first one in its lowest PASS_BITS, each over all colours one after the
// other and then the serial batch.
KERNEL solveInTeam(CHECKS uint repeats, uint sequence, __global const StepCounters* counters,
                   __global const StepParams* params, __global const uint* slotFirst, __global const SlotHeader* slots,
                   __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                   __global float* tangent2, __global float* torsion, __global uint* team) {
  RETURN_ON_OVERFLOW(counters);
  const uint flags = params->flags, colours = counters->colourCount;
  Member m = joinTeam(team);
  ASSERT(m.rank < get_num_groups(0), m.rank, get_num_groups(0));
  ASSERT(colours <= COLOUR_LIMIT, colours, slotFirst[COLOUR_SERIAL]);
  int stays = 1;
  for (uint repeat = 0; repeat < repeats && stays; ++repeat) {
    stays = solveSequence(WITH_CHECKS &m, sequence, colours, flags, slotFirst, slots, masses, bodies, rows, tangent2,
                          torsion);
  }
  leaveTeam(&m);
}

#else

// Solves the slots of one parallel colour. In small groups, since those of a small world are to spread over the device.
KERNEL_OF(SOLVE_GROUP)
solveColour(CHECKS uint colour, uint wanted, __global const StepCounters* counters, __global const StepParams* params,
            __global const uint* slotFirst, __global const SlotHeader* slots, __global const SolverMass* masses,
            __global SolverBody* bodies, __global float* rows, __global float* tangent2, __global float* torsion) {
  RETURN_ON_OVERFLOW(counters);
  const uint first = slotFirst[colour], flags = params->flags, passes = KNOWN_PASSES(wanted);
  FOR_EACH(i, slotFirst[colour + 1] - first) {
    solveSlot(WITH_CHECKS first + i, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
  }
}

// Solves all colours from firstColour on, however many there are, one after the other, and then the serial batch, slot
// by slot. One work group.
KERNEL solveRest(CHECKS uint firstColour, uint wanted, __global const StepCounters* counters,
                 __global const StepParams* params, __global const uint* slotFirst, __global const SlotHeader* slots,
                 __global const SolverMass* masses, __global SolverBody* bodies, __global float* rows,
                 __global float* tangent2, __global float* torsion) {
  RETURN_ON_OVERFLOW(counters);
  const uint flags = params->flags, colours = counters->colourCount, passes = KNOWN_PASSES(wanted);
  for (uint colour = firstColour; colour < colours; ++colour) {
    const uint first = slotFirst[colour], end = slotFirst[colour + 1];
    for (uint slot = first + get_local_id(0); slot < end; slot += GROUP_SIZE) {
      solveSlot(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
    }
    barrier(CLK_GLOBAL_MEM_FENCE);
  }
  if (get_local_id(0) != 0) return;
  for (uint slot = slotFirst[COLOUR_SERIAL]; slot < slotFirst[COLOUR_SERIAL + 1]; ++slot) {
    solveSlot(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
  }
}

// The colours in turn, `repeats` times for each passes of `sequence`; `colour` beyond the last one: the serial batch.
STRUCT(Turn) {
  uint repeats, left, colour;  // left: what is left of the sequence in this repeat
};

static uint passesOf(Turn turn) { return KNOWN_PASSES(turn.left & ((1u << PASS_BITS) - 1)); }

static Turn nextTurn(Turn turn, uint sequence, uint lastColour) {
  if (turn.repeats == 0 || ++turn.colour <= lastColour) return turn;
  turn.colour = 0;
  turn.left >>= PASS_BITS;
  if (turn.left != 0) return turn;
  turn.left = sequence;
  turn.repeats -= 1;
  return turn;
}

// Where this lane begins in a colour, and how far apart its slots are. Large colours are dealt out warp by warp, so that
// those of a small world are spread over the device; the first group does small ones alone.
static uint firstOf(int large) {
  const uint lane = get_local_id(0);
  if (!large) return get_group_id(0) == 0 ? lane : NO_INDEX;
  return lane % BTGPU_LANES + BTGPU_LANES * (get_group_id(0) + get_num_groups(0) * (lane / BTGPU_LANES));
}
static uint strideOf(int large) { return large ? RESIDENT_GROUP * get_num_groups(0) : RESIDENT_GROUP; }

// This lane's first slot in a turn, or NO_INDEX.
static uint firstSlot(Turn turn, uint colours, uint large, __local const uint* firsts) {
  if (turn.repeats == 0 || turn.colour >= colours) return NO_INDEX;
  const uint i = firstOf(turn.colour < large), first = firsts[turn.colour];
  return i < firsts[turn.colour + 1] - first ? first + i : NO_INDEX;
}

// `repeats` times the passes of `sequence`, as solveInTeam. While the groups wait for each other, the impulses of this
// colour, the rows of the next one and the header of the one after it, which says what rows there are, are under way:
// nobody but the lane itself touches those.
// `team`: of ../lib/resident.h.
KERNEL_OF(RESIDENT_GROUP)
solveResident(CHECKS uint repeats, uint sequence, __global StepCounters* counters, __global const StepParams* params,
              __global const uint* slotFirst, __global const SlotHeader* slots, __global const SolverMass* masses,
              __global SolverBody* bodies, __global float* rows, __global float* tangent2, __global float* torsion,
              __global uint* team) {
  __local uint state, firsts[COLOUR_TABLE];
  Resident r;
  for (uint c = get_local_id(0); c < COLOUR_TABLE; c += RESIDENT_GROUP) firsts[c] = slotFirst[c];
  const int complete = callRoll(&r, team, counters, &state);
  const uint flags = params->flags, colours = counters->colourCount, large = min(counters->largeColours, colours);
  const uint serial = firsts[COLOUR_SERIAL + 1] - firsts[COLOUR_SERIAL];
  const int together = large > 0;  // else the first group is alone
  const uint lastColour = serial > 0 ? colours : colours - 1;
  FetchedSlot f;
  f.header.manifold = NO_INDEX;
  SlotHeader ahead = f.header;  // of the lane's first slot in the turn `next`
  Turn turn = {repeats, sequence, 0};
  if (!complete || counters->overflow || (!together && get_group_id(0) != 0) || colours + serial == 0) turn.repeats = 0;
  Turn next = nextTurn(turn, sequence, lastColour);
  uint nextSlot = firstSlot(next, colours, large, firsts);
  if (nextSlot != NO_INDEX) ahead = AT(slots, nextSlot);
  int fetched = 0;
  while (turn.repeats > 0) {
    const uint passes = passesOf(turn), colour = turn.colour;
    const int isLarge = colour < large;
    int solved = 0;
    if (colour < colours) {
      const uint first = firsts[colour], end = firsts[colour + 1];
      for (uint i = firstOf(isLarge); i < end - first; i += strideOf(isLarge)) {
        if (solved) storeFetched(passes, &f);
        if (solved || !fetched) {
          fetchRows(WITH_CHECKS first + i, AT(slots, first + i), passes, flags, rows, tangent2, torsion, &f);
        }
        solveFetched(WITH_CHECKS passes, flags, masses, bodies, &f);
        solved = 1;
      }
    } else if (get_global_id(0) == 0) {
      for (uint slot = firsts[COLOUR_SERIAL]; slot < firsts[COLOUR_SERIAL + 1]; ++slot) {
        solveSlot(WITH_CHECKS slot, passes, flags, slots, masses, bodies, rows, tangent2, torsion);
      }
    }
    turn = nextTurn(turn, sequence, lastColour);
    // All wait for each other after a large colour, and for the first group when it has done the small ones.
    const int meets = together && turn.repeats > 0 && (isLarge || turn.colour == 0);
    if (meets) {
      arrive(&r);
    } else {
      barrier(CLK_GLOBAL_MEM_FENCE);
    }
    if (solved) storeFetched(passes, &f);
    fetched = nextSlot != NO_INDEX;
    if (fetched) fetchRows(WITH_CHECKS nextSlot, ahead, passesOf(turn), flags, rows, tangent2, torsion, &f);
    next = nextTurn(turn, sequence, lastColour);
    nextSlot = firstSlot(next, colours, large, firsts);
    if (nextSlot != NO_INDEX) ahead = AT(slots, nextSlot);
    if (meets) awaitOthers(&r);
  }
  leaveResident(&r);
}

#endif

// ---- joints

// Solves the joints order[first ...] of one colour.
KERNEL solveJointColour(CHECKS uint iteration, uint first, uint count, __global const StepCounters* counters,
                        __global const uint* order, __global const Joint* joints, __global const JointRow* rows,
                        __global const JointEffect* effects, __global const uint* jointSolved,
                        __global const SolverMass* masses, __global SolverBody* bodies, __global float* impulses) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, count) {
    solveJoint(WITH_CHECKS AT(order, first + i), iteration, joints, rows, effects, jointSolved, masses, bodies,
               impulses);
  }
}

// Solves joints that share bodies, one after the other. Single work item.
SINGLE_KERNEL solveJointsSerial(CHECKS uint iteration, uint first, uint count, __global const StepCounters* counters,
                                __global const uint* order, __global const Joint* joints, __global const JointRow* rows,
                                __global const JointEffect* effects, __global const uint* jointSolved,
                                __global const SolverMass* masses, __global SolverBody* bodies,
                                __global float* impulses) {
  RETURN_ON_OVERFLOW(counters);
  for (uint i = first; i < first + count; ++i) {
    solveJoint(WITH_CHECKS AT(order, i), iteration, joints, rows, effects, jointSolved, masses, bodies, impulses);
  }
}

// Accumulated impulses back into the manifolds. Without warm starting Bullet leaves them as they were.
KERNEL storeImpulses(CHECKS uint slotCapacity, __global const StepCounters* counters, __global const StepParams* params,
                     __global const SlotHeader* slots, __global const float* rows, __global const float* tangent2,
                     __global Manifold* manifolds) {
  RETURN_ON_OVERFLOW(counters);
  if (!(params->flags & STEP_WARM_START)) return;
  FOR_EACH(i, itemCount(slotCapacity, &counters->slotCount)) {
    const SlotHeader h = AT(slots, i);
    if (h.manifold == NO_INDEX) continue;
    for (uint k = 0; k < h.pointCount; ++k) {
      __global const float* p = rows + slotBase(i, SLOT_FIELDS) + k * POINT_FIELDS * BTGPU_LANES;
      ASSERT_FLOATS(isfinite(loadField(p, ROW_NORMAL_JAC)) && isfinite(loadField(p, ROW_NORMAL_RHS)),
                    loadField(p, ROW_NORMAL_JAC), loadField(p, ROW_NORMAL_RHS));
      if (loadField(p, ROW_NORMAL_JAC) == 0.0f) continue;
      __global ContactPoint* point = &AT(manifolds, h.manifold).points[k];
      point->localPointB.w = loadField(p, ROW_NORMAL_IMPULSE);
      point->normalWorldOnB.w = loadField(p, ROW_TANGENT1_IMPULSE);
      if (params->flags & STEP_TWO_FRICTION) {
        point->lateralFrictionDir1.w = loadField(
            tangent2 + slotBase(i, SLOT_TANGENT2_FIELDS) + k * TANGENT2_FIELDS * BTGPU_LANES, ROW_TANGENT2_IMPULSE);
      }
    }
  }
}
