// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs of bodies by a uniform grid, large bodies apart. A body lies in the cell of its AABB's lower corner. It is small
// if the cell of its upper corner is the same or the next one on each axis; since both corners are put into cells by
// the same monotonous function, two small bodies that overlap are then in the same cell or in neighbouring ones, whatever
// is rounded. All others are large and meet every body.
// Cells are numbered modulo a power of two, at least four, on each axis: far cells may share a number, neighbours don't.
#include "../lib/pair_list.h"
#include "../lib/sweep.h"

#define CLASS_SHIFT 21u          // four classes of sizes an octave
#define SIZE_CLASSES 1024u
#define LEAST_BITS 2u            // of an axis: its three neighbouring cells have different numbers
#define CELLS_ACROSS 1048576.0f  // the scene is at most so many cells wide, so that a cell's number is exact

// ---- how large a cell is -------------------------------------------------------------------------------------------

// Class c: the longest side of the AABB, as bits, is less than (c + 1) << CLASS_SHIFT. What takes no part is in
// the class behind all others.
KERNEL sizeClasses(uint bodyCount, __global const BodyInfo* infos, __global const Aabb* aabbs,
                   __global uint* classes) {
  FOR_EACH(i, bodyCount) {
    const float4 size = aabbs[i].upper - aabbs[i].lower;
    const float longest = fmax(fmax(size.x, size.y), fmax(size.z, 0.0f));
    classes[i] = isCollidable(infos[i]) ? as_uint(longest) >> CLASS_SHIFT : SIZE_CLASSES;
  }
}

// The axis that has most cells to a number.
static inline uint fullestAxis(float4 extent, __global const uint* bits) {
  float4 full = extent;
  full.x = ldexp(full.x, -(int)bits[0]);
  full.y = ldexp(full.y, -(int)bits[1]);
  full.z = ldexp(full.z, -(int)bits[2]);
  return full.x >= full.y && full.x >= full.z ? 0 : (full.y >= full.z ? 1 : 2);
}

// frame: xyz the scene's lower corner, w cells a length. bits[axis]: of a cell's number, cellBits together.
SINGLE_KERNEL chooseGrid(uint mostLarge, uint cellBits, __global const uint* histogram, __global const Aabb* scene,
                         __global float4* frame, __global uint* bits) {
  uint size = SIZE_CLASSES - 1, larger = 0;
  while (size > 0 && larger + histogram[size] <= mostLarge) larger += histogram[size--];
  float4 extent = scene->upper - scene->lower;
  const int empty = !(extent.x >= 0.0f);  // nothing but planes
  if (empty) extent = vec3(0.0f, 0.0f, 0.0f);
  const float widest = fmax(extent.x, fmax(extent.y, extent.z));
  // 2^100 is more than any world is wide; what is larger is large.
  const uint side = clamp((size + 1) << CLASS_SHIFT, as_uint(0x1p-100f), as_uint(0x1p100f));
  const float cell = fmax(as_float(side), widest / CELLS_ACROSS);
  *frame = withW(empty ? vec3(0.0f, 0.0f, 0.0f) : scene->lower, 1.0f / cell);
  for (uint axis = 0; axis < 3; ++axis) bits[axis] = LEAST_BITS;
  for (uint left = cellBits - 3 * LEAST_BITS; left > 0; --left) ++bits[fullestAxis(extent, bits)];
}

// ---- bodies in cells -----------------------------------------------------------------------------------------------

#define CELL_LIMIT 536870912.0f  // 2^29: beyond it all lie in the same cell; twice as much is an int

static inline int4 cellOf(float4 point, float4 frame) {
  const float4 cell = (xyz(point) - xyz(frame)) * frame.w;
  return convert_int4(floor(clamp(cell, -CELL_LIMIT, CELL_LIMIT)));
}

static inline uint cellNumber(int x, int y, int z, __global const uint* bits) {
  const uint mx = (uint)x & ((1u << bits[0]) - 1u), my = (uint)y & ((1u << bits[1]) - 1u),
             mz = (uint)z & ((1u << bits[2]) - 1u);
  return (((mz << bits[1]) | my) << bits[0]) | mx;
}

