// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Solver rows of contacts. One constraint slot holds the rows of one manifold. Slots are stored in blocks of
// BTGPU_LANES slots, field by field (AoSoA): float f of slot s lies at
//   rows[((s / BTGPU_LANES) * FIELDS + f) * BTGPU_LANES + s % BTGPU_LANES]
// so that neighbouring lanes read neighbouring addresses, on a GPU warp and in a CPU vector alike.
#ifndef BTGPU_SHARED_ROWS_H
#define BTGPU_SHARED_ROWS_H
#include "contact.h"

BTGPU_BEGIN

#define BTGPU_LANES 32

// Fields of a contact point; "jac" is the inverse of J M^-1 J^T, "rhs" the impulse wanted at rest.
#define ROW_NORMAL 0        // xyz, on B
#define ROW_R_A 3           // xyz, from A's centre, world axes
#define ROW_R_B 6           // xyz, from B's centre
#define ROW_NORMAL_JAC 9
#define ROW_NORMAL_RHS 10
#define ROW_NORMAL_CFM 11   // already times jac
#define ROW_NORMAL_IMPULSE 12
#define ROW_PUSH_RHS 13     // split impulse: nonzero where the penetration is solved apart from the velocity
#define ROW_PUSH_IMPULSE 14
#define ROW_FRICTION 15     // combined friction coefficient
#define ROW_TANGENT1 16     // xyz
#define ROW_TANGENT1_JAC 19
#define ROW_TANGENT1_RHS 20
#define ROW_TANGENT1_IMPULSE 21
#define POINT_FIELDS 22

// Present only with SOLVER_USE_2_FRICTION_DIRECTIONS, in an array of their own.
#define ROW_TANGENT2 0  // xyz
#define ROW_TANGENT2_JAC 3
#define ROW_TANGENT2_RHS 4
#define ROW_TANGENT2_IMPULSE 5
#define TANGENT2_FIELDS 6

// Present only when some body has rolling friction: three torsional rows a point (normal axis, two tangents).
#define ROW_TORSION_AXIS 0  // xyz
#define ROW_TORSION_JAC 3
#define ROW_TORSION_RHS 4
#define ROW_TORSION_FRICTION 5  // 0: the row is unused
#define ROW_TORSION_IMPULSE 6
#define TORSION_FIELDS 7
#define TORSION_ROWS 3

#define SLOT_FIELDS (MANIFOLD_POINTS * POINT_FIELDS)
#define SLOT_TANGENT2_FIELDS (MANIFOLD_POINTS * TANGENT2_FIELDS)
#define SLOT_TORSION_FIELDS (MANIFOLD_POINTS * TORSION_ROWS * TORSION_FIELDS)

// Whose rows a slot holds.
STRUCT(SlotHeader) {
  uint bodyA, bodyB;  // NO_INDEX where the solver must not move the body
  uint manifold;      // index of the manifold, or NO_INDEX: padding
  uint pointCount;
};

// What a launch of the solver does with the slots of a colour.
#define PASS_WARM_START 1u
#define PASS_NORMAL 2u  // and the split impulse rows, whose velocities are their own
#define PASS_FRICTION 4u
#define PASS_TORSION 8u
#define PASS_BITS 4

#define RESIDENT_GROUP 256              // of solveResident and colourResident; fits a multiprocessor with any registers
#define COLOUR_LIST 3840                // constraints that a group of colourResident can list: two lists in 32 KiB
#define SOLVE_GROUP 64                  // work items of a group of solveColour, on the GPU shape
#define COLOUR_LIMIT 64                 // colours solved in parallel; what needs more goes to the serial batch
#define COLOUR_SERIAL COLOUR_LIMIT      // index of the serial batch in the colour tables
#define SMALL_COLOUR 256                // a colour of no more constraints is done before others have come to help
#define COLOUR_TABLE (COLOUR_LIMIT + 2)  // colours, serial batch, end
#define COLOUR_NONE 0xffffffffu

BTGPU_END
#endif
