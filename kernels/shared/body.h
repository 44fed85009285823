// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A body, split by who reads it. All arrays of these are indexed by the body index (a stable slot).
// Units are Bullet's own: the application's length, mass and time units; positions are relative to the
// origin of the body's region (WorldInput::regionOrigin), so that they fit a float anywhere.
#ifndef BTGPU_SHARED_BODY_H
#define BTGPU_SHARED_BODY_H
#include "types.h"

BTGPU_BEGIN

// Bits of BodyInfo.flags.
#define BODY_PRESENT 0x0001u            // the slot holds a body
#define BODY_STATIC 0x0002u             // CF_STATIC_OBJECT
#define BODY_KINEMATIC 0x0004u          // CF_KINEMATIC_OBJECT
#define BODY_NO_RESPONSE 0x0008u        // CF_NO_CONTACT_RESPONSE
#define BODY_RIGID 0x0010u              // a btRigidBody, not a plain btCollisionObject
#define BODY_INTEGRATED 0x0020u         // in the world's list of non-static rigid bodies
#define BODY_STIFFNESS 0x0040u          // CF_HAS_CONTACT_STIFFNESS_DAMPING
#define BODY_ANISOTROPIC 0x0080u        // CF_ANISOTROPIC_FRICTION
#define BODY_ANISOTROPIC_ROLLING 0x0100u
#define BODY_ADDITIONAL_DAMPING 0x0200u
#define BODY_GYRO_EXPLICIT 0x0400u
#define BODY_GYRO_IMPLICIT_WORLD 0x0800u
#define BODY_GYRO_IMPLICIT_BODY 0x1000u
#define BODY_QUARANTINED 0x2000u        // holds NaN or infinity: takes no part until it is finite again
#define BODY_HOST_CONTACTS 0x4000u      // the host finds the contacts of all its pairs
#define BODY_CHILD 0x8000u              // no body, but one of the shapes of a compound: BodyInfo.parent is the body
#define BODY_COMPOUND 0x10000u          // its shapes have slots of their own; its own AABB only joins islands
#define BODY_FRICTION_ANCHOR 0x20000u   // CF_HAS_FRICTION_ANCHOR

// Activation states, with Bullet's numbers (btCollisionObject.h).
#define STATE_UNSET 0
#define STATE_ACTIVE 1
#define STATE_SLEEPING 2
#define STATE_WANTS_DEACTIVATION 3
#define STATE_DISABLE_DEACTIVATION 4
#define STATE_DISABLE_SIMULATION 5
#define STATE_FIXED_BASE 6

STRUCT(BodyPose) {
  float4 position;     // length, relative to the region origin; w = 0
  float4 orientation;  // unit quaternion x, y, z, w: body to world
};

STRUCT(BodyVelocity) {
  float4 linear;   // length / time, world axes; w = 0
  float4 angular;  // radians / time, world axes; w = 0
};

STRUCT(BodyForces) {
  float4 force;   // total force of the step, gravity included, linear factor applied; w = 0
  float4 torque;  // total torque of the step, angular factor applied; w = 0
};

STRUCT(BodyMass) {
  float4 inverseInertiaLocal;  // diagonal in body axes; w: inverse mass
  float4 linearFactor;         // w = 0
  float4 angularFactor;        // w = 0
};

STRUCT(BodyMaterial) {
  float friction, rollingFriction, spinningFriction, restitution;
  float contactStiffness, contactDamping;  // used when BODY_STIFFNESS is set
  float contactProcessingThreshold;        // length; contacts farther apart than this are not solved
  float unused;
  float4 anisotropicFriction;  // per body axis; w = 0
};

STRUCT(BodyDamping) {
  float linear, angular;  // fraction of velocity lost per unit of time
  float additionalFactor, additionalLinearThresholdSqr;
  float additionalAngularThresholdSqr, unused;
  float linearSleepingThreshold, angularSleepingThreshold;
};

STRUCT(BodyInfo) {
  int shapeIndex;
  uint flags;       // BODY_*
  int filterGroup;  // of the broadphase proxy
  int filterMask;
  int uniqueId;     // of the broadphase proxy: the lower one is body A of a pair, as in Bullet
  uint parent;      // with BODY_CHILD; else 0
  int child;        // with BODY_CHILD, for the host: number of the shape in the compound that it is in, nested or not
  int depth;        // with BODY_CHILD: how many compounds are around the shape; else 0
};

STRUCT(BodyActivation) {
  int state;               // STATE_*
  float deactivationTime;  // time spent below the sleeping thresholds
};

// What stage 10 derives once a step from the arrays above, for the stages that follow.
STRUCT(BodyStep) {
  float4 linearVelocity;   // after damping; zero for bodies that the solver holds fixed; w: inverse mass
  float4 angularVelocity;  // w: 1 where the solver may move the body, else 0
  float4 externalLinear;   // velocity change by force in this step; w = 0
  float4 externalAngular;  // velocity change by torque and gyroscopic term in this step; w = 0
  float4 inverseInertia0, inverseInertia1, inverseInertia2;  // rows of the world matrix; w = 0
  float4 predictedPosition;     // end of the step if nothing is touched; w = 0
  float4 predictedOrientation;  // quaternion
};

// What the solver changes: velocities since the start of the solve, as Bullet's btSolverBody has them.
STRUCT(SolverBody) {
  float4 deltaLinear, deltaAngular;  // w = 0
  float4 pushLinear, turnAngular;    // split impulse: moves the pose, not the velocity; w = 0
};

// Response to an impulse: delta linear = row.w (per axis) * impulse, delta angular = matrix * (r x impulse).
STRUCT(SolverMass) {
  float4 row0, row1, row2;  // xyz: row of factor * inverse inertia * factor; w: inverse mass * factor^2
};

STRUCT(Aabb) {
  float4 lower, upper;  // length, relative to the region origin; w = 0
};

BTGPU_END
#endif
