// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stage 70 of a world with joints, on the CPU shape: joints and contacts by one team in one launch, JOINT_LANES joints
// at once (docs/decisions/0029-joints-in-the-team.md).
#include "../lib/kernel.h"
#ifdef BTGPU_SHAPE_CPU
#include "../lib/joint_wide.h"
#include "../lib/solve_joint.h"
#include "../lib/solve_team.h"

#define PART_JOINT_BLOCKS 4u  // that are worth a part of their own

// The joints of a block and their rows side by side.
static void layBlock(CHECKS uint block, __global const uint* jointLanes, __global const uint* jointBlockRows,
                     __global const Joint* joints, __global const JointRow* rows,
                     __global const JointEffect* effects, __global const uint* jointSolved,
                     __global const SolverBody* bodies, __global const float* impulses, __global uint* jointHeads,
                     __global float* jointLaneRows) {
  __global uint* head = jointHeads + block * JOINT_HEAD_FIELDS * JOINT_LANES;
  uint firstRow[JOINT_LANES], rowCount[JOINT_LANES], safe = 0;
  for (uint lane = 0; lane < JOINT_LANES; ++lane) {
    const uint j = AT(jointLanes, block * JOINT_LANES + lane);
    Joint joint;
    joint.bodyA = joint.bodyB = NO_INDEX;
    joint.firstRow = joint.rowCount = 0;
    joint.iterations = 0;
    if (j != NO_INDEX) {
      joint = AT(joints, j);
      if (!AT(jointSolved, j)) joint.iterations = 0;
#ifdef BTGPU_DEBUG
      // The vector code checks nothing.
      if (joint.bodyA != NO_INDEX) (void)AT(bodies, joint.bodyA).deltaLinear.x;
      if (joint.bodyB != NO_INDEX) (void)AT(bodies, joint.bodyB).deltaLinear.x;
      ASSERT(joint.firstRow + joint.rowCount <= LENGTH(rows), joint.firstRow, joint.rowCount);
      if ((joint.bodyA != NO_INDEX && joint.bodyA >= LENGTH(bodies)) ||
          (joint.bodyB != NO_INDEX && joint.bodyB >= LENGTH(bodies)) ||
          joint.firstRow + joint.rowCount > LENGTH(rows)) {
        joint.bodyA = joint.bodyB = NO_INDEX;
        joint.firstRow = joint.rowCount = 0;
        joint.iterations = 0;
      }
#endif
    }
    head[HEAD_BODY_A * JOINT_LANES + lane] = joint.bodyA;
    head[HEAD_BODY_B * JOINT_LANES + lane] = joint.bodyB;
    head[HEAD_FIRST_ROW * JOINT_LANES + lane] = firstRow[lane] = joint.firstRow;
    head[HEAD_ROW_COUNT * JOINT_LANES + lane] = rowCount[lane] = joint.rowCount;
    head[HEAD_ITERATIONS * JOINT_LANES + lane] = (uint)joint.iterations;
    if (joint.rowCount > 0) safe = joint.firstRow;
  }
  const uint first = AT(jointBlockRows, block), count = AT(jointBlockRows, block + 1) - first;
  for (uint r = 0; r < count; ++r) {
    layJointRow(r, firstRow, rowCount, safe, rows, effects, impulses,
                jointLaneRows + (first + r) * JOINT_ROW_FIELDS * JOINT_LANES);
  }
}

// The impulses of a block's rows to where those of all joints are.
static void takeImpulses(CHECKS uint block, __global const uint* jointBlockRows, __global const uint* jointHeads,
                         __global const float* jointLaneRows, __global float* impulses) {
  __global const uint* head = jointHeads + block * JOINT_HEAD_FIELDS * JOINT_LANES;
  const uint first = AT(jointBlockRows, block), count = AT(jointBlockRows, block + 1) - first;
  for (uint r = 0; r < count; ++r) {
    __global const float* row = jointLaneRows + ((first + r) * JOINT_ROW_FIELDS + JOINT_IMPULSE) * JOINT_LANES;
    for (uint lane = 0; lane < JOINT_LANES; ++lane) {
      if (r >= head[HEAD_ROW_COUNT * JOINT_LANES + lane]) continue;
      AT(impulses, head[HEAD_FIRST_ROW * JOINT_LANES + lane] + r) = row[lane];
    }
  }
}

static uint partsOf(uint blocks) { return clamp(blocks / PART_JOINT_BLOCKS, 1u, (uint)TEAM_PARTS); }

// One iteration of this member's share of the blocks of a colour; false if it has to leave the team.
static int solveBlocks(CHECKS Member* m, uint iteration, uint first, uint end, __global const uint* jointBlockRows,
                       __global const uint* jointHeads, __global float* jointLaneRows,
                       __global const SolverMass* masses, __global SolverBody* bodies) {
  if (first == end) return 1;
  const uint parts = partsOf(end - first);
  uint mine = 0;
  beginRound(m, parts);
  for (uint part = takePart(m, parts); part != NO_INDEX; part = takePart(m, parts)) {
    const uint partEnd = first + CHUNK_BEGIN(end - first, part + 1, parts);
    for (uint block = first + CHUNK_BEGIN(end - first, part, parts); block < partEnd; ++block) {
      const uint row = AT(jointBlockRows, block);
      solveJointsWide(iteration, AT(jointBlockRows, block + 1) - row,
                      jointHeads + block * JOINT_HEAD_FIELDS * JOINT_LANES,
                      jointLaneRows + row * JOINT_ROW_FIELDS * JOINT_LANES, masses, bodies);
    }
    ++mine;
  }
  return endRound(m, mine);
}

