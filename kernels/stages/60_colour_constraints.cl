// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Gives every constraint a colour so that no two of one colour move the same body, then lays the constraints out
// by colour. The result is that of one serial greedy pass in the order of colourRank: the CPU body does just that,
// the GPU body lets each constraint choose once it comes first among its uncoloured neighbours (Jones and
// Plassmann), which takes some rounds and gives the same colours. A constraint that finds all COLOUR_LIMIT colours
// taken goes to the serial batch. The colours are a pure function of the constraints.
#include "../lib/colour.h"
#include "../lib/group_scan.h"
#include "../lib/slots.h"
#ifdef BTGPU_SHAPE_GPU
#include "../lib/resident.h"
#endif

#define COLOUR_ROWS (COLOUR_LIMIT + 1)  // parallel colours and the serial batch

static ulong takenBy(CHECKS __global const ulong* bodyColours, uint body) {
  return body == NO_INDEX ? 0 : AT(bodyColours, body);
}
static uint chooseColour(ulong taken) { return freeColour((uint)taken, (uint)(taken >> 32)); }
static void take(CHECKS __global ulong* bodyColours, uint body, uint colour) {
  if (body == NO_INDEX || colour >= COLOUR_LIMIT) return;
  ASSERT(!(AT(bodyColours, body) >> colour & 1UL), body, colour);  // no body twice in a colour
  AT(bodyColours, body) |= 1UL << colour;
}

#ifdef BTGPU_SHAPE_CPU

KERNEL colourInit(CHECKS uint bodyCount, uint constraintCapacity, __global const StepCounters* counters,
                  __global const uint* constraints, __global const Manifold* manifolds, __global const BodyStep* steps,
                  __global ulong* bodyColours, __global SlotHeader* headers) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) bodyColours[i] = 0;
  FOR_EACH(c, itemCount(constraintCapacity, &counters->constraintCount)) {
    AT(headers, c) = headerOf(WITH_CHECKS AT(constraints, c), manifolds, steps);
  }
}

static uint colourNext(CHECKS SlotHeader h, __global ulong* bodyColours) {
  const uint colour =
      chooseColour(takenBy(WITH_CHECKS bodyColours, h.bodyA) | takenBy(WITH_CHECKS bodyColours, h.bodyB));
  take(WITH_CHECKS bodyColours, h.bodyA, colour);
  take(WITH_CHECKS bodyColours, h.bodyB, colour);
  return colour;
}

// Single work item: colours all constraints, then writes their headers in slot order; lanes without a constraint get an
// empty one. fixed[]: room for the indices of constraints that have to wait.
SINGLE_KERNEL colourGreedy(CHECKS uint constraintCapacity, uint slotCapacity, __global StepCounters* counters,
                           __global const SlotHeader* headers, __global ulong* bodyColours, __global uint* fixed_,
                           __global uint* colours, __global uint* slotFirst, __global SlotHeader* slots) {
  RETURN_ON_OVERFLOW(counters);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount);
  uint sizes[COLOUR_ROWS];
  for (uint c = 0; c < COLOUR_ROWS; ++c) sizes[c] = 0;
  uint waiting = 0;
  const uint bits = indexBits(max(count, 1u));
  for (uint p = 0; count && p <= lowMask(bits); ++p) {
    const uint c = unpermute(p, bits);
    if (c >= count) continue;
    const SlotHeader h = headers[c];
    if (hasFixedBody(h)) {
      AT(fixed_, waiting) = c;
      ++waiting;
      continue;
    }
    const uint colour = colourNext(WITH_CHECKS h, bodyColours);
    colours[c] = colour;
    sizes[colour] += 1;
  }
  for (uint k = 0; k < waiting; ++k) {
    const uint c = fixed_[k], colour = colourNext(WITH_CHECKS headers[c], bodyColours);
    colours[c] = colour;
    sizes[colour] += 1;
  }

  uint next[COLOUR_ROWS];
  uint slotCount = 0, used = 0, large = 0;
  for (uint c = 0; c < COLOUR_ROWS; ++c) {
    next[c] = AT(slotFirst, c) = slotCount;
    slotCount += padded(sizes[c]);
    if (sizes[c] && c < COLOUR_SERIAL) used = c + 1;
    if (sizes[c] > SMALL_COLOUR && c < COLOUR_SERIAL) large = c + 1;
  }
  AT(slotFirst, COLOUR_ROWS) = slotCount;
  counters->colourCount = used;
  counters->largeColours = large;
  counters->serialCount = sizes[COLOUR_SERIAL];
  counters->slotCount = slotCount;
  if (slotCount > slotCapacity) {
    counters->overflow |= OVERFLOW_SLOTS;
    return;
  }
  for (uint c = 0; c < count; ++c) {
    fillSlot(WITH_CHECKS slots, next[colours[c]], headers[c]);
    next[colours[c]] += 1;
  }
  for (uint c = 0; c < COLOUR_ROWS; ++c) {
    for (uint s = next[c]; s < slotFirst[c + 1]; ++s) fillSlot(WITH_CHECKS slots, s, emptySlot());
  }
}

