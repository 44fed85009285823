// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs, contact candidates and persistent manifolds.
#ifndef BTGPU_SHARED_CONTACT_H
#define BTGPU_SHARED_CONTACT_H
#include "types.h"

BTGPU_BEGIN

#define NO_INDEX 0xffffffffu
#define LISTED_ONLY 0x80000000u  // in the number of listed pairs: they alone may collide, and not all others
// Among the listed pairs with LISTED_ONLY, behind the others: a pair that may not collide, but keeps what contacts it has.
#define PAIR_KEEPS_CONTACTS (1UL << 63)  // no slot has so high a number
#define MANIFOLD_POINTS 4  // as Bullet's MANIFOLD_CACHE_SIZE
#define RAW_POINTS 8       // a rectangle clipped by a rectangle has at most 8 corners
#define MATCH_GROUP 64     // pairs that a work group of stage 48 takes at once, on the GPU shape

// Key of a pair, by which it is sorted and its manifold found again: lower body index << 32 | higher one.
LIB ulong pairKeyOf(uint a, uint b) { return ((ulong)(a < b ? a : b) << 32) | (a < b ? b : a); }

// One pair of slots whose AABBs overlap: bodies, or shapes of compounds (BODY_CHILD). Sorted by (lower, higher) slot.
STRUCT(Pair) {
  uint bodyA, bodyB;  // manifold order: A has the lower proxy id, but a plane is always B; shapes in more compounds are A
  uint oldManifold;   // index of the pair's manifold in the last step, or NO_INDEX
  uint bucket;        // BUCKET_*
};

// Result of the separating axis test of two boxes.
STRUCT(SeparatingAxis) {
  float4 normal;  // unit, world axes, from A to B; w: penetration depth, > 0
  int code;       // 0-2: face of A, 3-5: face of B, 6-14: edge of A x edge of B, -1: separated
  int unused[3];
};

// Where two convex cores (shapes without their margins) are closest, or how they leave each other. In A's axes, from
// A's position.
STRUCT(ClosestFeatures) {
  float4 normal;  // unit, from A to B; w: separation of the cores, negative: overlap
  float4 onA;     // closest point of A's core; w = 0
  float4 onB;     // of B's
};

// Contact candidates of one pair, before reduction and matching. Of a pair in BUCKET_MESH at most MANIFOLD_POINTS, each
// with a normal of its own: that of points[k] is points[MANIFOLD_POINTS + k], whose w is lateralFrictionDir2.w of the
// contact point.
STRUCT(RawContacts) {
  float4 normal;              // unit, world axes, on B (from B towards A); w = 0
  float4 points[RAW_POINTS];  // xyz: point on B, world axes, relative to A's position; w: distance, < 0 inside
  int count;
  uint axis;  // of convex pairs: for Manifold.axis
  int unused[2];
};

// Bits of ContactPoint.flags: Bullet's btContactPointFlags.
#define POINT_LATERAL_FRICTION_INITIALIZED 1
#define POINT_CFM 2  // of its own, and is in combinedStiffness, as in Bullet
#define POINT_ERP 4  // likewise, in combinedDamping
#define POINT_STIFFNESS_DAMPING 8
#define POINT_FRICTION_ANCHOR 16
// Above Bullet's bits: 1 + the index that the point had in the manifold as the host saw it last, 0 for a new point. The
// host needs it for what Bullet keeps in a point and the device does not know (btManifoldPoint::m_userPersistentData).
#define POINT_BULLET_FLAGS 0x00ffffff
#define POINT_ORIGIN_SHIFT 24
#define POINT_ORIGIN (7 << POINT_ORIGIN_SHIFT)
// Of the host's points: until the solver has stored them, in place of the two impulses of friction are the speeds
// wanted along its two directions (btManifoldPoint::m_contactMotion1 and 2).
#define POINT_MOTION (1 << 27)

// Bit of StepResults::contactKeys, above the pair's key: neither body was active, the manifold is as the host saw it last.
#define CONTACT_CARRIED (1UL << 63)

// The persistent part of btManifoldPoint.
STRUCT(ContactPoint) {
  float4 localPointA;           // in A's axes, from A's centre; w: distance, negative inside
  float4 localPointB;           // in B's axes, from B's centre; w: applied impulse, normal
  float4 normalWorldOnB;        // w: applied impulse, first friction direction
  float4 lateralFrictionDir1;   // w: applied impulse, second friction direction
  float4 lateralFrictionDir2;   // w: 1 + the triangle of B, counted from its mesh's first, as a float; 0: none
  float4 combined;              // friction, restitution, rolling friction, spinning friction
  float combinedStiffness, combinedDamping;  // valid with POINT_STIFFNESS_DAMPING, POINT_CFM, POINT_ERP
  int lifeTime;                 // steps since the point was made
  int flags;                    // POINT_*
};

STRUCT(Manifold) {
  uint bodyA, bodyB;          // bodies also where a compound's shape touches; anchors are in their axes
  int pointCount;
  uint bucket;                // of the step that wrote it; BUCKET_NONE also while no algorithm has run on the pair
  float breakingThreshold;    // fixed when the manifold is made, as in Bullet
  float processingThreshold;  // likewise
  uint unseen;                // 1: it may differ from what the host saw last, before this step
  uint axis;                  // convex pairs: where to look first in the next step, from A to B (packAxis); 0: nowhere
  ContactPoint points[MANIFOLD_POINTS];
};

BTGPU_END
#endif
