// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Collision shapes and the kinds of pairs that they form.
#ifndef BTGPU_SHARED_SHAPE_H
#define BTGPU_SHARED_SHAPE_H
#include "types.h"

BTGPU_BEGIN

#define SHAPE_NONE 0  // takes part in nothing
#define SHAPE_SPHERE 1
#define SHAPE_BOX 2
#define SHAPE_PLANE 3
#define SHAPE_HOST 16  // a shape that the device lacks: its AABB and its contacts come from the host

STRUCT(Shape) {
  int type;                 // SHAPE_*
  float margin;             // Bullet's collision margin; a sphere's is its radius
  float breakingThreshold;  // length: a contact is dropped when its points are farther apart
  float unused;
  float4 extents;  // box: half extents with margin; sphere: x = radius; plane: xyz = normal, w = constant
};

// A pair's bucket says which algorithm finds its contacts.
#define BUCKET_CARRY 0  // both bodies inactive: last step's manifold is kept as it is
#define BUCKET_SPHERE_SPHERE 1
#define BUCKET_SPHERE_PLANE 2
#define BUCKET_BOX_PLANE 3
#define BUCKET_SPHERE_BOX 4
#define BUCKET_BOX_BOX 5
#define BUCKET_NONE 6  // no contacts can arise (two planes)
#define BUCKET_HOST 7  // the host finds the contacts
#define BUCKET_COUNT 8

BTGPU_END
#endif