#else

// A body's claim: the lowest rank of its uncoloured constraints (from 1 on), NO_INDEX if there is none, or:
#define CLAIM_FULL 0u  // all colours are taken

KERNEL colourInit(CHECKS uint bodyCount, uint constraintCapacity, uint rounds, __global const StepCounters* counters,
                  __global const uint* constraints, __global const Manifold* manifolds, __global const BodyStep* steps,
                  __global ulong* bodyColours, __global uint* claims, __global uint* nextClaims,
                  __global uint* laterClaims, __global uint* left, __global SlotHeader* headers,
                  __global uint* colours) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    bodyColours[i] = 0;
    claims[i] = nextClaims[i] = laterClaims[i] = NO_INDEX;
  }
  FOR_EACH(r, rounds) left[r] = 0;
  FOR_EACH(c, itemCount(constraintCapacity, &counters->constraintCount)) {
    AT(headers, c) = headerOf(WITH_CHECKS AT(constraints, c), manifolds, steps);
    AT(colours, c) = COLOUR_NONE;
  }
}

static void claim(CHECKS volatile __global uint* nextClaims, volatile __global uint* laterClaims, uint body,
                  uint rank) {
  if (body == NO_INDEX) return;
  atomic_xchg(&AT(laterClaims, body), NO_INDEX);
  atomic_min(&AT(nextClaims, body), rank);
}

static void takeOrFill(CHECKS __global ulong* bodyColours, volatile __global uint* nextClaims, uint body,
                       uint colour) {
  take(WITH_CHECKS bodyColours, body, colour);
  if (body != NO_INDEX && AT(bodyColours, body) == 0xffffffffffffffffUL) atomic_min(&AT(nextClaims, body), CLAIM_FULL);
}

// What an uncoloured constraint does in a round: if it has the lowest rank at all its bodies, it chooses. If one of them
// is full, no turn is needed, since colours are never given back. Otherwise it claims its bodies for the next round, and
// makes the claims of the round after that ready. Returns whether it is left uncoloured.
static uint chooseOrClaim(CHECKS uint c, uint bodyA, uint bodyB, uint rank, volatile __global const uint* claims,
                          volatile __global uint* nextClaims, volatile __global uint* laterClaims,
                          __global ulong* bodyColours, __global uint* colours) {
  const uint firstA = bodyA == NO_INDEX ? rank : AT(claims, bodyA);
  const uint firstB = bodyB == NO_INDEX ? rank : AT(claims, bodyB);
  if (firstA == CLAIM_FULL || firstB == CLAIM_FULL) {
    AT(colours, c) = COLOUR_SERIAL;
    return 0;
  }
  if (firstA != rank || firstB != rank) {
    claim(WITH_CHECKS nextClaims, laterClaims, bodyA, rank);
    claim(WITH_CHECKS nextClaims, laterClaims, bodyB, rank);
    return 1;
  }
  const uint colour =
      chooseColour(takenBy(WITH_CHECKS bodyColours, bodyA) | takenBy(WITH_CHECKS bodyColours, bodyB));
  takeOrFill(WITH_CHECKS bodyColours, nextClaims, bodyA, colour);
  takeOrFill(WITH_CHECKS bodyColours, nextClaims, bodyB, colour);
  AT(colours, c) = colour;
  return 0;
}

static uint rankOf(uint c, uint bits, SlotHeader h) { return 1 + colourRank(c, bits, hasFixedBody(h)); }

