// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Joints: rows come from the host (Bullet's getInfo2), all else is found on the device.
#ifndef BTGPU_SHARED_JOINT_H
#define BTGPU_SHARED_JOINT_H
#include "contact.h"

BTGPU_BEGIN

STRUCT(Joint) {
  uint bodyA, bodyB;      // NO_INDEX where the solver must not move the body
  uint islandA, islandB;  // the same bodies if they belong to islands, else NO_INDEX
  uint firstRow, rowCount;
  int iterations;       // its rows are solved in this many iterations
  uint enabled;         // 0: no rows, and its bodies' islands stay apart
  float damping;        // share of the velocity error that a row removes
  float leastMobility;  // Bullet's SIMD_EPSILON: a row that yields less is not solved
  // Of the fast mode only.
  uint equalRows;       // bit r: row r is without limits, for a position error
  uint boundRows;       // bit r: it has one limit, the joint's own
};

// One row as getInfo2 makes it. Bullet's btSolverConstraint: contactNormal1, relpos1CrossNormal and so on.
STRUCT(JointRow) {
  float4 linearA;   // w: velocity wanted for the position error, less what bodies move with that the solver holds
  float4 angularA;  // w: constraint force mixing
  float4 linearB;   // w: lower limit of the impulse
  float4 angularB;  // w: upper limit
};

// What the device adds to a row.
STRUCT(JointEffect) {
  float jac;  // inverse of J M^-1 J^T; 0: the row is not solved
  float rhs;  // impulse wanted at rest
};

// Colours of joints are their own graph: all joint rows precede all contact rows. Joints that need more colours go
// to a serial batch.
#define JOINT_COLOUR_LIMIT 32
// So many colours may be used to solve the joints as if one after the other, in their own order.
#define JOINT_ORDER_LIMIT 16

// On the CPU shape the solver takes JOINT_LANES joints of a colour side by side. Of a block of them: a head, whose field
// f is at [f * JOINT_LANES], and rows in the order in which they are solved, likewise.
#define JOINT_LANES 16
#define HEAD_BODY_A 0      // as in Joint
#define HEAD_BODY_B 1
#define HEAD_FIRST_ROW 2
#define HEAD_ROW_COUNT 3
#define HEAD_ITERATIONS 4  // 0: not solved
#define JOINT_HEAD_FIELDS 5
#define JOINT_LINEAR_A 0   // as in JointRow
#define JOINT_ANGULAR_A 3
#define JOINT_LINEAR_B 6
#define JOINT_ANGULAR_B 9
#define JOINT_CFM 12
#define JOINT_LOWER 13
#define JOINT_UPPER 14
#define JOINT_JAC 15       // as in JointEffect; 0: the row is not solved, and all of it is 0 but the impulse
#define JOINT_RHS 16
#define JOINT_IMPULSE 17
#define JOINT_ROW_FIELDS 18

BTGPU_END
#endif
