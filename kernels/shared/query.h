// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Batched queries: rays, and the items that they meet. An item is one shape in the world: a collision object's own, or
// one child of its compound. BodyInfo::uniqueId of an item is the position of its object in the world's array.
#ifndef BTGPU_SHARED_QUERY_H
#define BTGPU_SHARED_QUERY_H
#include "body.h"

BTGPU_BEGIN

// Bits of Ray.flags, with the numbers of btTriangleRaycastCallback::EFlags.
#define RAY_FILTER_BACKFACES 1u
#define RAY_KEEP_UNFLIPPED_NORMAL 2u
#define RAY_GJK_CAST 8u    // the host's
#define RAY_ALL_TRIANGLES 16u  // kF_DisableHeightfieldAccelerator: of a height field those that bodies collide with
#define RAY_OFF 0x80000000u  // not finite, of no length, or the host's: meets nothing

STRUCT(Ray) {
  float4 from, to;  // length, relative to the region origin; w = 0
  int filterGroup, filterMask;
  uint flags;    // RAY_*
  uint ignored;  // position of an object that it passes through, or NO_INDEX
};

// Item to world as Bullet has it: no quaternion, whose rounding would be another.
STRUCT(ItemPose) {
  float4 row0, row1, row2;  // of the rotation; w: origin, relative to the region origin
};

// Bits of ItemForm.flags.
#define FORM_HEIGHT_FIELD 1u   // a ray is told the cell of a height field, not its triangle
#define FORM_OTHER_WINDING 2u  // and meets its triangles with their corners the other way round

// What an item is besides a shape in a place: Bullet scales some shapes only as it asks what is inside of them.
STRUCT(ItemForm) {
  float4 scaling;  // of a convex shape, the same along each axis, or of a mesh; w = 0
  uint child;      // index of a CompoundChild, or NO_INDEX
  uint flags;      // FORM_*
  // Of a multi-sphere: first of its spheres in the array of spheres, and their number.
  // Before these is (scaling, margin); each is its centre, scaled, and w: its radius, not scaled.
  int firstSphere, sphereCount;
};

STRUCT(RayHit) {
  float4 normal;  // unit, world axes; w: fraction of the ray, 1 if nothing was hit
  uint object;    // position in the world's array of collision objects, or NO_INDEX
  int part, triangle;  // Bullet's LocalShapeInfo; -1: none
  uint unused;
};

// What tells one child of a compound from the others, and what a ray has to meet before the child: stock asks the
// object's own AABB first, then the child's in the compound's axes.
STRUCT(CompoundChild) {
  ItemPose pose;       // of the compound
  Aabb objectAabb;     // of the broadphase
  Aabb childAabb;      // in the compound's axes
  int child;           // its index, Bullet's m_triangleIndex
  int unused[3];
};

// A convex shape on its way from one place to another.
STRUCT(Sweep) {
  float4 from, to;      // length, relative to the region origin; w = 0
  float4 orientation;   // quaternion at `from`
  float4 turn;          // axis, times the angle by which it turns on its way; w: how far that moves a point of it at most
  float4 lower, upper;  // bounds of the shape around its place, turning included; w = 0
  int filterGroup, filterMask;
  uint ignored;  // as Ray.ignored
  int shape;     // -1: not finite, does not move, or the host's; meets nothing
  float allowedPenetration;
  uint unused[3];
};

STRUCT(SweepHit) {
  float4 normal;  // unit, world axes, from what was hit; w: fraction of the way, 1 if nothing was hit
  float4 point;   // on what was hit, relative to the region origin; w = 0
  uint object;    // position in the world's array of collision objects, or NO_INDEX
  uint unused[3];
};

// Two convex shapes or a plane, wherever they are.
STRUCT(ClosestQuery) {
  ItemPose poseA, poseB;  // relative to A's position, for accuracy
  int shapeA, shapeB;     // B: -1 for a sphere of radiusB
  float radiusB;          // length
  float limit;            // length; shapes farther apart are not looked at
};

STRUCT(ClosestAnswer) {
  float4 onA, onB;  // on the surfaces, as the poses are; w = 0
  float4 normal;    // unit, from B to A; w: distance, negative inside
  int found;        // 0: farther apart than the limit
  int unused[3];
};

BTGPU_END
#endif