// One round; the first one has no claims to look at yet. left[round]: constraints uncoloured after it.
KERNEL colourRound(CHECKS uint round, uint constraintCapacity, __global const StepCounters* counters,
                   __global const SlotHeader* headers, __global const uint* claims, __global uint* nextClaims,
                   __global uint* laterClaims, __global ulong* bodyColours, __global uint* colours,
                   __global uint* left) {
  __local uint groupLeft;
  RETURN_ON_OVERFLOW(counters);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount);
  const uint bits = indexBits(max(count, 1u));
  if (get_local_id(0) == 0) groupLeft = 0;
  barrier(CLK_LOCAL_MEM_FENCE);
  uint mine = 0;
  FOR_EACH(c, count) {
    if (colours[c] != COLOUR_NONE) continue;
    const SlotHeader h = headers[c];
    mine += chooseOrClaim(WITH_CHECKS c, h.bodyA, h.bodyB, rankOf(c, bits, h), claims, nextClaims, laterClaims,
                          bodyColours, colours);
  }
  if (mine) atomic_add(&groupLeft, mine);
  barrier(CLK_LOCAL_MEM_FENCE);
  if (get_local_id(0) == 0 && groupLeft) atomic_add(&left[round], groupLeft);
}

#ifndef REST_LANES
#define REST_LANES 256
#endif
#define REST_EACH 4  // constraints a lane that need no look at all the others any more
#define REST (REST_LANES * REST_EACH)

// Sum over the lanes of the group; ends with a barrier for global memory too.
static uint sumOfRest(uint mine, __local uint* sum) {
  if (get_local_id(0) == 0) *sum = 0;
  barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
  if (mine) atomic_add(sum, mine);
  barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
  const uint all = *sum;
  barrier(CLK_LOCAL_MEM_FENCE | CLK_GLOBAL_MEM_FENCE);
  return all;
}

// One group does all further rounds, however many there are, since few constraints are left for a launch each.
// counters->colourRounds: the rounds that were worth a launch.
KERNEL_OF(REST_LANES) colourRest(
    CHECKS uint rounds, uint constraintCapacity, __global StepCounters* counters, __global const SlotHeader* headers,
    __global const uint* left, __global uint* claims, __global uint* nextClaims, __global uint* laterClaims,
    __global ulong* bodyColours, __global uint* colours) {
  __local uint list[REST];
  __local uint sum;
  RETURN_ON_OVERFLOW(counters);
  const uint lane = get_local_id(0);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount);
  const uint bits = indexBits(max(count, 1u));
  uint worth = 0, open = count;
  while (worth < rounds && open > REST) {
    open = left[worth];
    ++worth;
  }
  volatile __global uint *now = claims, *next = nextClaims, *later = laterClaims;
  while (open > REST) {
    uint mine = 0;
    for (uint c = lane; c < count; c += REST_LANES) {
      if (colours[c] != COLOUR_NONE) continue;
      const SlotHeader h = headers[c];
      mine += chooseOrClaim(WITH_CHECKS c, h.bodyA, h.bodyB, rankOf(c, bits, h), now, next, later, bodyColours, colours);
    }
    open = sumOfRest(mine, &sum);
    ++worth;
    volatile __global uint* const old = now;
    now = next;
    next = later;
    later = old;
  }
  if (lane == 0) counters->colourRounds = worth;

  if (lane == 0) sum = 0;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint c = lane; c < count; c += REST_LANES) {
    if (colours[c] == COLOUR_NONE) list[atomic_inc(&sum)] = c;
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  open = sum;
  barrier(CLK_LOCAL_MEM_FENCE);
  uint own[REST_EACH], bodyA[REST_EACH], bodyB[REST_EACH], rank[REST_EACH];  // rank 0: coloured, or none
  for (uint k = 0; k < REST_EACH; ++k) {
    rank[k] = own[k] = bodyA[k] = bodyB[k] = 0;
    if (lane + k * REST_LANES >= open) continue;
    own[k] = list[lane + k * REST_LANES];
    const SlotHeader h = headers[own[k]];
    bodyA[k] = h.bodyA;
    bodyB[k] = h.bodyB;
    rank[k] = rankOf(own[k], bits, h);
  }
  while (open > 0) {
    uint mine = 0;
    for (uint k = 0; k < REST_EACH; ++k) {
      if (rank[k] == 0) continue;
      if (chooseOrClaim(WITH_CHECKS own[k], bodyA[k], bodyB[k], rank[k], now, next, later, bodyColours, colours)) {
        ++mine;
      } else {
        rank[k] = 0;
      }
    }
    open = sumOfRest(mine, &sum);
    volatile __global uint* const old = now;
    now = next;
    next = later;
    later = old;
  }
}

