// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The paper's two-level batching. Constraints are split into groups, and groups into phases, so that no two groups of a
// phase move the same body; a group's constraints are split into batches, so that no two of a batch do. A group is a
// number: phase * groups a phase + place.
#ifndef BTGPU_LIB_BATCHES_H
#define BTGPU_LIB_BATCHES_H
#include "../shared/rows.h"
#include "colour.h"

BTGPU_BEGIN

#define BATCH_LIMIT 64   // batches of a group; what needs more goes to the serial batch
#define BATCH_BLOCK 16   // slots; a batch begins with a whole block, which the CPU shape solves at once (BTGPU_WIDE)
#define BATCH_NONE 0xffffffffu
#define MARK_BITS 10
#define MARK_CELLS (1 << MARK_BITS)  // where a group marks bodies as used; those of one cell keep each other apart

// How constraints are split into groups; the host's choice, as an array of uints.
#define SPLIT_KIND 0    // SPLIT_BY_SPACE or SPLIT_BY_INDEX
#define SPLIT_PHASES 1
#define SPLIT_GROUPS 2  // a phase
#define SPLIT_BITS_X 3  // by space: 2 << bits cells along each axis, then they come again
#define SPLIT_BITS_Y 4
#define SPLIT_BITS_Z 5
#define BATCH_SPLIT_SIZE 6
#define SPLIT_BY_SPACE 0u
#define SPLIT_BY_INDEX 1u

// ---- by space: a grid of cells. A constraint between bodies in cells at most one apart belongs to the lower cell of
// the two along each axis, m, and so moves bodies in m + {0, 1}^3 only. Two such blocks of eight cells are apart if
// their m have the same parities and differ: the eight parities are the phases. Cells that are a whole number of periods
// apart are one group, which takes nothing from that, since periods are even. Constraints over longer distances are a
// ninth phase, of one group. Those that move but one body come last, as in docs/decisions/0006-order-of-colours.md: a
// phase whose groups are cells.

#define SPACE_LONG 8
#define SPACE_SINGLE 9
#define SPACE_PHASES 10
#define DISTANCE_BINS 256  // exponents of floats
// Cells are as large as all but this share of the constraints are long.
#define LONG_SHARE 64

#define DISTANCE_NONE DISTANCE_BINS  // of a constraint that moves but one body

// Bin of a distance, not negative: the exponent of the float. All of a bin are less than 2^(bin - 126).
LIB uint distanceBin(float distance) { return as_uint(distance) >> 23; }
// Of cells whose side is 2^(bin - 126).
LIB float cellScale(uint bin) { return as_float((253u - (bin < 252u ? bin : 252u)) << 23); }

// The lowest bin that no more than a LONG_SHARE-th of the constraints is beyond; that of cells of 1 if there are none.
LIB uint longestBin(const __global uint* histogram) {
  uint total = 0, beyond = 0, bin = DISTANCE_BINS - 1;
  for (uint i = 0; i < DISTANCE_BINS; ++i) total += histogram[i];
  if (total == 0) return 126;
  while (bin > 0 && beyond + histogram[bin] <= total / LONG_SHARE) {
    beyond += histogram[bin];
    --bin;
  }
  return bin;
}

// The largest of the distances along the axes. What is no number is far.
LIB float axisDistance(float4 a, float4 b) {
  const float x = fabs(a.x - b.x), y = fabs(a.y - b.y), z = fabs(a.z - b.z);
  const float most = x < y ? (y < z ? z : y) : (x < z ? z : x);
  return x + y + z < INFINITY ? most : INFINITY;
}

LIB int cellOf(float position, float scale) {
  const float place = floor(position * scale);
  if (!(place > -1073741824.0f)) return -1073741824;
  return place < 1073741824.0f ? (int)place : 1073741824;
}

STRUCT(Cell) { int x, y, z; };

LIB Cell cellAt(float4 position, float scale) {
  Cell c;
  c.x = cellOf(position.x, scale);
  c.y = cellOf(position.y, scale);
  c.z = cellOf(position.z, scale);
  return c;
}

LIB int isNear(int a, int b) { return a - b <= 1 && b - a <= 1; }

// Of a constraint that moves a single body, both cells are that body's.
LIB uint groupInSpace(const __global uint* split, Cell a, Cell b, int single) {
  if (!isNear(a.x, b.x) || !isNear(a.y, b.y) || !isNear(a.z, b.z)) return SPACE_LONG * split[SPLIT_GROUPS];
  const uint x = (uint)(a.x < b.x ? a.x : b.x), y = (uint)(a.y < b.y ? a.y : b.y), z = (uint)(a.z < b.z ? a.z : b.z);
  const uint phase = single ? SPACE_SINGLE : (x & 1u) | (y & 1u) << 1 | (z & 1u) << 2;
  const uint bitsX = split[SPLIT_BITS_X], bitsY = split[SPLIT_BITS_Y], bitsZ = split[SPLIT_BITS_Z];
  const uint place = (x >> 1 & lowMask(bitsX)) | (y >> 1 & lowMask(bitsY)) << bitsX |
                     (z >> 1 & lowMask(bitsZ)) << (bitsX + bitsY);
  return phase * split[SPLIT_GROUPS] + place;
}

// ---- by index: bodies with the same lowest n bits are together, 2^n sets. Phase p pairs the sets i and i ^ p: a table
// of interactions in which each set is once in each phase. The sets with themselves, and so all constraints that move but
// one body, come last.

LIB uint groupByIndex(const __global uint* split, uint bodyA, uint bodyB) {
  const uint sets = split[SPLIT_GROUPS];
  const uint a = bodyA & (sets - 1), b = bodyB & (sets - 1);
  return (sets - 1 - (a ^ b)) * sets + (a < b ? a : b);
}

// ---- batches

// Bodies of a group may have their low bits in common.
LIB uint markCell(uint body) { return body * PERMUTE_A >> (32 - MARK_BITS); }

BTGPU_END
#endif
