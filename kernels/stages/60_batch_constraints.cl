// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Two-level batching in place of colours (kernels/lib/batches.h): constraints into groups, then each group into batches
// by marking bodies as used. The result is that of the paper's serial pass, batch by batch, in a scattered order: the
// CPU body does just that; on the GPU all constraints of a group that still can be in a batch claim their bodies' cells
// in local memory, those that come first at both get in, and the others try again until nothing more fits.
#include "../lib/batches.h"
#include "../lib/group_scan.h"
#include "../lib/slots.h"

// Headers of all constraints, and how long each is (distanceBin).
KERNEL listConstraints(CHECKS uint constraintCapacity, __global const StepCounters* counters,
                       __global const uint* constraints, __global const Manifold* manifolds,
                       __global const BodyStep* steps, __global const BodyPose* poses, __global SlotHeader* headers,
                       __global uint* bins) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(c, itemCount(constraintCapacity, &counters->constraintCount)) {
    const SlotHeader h = headerOf(WITH_CHECKS AT(constraints, c), manifolds, steps);
    AT(headers, c) = h;
    AT(bins, c) = DISTANCE_NONE;
    if (hasFixedBody(h)) continue;
    AT(bins, c) = distanceBin(axisDistance(AT(poses, h.bodyA).position, AT(poses, h.bodyB).position));
  }
}

KERNEL assignGroups(CHECKS uint constraintCapacity, __global const StepCounters* counters, __global const uint* split,
                    __global const uint* histogram, __global const SlotHeader* headers, __global const BodyPose* poses,
                    __global uint* groups, __global uint* order) {
  RETURN_ON_OVERFLOW(counters);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount);
  const int inSpace = split[SPLIT_KIND] == SPLIT_BY_SPACE;
  const float scale = inSpace ? cellScale(longestBin(histogram)) : 0.0f;
  FOR_EACH(c, count) {
    const SlotHeader h = AT(headers, c);
    // A constraint that moves nothing may be anywhere.
    const uint a = h.bodyA != NO_INDEX ? h.bodyA : h.bodyB != NO_INDEX ? h.bodyB : 0;
    const uint b = h.bodyB != NO_INDEX ? h.bodyB : a;
    const Cell cellA = cellAt(AT(poses, a).position, scale), cellB = cellAt(AT(poses, b).position, scale);
    AT(groups, c) = inSpace ? groupInSpace(split, cellA, cellB, hasFixedBody(h)) : groupByIndex(split, a, b);
    AT(order, c) = c;
  }
}

static uint paddedBatch(uint size) { return (size + BATCH_BLOCK - 1) / BATCH_BLOCK * BATCH_BLOCK; }

// Which cells a constraint marks: those of its bodies that move.
STRUCT(Marks) { uint a, b; };

static Marks marksOf(SlotHeader h) {
  Marks m;
  m.a = h.bodyA != NO_INDEX ? markCell(h.bodyA) : NO_INDEX;
  m.b = h.bodyB != NO_INDEX ? markCell(h.bodyB) : NO_INDEX;
  return m;
}

// For each place in `order`: its batch in the group, BATCH_LIMIT for the serial batch, and its rank there. For each
// group: the sizes of its batches, and behind those of all groups its share of the serial batch.
#define BATCH_PARAMETERS                                                                                           \
  CHECKS __global StepCounters *counters, __global const uint *split, __global const uint *groupFirst,             \
      __global const uint *order, __global const SlotHeader *headers, __global uint *batches, __global uint *ranks, \
      __global uint *left, __global uint *sizes, __global uint *groupBatches

#ifdef BTGPU_SHAPE_CPU