// Key: the number of the cell; cells for what is large, cells + 1 for what takes no part. inCell[key]: how many there are.
KERNEL gridKeys(uint bodyCount, uint cells, __global const BodyInfo* infos, __global const Aabb* aabbs,
                __global const float4* frame, __global const uint* bits, __global uint* keys, __global uint* order,
                volatile __global uint* inCell) {
  FOR_EACH(i, bodyCount) {
    const int4 lower = cellOf(aabbs[i].lower, *frame), over = cellOf(aabbs[i].upper, *frame) - lower;
    uint key = cells;
    if (over.x <= 1 && over.y <= 1 && over.z <= 1) key = cellNumber(lower.x, lower.y, lower.z, bits);
    if (!isCollidable(infos[i])) key = cells + 1;
    keys[i] = key;
    order[i] = i;
    atomic_inc(&inCell[key]);
  }
}

KERNEL gridBoxes(CHECKS uint bodyCount, __global const uint* order, __global const Aabb* aabbs,
                 __global Aabb* boxes) {
  FOR_EACH(p, bodyCount) storeBox(boxes, p, AT(aabbs, AT(order, p)));
}

// ---- pairs ---------------------------------------------------------------------------------------------------------

// cellFirst[key]: bodies with lower keys. A body meets those behind it in its own cell, and all of half the cells around:
// the next one in its row, and three of each of four other rows. Cells of a row lie together, but for the last and first.
KERNEL gridPairs(CHECKS uint bodyCount, uint cells, uint pairCapacity, __global const uint* cellFirst,
                 __global const float4* frame, __global const uint* bits, __global const BodyInfo* infos,
                 __global const Aabb* boxes, __global const uint* order, volatile __global uint* listed,
                 __global ulong* list) {
  const uint small = cellFirst[cells], across = 1u << bits[0];
  PairAppender found;
  beginPairs(&found, pairCapacity, listed, list);
  FOR_EACH(p, small) {
    const uint self = AT(order, p);
    const BodyInfo info = AT(infos, self);
    const Aabb box = loadBox(boxes, p);
    const int4 cell = cellOf(box.lower, *frame);
    for (int row = 0; row < 5; ++row) {
      const int y = row == 0 ? 0 : (row == 1 ? 1 : row - 3), z = row < 2 ? 0 : 1;
      const uint first = cellNumber(0, cell.y + y, cell.z + z, bits);
      const uint middle = (uint)cell.x & (across - 1u);
      const uint left = row == 0 ? middle : (middle - 1u) & (across - 1u), right = (middle + 1u) & (across - 1u);
      const uint from = row == 0 ? p + 1 : AT(cellFirst, first + left);
      if (left < right) {
        appendOverlaps(WITH_CHECKS &found, self, info, box, from, AT(cellFirst, first + right + 1), boxes, order,
                       infos);
      } else {
        appendOverlaps(WITH_CHECKS &found, self, info, box, from, AT(cellFirst, first + across), boxes, order, infos);
        appendOverlaps(WITH_CHECKS &found, self, info, box, AT(cellFirst, first), AT(cellFirst, first + right + 1),
                       boxes, order, infos);
      }
    }
  }
  flushPairs(&found);
}

// A large body meets all that are sorted before it: the small ones and other large ones. A unit of work is one of them
// and a piece of the others.
KERNEL largePairs(CHECKS uint bodyCount, uint cells, uint pairCapacity, __global const uint* cellFirst,
                  __global const BodyInfo* infos, __global const Aabb* boxes, __global const uint* order,
                  volatile __global uint* listed, __global ulong* list) {
  const uint small = cellFirst[cells], large = cellFirst[cells + 1] - small;
  const uint pieces = (small + large + PIECE - 1) / PIECE;
  PairAppender found;
  beginPairs(&found, pairCapacity, listed, list);
  FOR_EACH(u, large * pieces) {
    const uint p = small + u / pieces, from = u % pieces * PIECE;
    const uint self = AT(order, p);
    appendOverlaps(WITH_CHECKS &found, self, AT(infos, self), loadBox(boxes, p), from, min(p, from + PIECE), boxes,
                   order, infos);
  }
  flushPairs(&found);
}
