// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Arrays of AABBs that are met one after the other. On a CPU BVH_ARITY of them lie together coordinate by coordinate
// (lower x of all, lower y, ... upper z), in the memory of as many AABBs, so that a work item looks at all of them at
// once. Such an array has room for whole blocks, and a block for one more number a box (storeTag). OpenCL C only.
#ifndef BTGPU_LIB_BOX_BLOCKS_H
#define BTGPU_LIB_BOX_BLOCKS_H
#include "../shared/bvh.h"
#include "bounds.h"
#include "kernel.h"

#ifdef BTGPU_SHAPE_CPU

static inline void storeBox(__global Aabb* boxes, uint place, Aabb box) {
  __global float* block = (__global float*)(boxes + place / BVH_ARITY * BVH_ARITY) + place % BVH_ARITY;
  block[0 * BVH_ARITY] = box.lower.x;
  block[1 * BVH_ARITY] = box.lower.y;
  block[2 * BVH_ARITY] = box.lower.z;
  block[3 * BVH_ARITY] = box.upper.x;
  block[4 * BVH_ARITY] = box.upper.y;
  block[5 * BVH_ARITY] = box.upper.z;
}

static inline Aabb loadBox(__global const Aabb* boxes, uint place) {
  __global const float* block =
      (__global const float*)(boxes + place / BVH_ARITY * BVH_ARITY) + place % BVH_ARITY;
  Aabb box;
  box.lower = vec3(block[0 * BVH_ARITY], block[1 * BVH_ARITY], block[2 * BVH_ARITY]);
  box.upper = vec3(block[3 * BVH_ARITY], block[4 * BVH_ARITY], block[5 * BVH_ARITY]);
  return box;
}

// Bit c is set where overlap.sc is -1 and not 0.
static inline uint maskOf8(int8 overlap) {
#ifdef __AVX__
  return (uint)__builtin_ia32_movmskps256(as_float8(overlap));
#else
  const int8 bits = overlap & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
  const int4 four = bits.lo | bits.hi;
  const int2 two = four.lo | four.hi;
  return (uint)(two.x | two.y);
#endif
}

static inline int8 overlaps8(__global const float* block, Aabb box) {
  return (vload8(0, block) <= box.upper.x) & (vload8(3, block) >= box.lower.x) &
         (vload8(1, block) <= box.upper.y) & (vload8(4, block) >= box.lower.y) &
         (vload8(2, block) <= box.upper.z) & (vload8(5, block) >= box.lower.z);
}

// Bit c: box number c of the block that begins at `place` overlaps this one.
static inline uint overlapBlock(__global const Aabb* boxes, uint place, Aabb box) {
  return maskOf8(overlaps8((__global const float*)(boxes + place), box));
}

// Bits that go with a box; meetBlock() is overlapBlock() of the boxes that have one of the bits `tags`.
static inline void storeTag(__global Aabb* boxes, uint place, uint tag) {
  ((__global uint*)(boxes + place / BVH_ARITY * BVH_ARITY))[6 * BVH_ARITY + place % BVH_ARITY] = tag;
}
static inline uint loadTag(__global const Aabb* boxes, uint place) {
  return ((__global const uint*)(boxes + place / BVH_ARITY * BVH_ARITY))[6 * BVH_ARITY + place % BVH_ARITY];
}
static inline uint meetBlock(__global const Aabb* boxes, uint place, Aabb box, uint tags) {
  __global const float* block = (__global const float*)(boxes + place);
  const int8 has = (vload8(6, (__global const int*)block) & (int8)(int)tags) != 0;
  return maskOf8(overlaps8(block, box) & has);
}

#else

static inline void storeBox(__global Aabb* boxes, uint place, Aabb box) { boxes[place] = box; }
static inline Aabb loadBox(__global const Aabb* boxes, uint place) { return boxes[place]; }

#endif

#endif
