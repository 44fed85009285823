// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Solver rows of the fast mode (docs/fast_mode.md), in the blocks of rows.h: those of up to four points, then the
// friction of the whole manifold. Impulses are those of one substep; speeds are of A less those of B.
#ifndef BTGPU_SHARED_SOFT_H
#define BTGPU_SHARED_SOFT_H
#include "rows.h"

BTGPU_BEGIN

// Fields of a point.
#define SOFT_NORMAL 0         // xyz, on B
#define SOFT_ANGULAR_A 3      // xyz, arm x normal, world axes
#define SOFT_ANGULAR_B 6      // xyz
#define SOFT_MASS 9           // inverse of J M^-1 J^T; 0: the point is not solved
#define SOFT_SEPARATION 10    // at the start of the step, negative inside
#define SOFT_HELD 11          // speed along the normal of ends that the solver does not move
#define SOFT_SPRING_SHARE 12  // a contact with stiffness and damping of its own: its softness; else 0
#define SOFT_SPRING_RATE 13
#define SOFT_IMPULSE 14
#define SOFT_TOTAL 15         // of the substeps so far
#define SOFT_BOUNCE 16        // speed apart that restitution asks for after the step; 0: none
#define SOFT_POINT_FIELDS 17

// Fields of a manifold's friction, behind those of the points. It acts where the points have their mean.
#define SOFT_FRICTION (MANIFOLD_POINTS * SOFT_POINT_FIELDS)
#define SOFT_ARM_A 0          // xyz, from A's centre, world axes
#define SOFT_ARM_B 3          // xyz
#define SOFT_TANGENT1 6       // xyz; shorter than 1 with anisotropic friction
#define SOFT_TANGENT2 9       // xyz
#define SOFT_AXIS 12          // xyz, of the twist: the mean normal
#define SOFT_MASS11 15        // inverse of the 2 x 2 matrix J M^-1 J^T of the tangents
#define SOFT_MASS12 16
#define SOFT_MASS22 17
#define SOFT_TWIST_MASS 18
#define SOFT_COEFFICIENT 19   // combined friction, mean of the points
#define SOFT_LEVER 20         // mean distance of the points from where friction acts: what twist friction needs
#define SOFT_SPIN 21          // spinning friction
#define SOFT_HELD1 22         // speeds along tangents and axis of ends that the solver does not move
#define SOFT_HELD2 23
#define SOFT_HELD_TWIST 24
#define SOFT_IMPULSE1 25
#define SOFT_IMPULSE2 26
#define SOFT_TWIST_IMPULSE 27
#define SOFT_TOTAL1 28        // of the substeps so far
#define SOFT_TOTAL2 29
#define SOFT_FRICTION_FIELDS 30

// Rolling friction, in an array of its own that is there only if some body has it.
#define SOFT_ROLL_AXIS 0      // xyz; of the second row from SOFT_ROLL_FIELDS on
#define SOFT_ROLL_MASS 3      // 0: the row is unused
#define SOFT_ROLL_COEFFICIENT 4
#define SOFT_ROLL_HELD 5
#define SOFT_ROLL_IMPULSE 6
#define SOFT_ROLL_FIELDS 7
#define SOFT_ROLL_ROWS 2

#define SLOT_SOFT_FIELDS (SOFT_FRICTION + SOFT_FRICTION_FIELDS)
#define SLOT_ROLL_FIELDS (SOFT_ROLL_ROWS * SOFT_ROLL_FIELDS)

// What a launch does, over the slots colour by colour or over the bodies.
#define SUB_WARM_START 1u  // impulses of the step before
#define SUB_SOLVE 2u       // soft rows, with what penetration asks for
#define SUB_MOVE 3u        // bodies: by the velocities of the substep
#define SUB_RELAX 4u       // hard rows, without it
#define SUB_BEGIN 5u       // bodies: of the next substep, with the impulses of the one before
#define SUB_BOUNCE 6u      // restitution
#define SUB_FINISH 7u      // bodies: what stage 80 needs
#define SUB_BITS 4
#define SUB_ROUNDING 1e-12f  // square of the share of a velocity below which a change is none

// A joint's row in the substeps.
STRUCT(SoftJointRow) {
  float wanted;   // speed of the ends that the solver moves
  float impulse;  // of a substep
};

BTGPU_END
#endif