// What a group keeps of the constraints that it has in sight: indices of those that are left, in two lists in turn.
STRUCT(OpenList) {
  __local uint* now;
  __local uint* next;
  __local uint* count;  // of `next`
};

// All rounds in one launch, in groups that wait for each other between them (../lib/resident.h). Each has a chunk of the
// constraints in sight, and lists those that are left as soon as they fit. left[]: three words in turn, zero before; how
// many are left after a round.
KERNEL_OF(RESIDENT_GROUP)
colourResident(CHECKS uint constraintCapacity, __global StepCounters* counters, __global const SlotHeader* headers,
               __global uint* claims, __global uint* nextClaims, __global uint* laterClaims,
               __global ulong* bodyColours, __global uint* colours, volatile __global uint* left,
               __global uint* team) {
  __local uint lists[2][COLOUR_LIST];
  __local uint state, kept, all;
  Resident r;
  const int complete = callRoll(&r, team, counters, &state);
  const uint lane = get_local_id(0), group = get_group_id(0);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount);
  const uint bits = indexBits(max(count, 1u));
  const uint first = CHUNK_BEGIN(count, group, get_num_groups(0));
  uint mine = CHUNK_BEGIN(count, group + 1, get_num_groups(0)) - first, worth = 0;
  uint open = complete && !counters->overflow ? count : 0;
  int listed = 0;
  OpenList list = {lists[0], lists[1], &kept};
  volatile __global uint *now = claims, *next = nextClaims, *later = laterClaims;
  for (uint round = 0; open > 0; ++round) {
    if (open > REST) ++worth;
    if (lane == 0) kept = 0;
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint k = lane; k < mine; k += RESIDENT_GROUP) {
      const uint c = listed ? list.now[k] : first + k;
      if (!listed && colours[c] != COLOUR_NONE) continue;
      const SlotHeader h = headers[c];
      if (!chooseOrClaim(WITH_CHECKS c, h.bodyA, h.bodyB, rankOf(c, bits, h), now, next, later, bodyColours, colours)) {
        continue;
      }
      const uint place = atomic_inc(&kept);
      if (place < COLOUR_LIST) list.next[place] = c;
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    const uint rest = kept;
    if (lane == 0 && rest) atomic_add(left + round % 3, rest);
    if (lane == 0 && group == 0) atomic_xchg(left + (round + 1) % 3, 0);
    arrive(&r);
    if (rest <= COLOUR_LIST) {
      mine = rest;
      listed = 1;
      __local uint* const old = list.now;
      list.now = list.next;
      list.next = old;
    }
    volatile __global uint* const done = now;
    now = next;
    next = later;
    later = done;
    awaitOthers(&r);
    if (lane == 0) all = left[round % 3];
    barrier(CLK_LOCAL_MEM_FENCE);
    open = all;
  }
  if (lane == 0 && group == 0 && complete) counters->colourRounds = worth;
  leaveResident(&r);
}

// ---- slots: a stable counting sort by colour ---------------------------------------------------------------------

// tables[colour][group] = how many constraints of the group's chunk have that colour.
KERNEL countColours(uint constraintCapacity, __global const StepCounters* counters, __global const uint* colours,
                    __global uint* tables) {
  __local uint sizes[COLOUR_ROWS];
  RETURN_ON_OVERFLOW(counters);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount);
  const uint groups = get_num_groups(0), group = get_group_id(0), lane = get_local_id(0);
  for (uint d = lane; d < COLOUR_ROWS; d += GROUP_SIZE) sizes[d] = 0;
  barrier(CLK_LOCAL_MEM_FENCE);
  const uint end = CHUNK_BEGIN(count, group + 1, groups);
  for (uint c = CHUNK_BEGIN(count, group, groups) + lane; c < end; c += GROUP_SIZE) atomic_inc(&sizes[colours[c]]);
  barrier(CLK_LOCAL_MEM_FENCE);
  for (uint d = lane; d < COLOUR_ROWS; d += GROUP_SIZE) tables[d * groups + group] = sizes[d];
}

#define LANE_ITEMS 16