// left[]: room for the places of constraints that are in no batch yet.
KERNEL batchGroups(BATCH_PARAMETERS) {
  RETURN_ON_OVERFLOW(counters);
  const uint groupCount = split[SPLIT_PHASES] * split[SPLIT_GROUPS];
  uint used[MARK_CELLS];
  FOR_EACH(group, groupCount) {
    const uint first = groupFirst[group], count = groupFirst[group + 1] - first;
    for (uint i = 0; i < MARK_CELLS; ++i) used[i] = 0;  // by which batch, from 1 on
    const uint bits = indexBits(max(count, 1u));
    uint open = 0;
    for (int fixed_ = 0; fixed_ < 2; ++fixed_) {  // those with a fixed body choose last
      for (uint p = 0; count && p <= lowMask(bits); ++p) {
        const uint i = unpermute(p, bits);
        if (i >= count || hasFixedBody(AT(headers, AT(order, first + i))) != fixed_) continue;
        AT(left, first + open) = first + i;
        ++open;
      }
    }
    uint batch = 0;
    for (; batch < BATCH_LIMIT && open > 0; ++batch) {
      const uint mark = batch + 1;
      uint kept = 0;
      for (uint k = 0; k < open; ++k) {
        const uint place = left[first + k];
        const Marks m = marksOf(AT(headers, AT(order, place)));
        if ((m.a != NO_INDEX && used[m.a] == mark) || (m.b != NO_INDEX && used[m.b] == mark)) {
          left[first + kept] = place;
          ++kept;
          continue;
        }
        if (m.a != NO_INDEX) used[m.a] = mark;
        if (m.b != NO_INDEX) used[m.b] = mark;
        AT(batches, place) = batch;
      }
      open = kept;
    }
    for (uint k = 0; k < open; ++k) AT(batches, left[first + k]) = BATCH_LIMIT;
    uint size[BATCH_LIMIT + 1];
    for (uint b = 0; b <= BATCH_LIMIT; ++b) size[b] = 0;
    for (uint place = first; place < first + count; ++place) {
      const uint b = batches[place];
      ranks[place] = size[b];
      size[b] += 1;
    }
    for (uint b = 0; b < BATCH_LIMIT; ++b) AT(sizes, group * BATCH_LIMIT + b) = paddedBatch(size[b]);
    AT(sizes, groupCount * BATCH_LIMIT + group) = size[BATCH_LIMIT];
    AT(groupBatches, group) = batch;
    atomic_max(&counters->colourCount, batch);
    if (size[BATCH_LIMIT]) atomic_add(&counters->serialCount, size[BATCH_LIMIT]);
  }
}

#else

#define CLAIM_NONE 0xffffffffu

static int isTaken(__local const uint* taken, uint cell) {
  return cell != NO_INDEX && (taken[cell / 32] >> cell % 32 & 1u);
}

static void takeCell(volatile __local uint* taken, uint cell) {
  if (cell != NO_INDEX) atomic_or(&taken[cell / 32], 1u << cell % 32);
}

static int owns(__local const uint* claims, uint cell, uint rank) { return cell == NO_INDEX || claims[cell] == rank; }