// Before the first iteration (`before`) or after the last one, all blocks.
static int moveBlocks(CHECKS Member* m, int before, uint blocks, __global const uint* jointLanes,
                      __global const uint* jointBlockRows, __global const Joint* joints,
                      __global const JointRow* rows, __global const JointEffect* effects,
                      __global const uint* jointSolved, __global const SolverBody* bodies, __global float* impulses,
                      __global uint* jointHeads, __global float* jointLaneRows) {
  if (blocks == 0) return 1;
  const uint parts = partsOf(blocks);
  uint mine = 0;
  beginRound(m, parts);
  for (uint part = takePart(m, parts); part != NO_INDEX; part = takePart(m, parts)) {
    for (uint block = CHUNK_BEGIN(blocks, part, parts); block < CHUNK_BEGIN(blocks, part + 1, parts); ++block) {
      if (before) {
        layBlock(WITH_CHECKS block, jointLanes, jointBlockRows, joints, rows, effects, jointSolved, bodies,
                 impulses, jointHeads, jointLaneRows);
      } else {
        takeImpulses(WITH_CHECKS block, jointBlockRows, jointHeads, jointLaneRows, impulses);
      }
    }
    ++mine;
  }
  return endRound(m, mine);
}

// The serial batch of the joints, one after the other, all by one member.
static int solveSerialJoints(CHECKS Member* m, uint iteration, uint first, uint count, __global const uint* order,
                             __global const Joint* joints, __global const JointRow* rows,
                             __global const JointEffect* effects, __global const uint* jointSolved,
                             __global const SolverMass* masses, __global SolverBody* bodies,
                             __global float* impulses) {
  if (count == 0) return 1;
  beginRound(m, 1);
  const uint mine = takePart(m, 1) != NO_INDEX;
  for (uint i = first; mine && i < first + count; ++i) {
    solveJoint(WITH_CHECKS AT(order, i), iteration, joints, rows, effects, jointSolved, masses, bodies, impulses);
  }
  return endRound(m, mine);
}

// All of stage 70 but the storing of the contacts' impulses: the passes of `warm`, then in each iteration the joints
// colour by colour and the passes over contacts. jointColours: their number, the first block of each and the end.
KERNEL solveJointsInTeam(CHECKS uint jointIterations, uint iterations, uint warm, uint sequence, uint lastSequence,
                         uint serialFirst, uint serialCount, __global const StepCounters* counters,
                         __global const StepParams* params, __global const uint* slotFirst,
                         __global const SlotHeader* slots, __global const SolverMass* masses,
                         __global SolverBody* bodies, __global float* slotRows, __global float* tangent2,
                         __global float* torsion, __global uint* team, __global const uint* order,
                         __global const uint* jointColours, __global const uint* jointLanes,
                         __global const uint* jointBlockRows, __global const Joint* joints,
                         __global const JointRow* rows, __global const JointEffect* effects,
                         __global const uint* jointSolved, __global float* impulses, __global uint* jointHeads,
                         __global float* jointLaneRows) {
  RETURN_ON_OVERFLOW(counters);
  const uint flags = params->flags, colours = counters->colourCount, jointColourCount = jointColours[0];
  Member m = joinTeam(team);
  ASSERT(m.rank < get_num_groups(0), m.rank, get_num_groups(0));
  ASSERT(colours <= COLOUR_LIMIT, colours, slotFirst[COLOUR_SERIAL]);
  const uint blocks = AT(jointColours, jointColourCount + 1);
  int stays = moveBlocks(WITH_CHECKS &m, 1, blocks, jointLanes, jointBlockRows, joints, rows, effects, jointSolved,
                         bodies, impulses, jointHeads, jointLaneRows);
  // One call, so that the code for contacts is there once; turn 0 is the warm start.
  for (uint turn = 0; turn <= max(jointIterations, iterations) && stays; ++turn) {
    const uint iteration = turn - 1;
    for (uint c = 0; c < jointColourCount && turn > 0 && iteration < jointIterations && stays; ++c) {
      stays = solveBlocks(WITH_CHECKS &m, iteration, AT(jointColours, c + 1), AT(jointColours, c + 2), jointBlockRows,
                          jointHeads, jointLaneRows, masses, bodies);
    }
    if (turn > 0 && iteration < jointIterations && stays) {
      stays = solveSerialJoints(WITH_CHECKS &m, iteration, serialFirst, serialCount, order, joints, rows, effects,
                                jointSolved, masses, bodies, impulses);
    }
    const uint wanted = turn == 0 ? warm : turn < iterations ? sequence : turn == iterations ? lastSequence : 0;
    if (stays) {
      stays = solveSequence(WITH_CHECKS &m, wanted, colours, flags, slotFirst, slots, masses, bodies, slotRows,
                            tangent2, torsion);
    }
  }
  if (stays) {
    moveBlocks(WITH_CHECKS &m, 0, blocks, jointLanes, jointBlockRows, joints, rows, effects, jointSolved, bodies,
               impulses, jointHeads, jointLaneRows);
  }
  leaveTeam(&m);
}

#endif