// Headers in slot order; lanes without a constraint get an empty one. Where the colours begin everybody finds by
// himself; the first group writes it down. tables[colour][group] = constraints of that colour in chunks before the
// group's, totals[colour] = in all.
KERNEL fillSlots(CHECKS uint constraintCapacity, uint slotCapacity, __global StepCounters* counters,
                 __global const SlotHeader* headers, __global const uint* colours, __global const uint* tables,
                 __global const uint* totals, __global uint* slotFirst, __global SlotHeader* slots) {
  __local ushort ranks[COLOUR_ROWS * GROUP_SIZE];  // [row][lane]: first a count, then the rank of the lane's next one
  __local uint scratch[GROUP_SIZE];
  __local uint first[COLOUR_ROWS + 1];  // slots of the colours
  __local uint next[COLOUR_ROWS];       // where the tile's first constraint of a row goes
  __local uint tileEnd[COLOUR_ROWS];    // rank behind the tile's last constraint of a row
  __local uint used, large, stop[1];
  const uint groups = get_num_groups(0), group = get_group_id(0), lane = get_local_id(0);
  if (lane == 0) {
    stop[0] = counters->overflow;  // the first group may write it meanwhile
    used = large = 0;
  }
  barrier(CLK_LOCAL_MEM_FENCE);
  if (stop[0]) return;
  const uint count = itemCount(constraintCapacity, &counters->constraintCount);
  const uint size = lane < COLOUR_ROWS ? totals[lane] : 0;
  uint slotCount;
  const uint before = groupExclusiveScan(padded(size), scratch, &slotCount);
  if (lane <= COLOUR_ROWS) first[lane] = before;
  if (lane < COLOUR_SERIAL && size) atomic_max(&used, lane + 1);
  if (lane < COLOUR_SERIAL && size > SMALL_COLOUR) atomic_max(&large, lane + 1);
  barrier(CLK_LOCAL_MEM_FENCE);
  if (group == 0) {
    if (lane <= COLOUR_ROWS) AT(slotFirst, lane) = first[lane];
    if (lane == 0) {
      counters->colourCount = used;
      counters->largeColours = large;
      counters->serialCount = totals[COLOUR_SERIAL];
      counters->slotCount = slotCount;
      if (slotCount > slotCapacity) counters->overflow |= OVERFLOW_SLOTS;
    }
  }
  if (slotCount > slotCapacity) return;
  for (uint d = group; d < COLOUR_ROWS; d += groups) {
    for (uint s = first[d] + totals[d] + lane; s < first[d + 1]; s += GROUP_SIZE) fillSlot(WITH_CHECKS slots, s, emptySlot());
  }

  // The serial batch takes the row behind the colours in use, so that rows are few.
  const uint rows = used + 1;
  if (lane < rows) {
    const uint colour = lane < used ? lane : COLOUR_SERIAL;
    next[lane] = first[colour] + tables[colour * groups + group];
  }
  const uint begin = CHUNK_BEGIN(count, group, groups), end = CHUNK_BEGIN(count, group + 1, groups);
  const uint laneItems = min((uint)LANE_ITEMS, (end - begin + GROUP_SIZE - 1) / GROUP_SIZE);
  for (uint tile = begin; tile < end; tile += laneItems * GROUP_SIZE) {
    const uint mine = min(end, tile + lane * laneItems), last = min(end, mine + laneItems);
    for (uint r = 0; r < rows; ++r) ranks[r * GROUP_SIZE + lane] = 0;
    for (uint c = mine; c < last; ++c) ranks[min(colours[c], used) * GROUP_SIZE + lane] += 1;
    barrier(CLK_LOCAL_MEM_FENCE);
    uint sum = 0;
    for (uint k = 0; k < rows; ++k) sum += ranks[lane * rows + k];
    uint total;
    uint rank = groupExclusiveScan(sum, scratch, &total);
    for (uint k = 0; k < rows; ++k) {
      const uint n = ranks[lane * rows + k];
      ranks[lane * rows + k] = (ushort)rank;
      rank += n;
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    // Ranks count from the tile's start; a row's own start is the rank of its lane 0.
    if (lane < rows) {
      tileEnd[lane] = lane + 1 < rows ? ranks[(lane + 1) * GROUP_SIZE] : total;
      next[lane] -= ranks[lane * GROUP_SIZE];
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    for (uint c = mine; c < last; ++c) {
      const uint row = min(colours[c], used);
      fillSlot(WITH_CHECKS slots, next[row] + ranks[row * GROUP_SIZE + lane], headers[c]);
      ranks[row * GROUP_SIZE + lane] += 1;
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    if (lane < rows) next[lane] += tileEnd[lane];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
}

#endif