// A batch of the group: all constraints without one that can be together. One lane looks after the same places all the
// time.
static void gatherBatch(CHECKS uint first, uint count, uint batch, __global const uint* order,
                        __global const SlotHeader* headers, __global uint* batches, __local uint* claims,
                        __local uint* taken, __local uint* placed) {
  const uint lane = get_local_id(0), bits = indexBits(max(count, 1u));
  for (uint i = lane; i < MARK_CELLS / 32; i += GROUP_SIZE) taken[i] = 0;
  uint more = 1;
  while (more) {
    for (uint i = lane; i < MARK_CELLS; i += GROUP_SIZE) claims[i] = CLAIM_NONE;
    if (lane == 0) *placed = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint i = lane; i < count; i += GROUP_SIZE) {
      if (batches[first + i] != BATCH_NONE) continue;
      const SlotHeader h = AT(headers, AT(order, first + i));
      const Marks m = marksOf(h);
      if (isTaken(taken, m.a) || isTaken(taken, m.b)) continue;
      const uint rank = colourRank(i, bits, hasFixedBody(h));  // those with a fixed body choose last
      if (m.a != NO_INDEX) atomic_min(&claims[m.a], rank);
      if (m.b != NO_INDEX) atomic_min(&claims[m.b], rank);
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint i = lane; i < count; i += GROUP_SIZE) {
      if (batches[first + i] != BATCH_NONE) continue;
      const SlotHeader h = AT(headers, AT(order, first + i));
      const Marks m = marksOf(h);
      const uint rank = colourRank(i, bits, hasFixedBody(h));
      // What marks nothing has claimed nothing.
      if (!owns(claims, m.a, rank) || !owns(claims, m.b, rank)) continue;
      batches[first + i] = batch;
      takeCell(taken, m.a);
      takeCell(taken, m.b);
      atomic_inc(placed);
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    more = *placed;
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}

// Ranks of the group's constraints that are in the batch, in their order; returns how many there are.
static uint rankBatch(uint first, uint count, uint batch, __global const uint* batches, __global uint* ranks,
                      __local uint* scratch) {
  uint size = 0;
  for (uint tile = 0; tile < count; tile += GROUP_SIZE) {
    const uint i = tile + get_local_id(0);
    const uint mine = i < count && batches[first + i] == batch;
    uint total;
    const uint before = groupExclusiveScan(mine, scratch, &total);
    if (mine) ranks[first + i] = size + before;
    size += total;
  }
  return size;
}

KERNEL batchGroups(BATCH_PARAMETERS) {
  __local uint claims[MARK_CELLS];
  __local uint taken[MARK_CELLS / 32];
  __local uint scratch[GROUP_SIZE];
  __local uint placed;
  RETURN_ON_OVERFLOW(counters);
  const uint lane = get_local_id(0), groupCount = split[SPLIT_PHASES] * split[SPLIT_GROUPS];
  for (uint group = get_group_id(0); group < groupCount; group += get_num_groups(0)) {
    const uint first = groupFirst[group], count = groupFirst[group + 1] - first;
    for (uint i = lane; i < count; i += GROUP_SIZE) batches[first + i] = BATCH_NONE;
    uint open = count, batch = 0;
    for (; batch < BATCH_LIMIT && open > 0; ++batch) {
      gatherBatch(WITH_CHECKS first, count, batch, order, headers, batches, claims, taken, &placed);
      const uint size = rankBatch(first, count, batch, batches, ranks, scratch);
      if (lane == 0) AT(sizes, group * BATCH_LIMIT + batch) = paddedBatch(size);
      open -= size;
    }
    for (uint b = batch + lane; b < BATCH_LIMIT; b += GROUP_SIZE) AT(sizes, group * BATCH_LIMIT + b) = 0;
    barrier(CLK_GLOBAL_MEM_FENCE);
    if (lane == 0) {
      uint serial = 0;
      for (uint i = 0; serial < open && i < count; ++i) {
        if (batches[first + i] != BATCH_NONE) continue;
        batches[first + i] = BATCH_LIMIT;
        ranks[first + i] = serial;
        ++serial;
      }
      AT(sizes, groupCount * BATCH_LIMIT + group) = serial;
      AT(groupBatches, group) = batch;
      atomic_max(&counters->colourCount, batch);
      if (serial) atomic_add(&counters->serialCount, serial);
    }
  }
}

#endif

// Single work item: how many slots there are, and which are the serial batch's. batchFirst[]: where each batch begins,
// behind those of all groups their shares of the serial batch.
SINGLE_KERNEL beginBatches(uint slotCapacity, __global StepCounters* counters, __global const uint* split,
                           __global const uint* batchFirst, __global const uint* total, __global uint* slotFirst) {
  RETURN_ON_OVERFLOW(counters);
  const uint serial = batchFirst[split[SPLIT_PHASES] * split[SPLIT_GROUPS] * BATCH_LIMIT];
  slotFirst[0] = 0;
  for (uint c = 1; c <= COLOUR_SERIAL; ++c) slotFirst[c] = serial;
  slotFirst[COLOUR_SERIAL + 1] = total[0];
  counters->largeColours = counters->colourCount;  // each may get a launch of its own
  counters->slotCount = padded(total[0]);
  if (counters->slotCount > slotCapacity) counters->overflow |= OVERFLOW_SLOTS;
}

KERNEL clearSlots(CHECKS uint slotCapacity, __global const StepCounters* counters, __global SlotHeader* slots) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(s, itemCount(slotCapacity, &counters->slotCount)) fillSlot(WITH_CHECKS slots, s, emptySlot());
}

KERNEL fillBatches(CHECKS uint constraintCapacity, __global const StepCounters* counters, __global const uint* split,
                   __global const uint* groups, __global const uint* order, __global const uint* batches,
                   __global const uint* ranks, __global const uint* batchFirst, __global const SlotHeader* headers,
                   __global SlotHeader* slots) {
  RETURN_ON_OVERFLOW(counters);
  const uint serial = split[SPLIT_PHASES] * split[SPLIT_GROUPS] * BATCH_LIMIT;
  FOR_EACH(place, itemCount(constraintCapacity, &counters->constraintCount)) {
    const uint group = AT(groups, place), batch = AT(batches, place);
    const uint first = AT(batchFirst, batch < BATCH_LIMIT ? group * BATCH_LIMIT + batch : serial + group);
    fillSlot(WITH_CHECKS slots, first + AT(ranks, place), AT(headers, AT(order, place)));
  }
}
