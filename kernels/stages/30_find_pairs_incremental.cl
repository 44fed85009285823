// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Pairs of bodies by an incremental sweep along three axes: the pairs of the last step, less those that came apart, and
// those that came together. On each axis the ends of all intervals are sorted anew, and the order of the last step is
// kept. Two intervals begin or cease to overlap when the upper end of one and the lower end of the other change places;
// so each end goes, in the old order and in the new one, over what lies between its old place and its new one (the
// paper's way to make the swaps of an incremental sweep read-only).
// This is for bodies that stay: those that took part in the last step with the same filters, and whose AABBs overlap
// those that they had. All others are fresh: a sweep along one axis finds their pairs. With nothing known of a last
// step, all are. Ends are ranked among those of bodies that stay, so that nobody is moved by what comes and goes.
// An end is 2 * body for the lower and 2 * body + 1 for the upper one. Where values are equal lower ends come first,
// so that of two intervals that touch the order says that they overlap.
#include "../lib/pair_list.h"
#include "../lib/sweep.h"

#define ABSENT 0u
#define STAYS 1u
#define FRESH 2u

// ---- who stays -----------------------------------------------------------------------------------------------------

KERNEL bodyKinds(uint bodyCount, uint oldCount, __global const uint* known, __global const BodyInfo* infos,
                 __global const Aabb* aabbs, __global const BodyInfo* oldInfos, __global const Aabb* oldAabbs,
                 __global uint* kinds) {
  FOR_EACH(i, max(bodyCount, oldCount)) {
    uint kind = ABSENT;
    if (i < bodyCount && isCollidable(infos[i])) {
      kind = FRESH;
      if (*known && i < oldCount && sameFilter(infos[i], oldInfos[i]) && overlapAabb(aabbs[i], oldAabbs[i])) {
        kind = STAYS;
      }
    }
    kinds[i] = kind;
  }
}

// ---- ends in order -------------------------------------------------------------------------------------------------

// All lower ends come first, and the sort is stable. What takes no part sorts last.
KERNEL endKeys(uint bodyCount, uint axis, __global const BodyInfo* infos, __global const Aabb* aabbs,
               __global uint* keys, __global uint* order) {
  FOR_EACH(k, 2 * bodyCount) {
    const uint upper = k >= bodyCount, i = upper ? k - bodyCount : k;
    const Aabb box = aabbs[i];
    keys[k] = isCollidable(infos[i]) ? floatKey(component(upper ? box.upper : box.lower, (int)axis)) : NO_INDEX;
    order[k] = 2 * i + upper;
  }
}

KERNEL stayingEnds(CHECKS uint ends, __global const uint* order, __global const uint* kinds, __global uint* flags) {
  FOR_EACH(p, ends) flags[p] = AT(kinds, order[p] / 2) == STAYS;
}

// ranks[end], and the other way round ranked[rank], among the ends of bodies that stay.
KERNEL rankEnds(CHECKS uint ends, __global const uint* order, __global const uint* flags,
                __global const uint* offsets, __global uint* ranks, __global uint* ranked) {
  FOR_EACH(p, ends) {
    if (!flags[p]) continue;
    AT(ranks, order[p]) = offsets[p];
    AT(ranked, offsets[p]) = order[p];
  }
}

// ---- pairs that came or went ---------------------------------------------------------------------------------------

// Ranks and AABBs, then and now.
typedef struct Motion {
  uint axis;
  __global const uint* oldRanks;
  __global const uint* ranks;
  __global const Aabb* oldAabbs;
  __global const Aabb* aabbs;
} Motion;

static inline int apartOn(uint axis, Aabb a, Aabb b) {
  return component(a.lower, (int)axis) > component(b.upper, (int)axis) ||
         component(b.lower, (int)axis) > component(a.upper, (int)axis);
}

// Whether `end`, on its way through the old or the new order, comes by `other`.
static inline int comesBy(const Motion* m, uint end, uint other, uint inNew) {
  const uint was = m->oldRanks[end], is = m->ranks[end];
  const uint place = inNew ? m->ranks[other] : m->oldRanks[other];
  return place >= min(was, is) && place <= max(was, is);
}

// `end` came by `other`. A pair that came or went is seen several times: on up to three axes, by both ends, in both
// orders. It counts once: on the first axis on which the two were (or are) apart, and there by the upper end in the old
// order if that sees it, else by it in the new order, else by the lower end in the old order. (If the upper end sees the
// lower one in neither, that one has moved past both places of the upper one and sees it in both.)
// Returns 1 for a pair that came, 2 for one that went, else 0.
static inline uint changeSeen(const Motion* m, uint end, uint other, uint inNew) {
  const uint i = end / 2, j = other / 2;
  if (i == j || end % 2 == other % 2) return 0;
  const uint upper = end % 2 ? end : other, lower = end % 2 ? other : end;
  const int held = m->oldRanks[lower] < m->oldRanks[upper], holds = m->ranks[lower] < m->ranks[upper];
  if (held == holds) return 0;
  const Aabb oldA = m->oldAabbs[i], oldB = m->oldAabbs[j], a = m->aabbs[i], b = m->aabbs[j];
  const int overlapped = overlapAabb(oldA, oldB), overlaps = overlapAabb(a, b);
  if (overlapped == overlaps) return 0;
  for (uint axis = 0; axis < m->axis; ++axis) {
    if (overlaps ? apartOn(axis, oldA, oldB) : apartOn(axis, a, b)) return 0;
  }
  // An AABB may be empty, lower beyond upper; then both upper ends may lie below both lower ones.
  const uint owner = upper / 2, mate = lower / 2;
  if (owner > mate) {
    __global const Aabb* apart = overlaps ? m->oldAabbs : m->aabbs;
    if (component(apart[mate].upper, (int)m->axis) < component(apart[owner].lower, (int)m->axis)) return 0;
  }
  int mine;
  if (comesBy(m, upper, lower, 0)) {
    mine = end == upper && !inNew;
  } else if (comesBy(m, upper, lower, 1)) {
    mine = end == upper && inNew;
  } else {
    mine = end == lower && !inNew;
  }
  return mine ? (overlaps ? 1 : 2) : 0;
}

KERNEL clearGone(__global const uint* oldPairCount, __global uint* gone) { FOR_EACH(k, *oldPairCount) gone[k] = 0; }

// Marks a pair of the last step. One that the filters kept apart is not among them.
static inline void markGone(ulong key, uint oldPairs, __global const ulong* oldKeys, __global uint* gone) {
  uint first = 0, last = oldPairs;
  while (first < last) {
    const uint middle = first + (last - first) / 2;
    if (oldKeys[middle] < key) {
      first = middle + 1;
    } else {
      last = middle;
    }
  }
  if (first < oldPairs && oldKeys[first] == key) gone[first] = 1;
}

KERNEL changedPairs(CHECKS uint bodyCount, uint axis, uint pairCapacity, __global const uint* kinds,
                    __global const uint* oldRanks, __global const uint* ranks, __global const uint* oldRanked,
                    __global const uint* ranked, __global const BodyInfo* infos, __global const Aabb* oldAabbs,
                    __global const Aabb* aabbs, __global const uint* oldPairCount, __global const ulong* oldKeys,
                    __global uint* gone, volatile __global uint* listed, __global ulong* list) {
  PairAppender came;
  beginPairs(&came, pairCapacity, listed, list);
  Motion m;
  m.axis = axis;
  m.oldRanks = oldRanks;
  m.ranks = ranks;
  m.oldAabbs = oldAabbs;
  m.aabbs = aabbs;
  const uint oldPairs = *oldPairCount;
  FOR_EACH(end, 2 * bodyCount) {
    if (kinds[end / 2] != STAYS || oldRanks[end] == ranks[end]) continue;
    const uint from = min(oldRanks[end], ranks[end]), to = max(oldRanks[end], ranks[end]);
    for (uint inNew = 0; inNew < 2; ++inNew) {
      __global const uint* passed = inNew ? ranked : oldRanked;
      for (uint place = from; place <= to; ++place) {
        const uint other = passed[place], change = changeSeen(&m, end, other, inNew);
        if (change == 2) markGone(pairKeyOf(end / 2, other / 2), oldPairs, oldKeys, gone);
        if (change == 1 && mayMeet(WITH_CHECKS end / 2, AT(infos, end / 2), other / 2, infos)) {
          appendPair(&came, end / 2, other / 2);
        }
      }
    }
  }
  flushPairs(&came);
}

// Of the last step's pairs those that are still there.
KERNEL keptPairs(CHECKS uint pairCapacity, __global const uint* oldPairCount, __global const ulong* oldKeys,
                 __global const uint* gone, __global const uint* kinds, volatile __global uint* listed,
                 __global ulong* list) {
  PairAppender kept;
  beginPairs(&kept, pairCapacity, listed, list);
  FOR_EACH(k, *oldPairCount) {
    const uint a = (uint)(oldKeys[k] >> 32), b = (uint)oldKeys[k];
    if (!gone[k] && AT(kinds, a) == STAYS && AT(kinds, b) == STAYS) appendPair(&kept, a, b);
  }
  flushPairs(&kept);
}

// ---- pairs of fresh bodies -----------------------------------------------------------------------------------------

static inline uint endAt(uint place, __global const uint* axis, __global const uint* x, __global const uint* y,
                         __global const uint* z) {
  return (*axis == 0 ? x : (*axis == 1 ? y : z))[place];
}

// By place in the order of the axis: a lower end of a body that takes part; of a fresh one.
KERNEL lowerEnds(CHECKS uint bodyCount, __global const uint* axis, __global const uint* x, __global const uint* y,
                 __global const uint* z, __global const uint* kinds, __global uint* lowers, __global uint* fresh) {
  FOR_EACH(p, 2 * bodyCount) {
    const uint end = endAt(p, axis, x, y, z), kind = AT(kinds, end / 2);
    lowers[p] = end % 2 == 0 && kind != ABSENT;
    fresh[p] = end % 2 == 0 && kind == FRESH;
  }
}

// Boxes of all that take part from place 0 on, by lower end, and those of the fresh ones once more from place `freshFirst`
// on. A fresh body meets all that begin within its interval, any other the fresh ones that do. lowersBefore, freshBefore:
// scans of the flags.
KERNEL freshRanges(CHECKS uint bodyCount, uint freshFirst, __global const uint* axis, __global const uint* x,
                   __global const uint* y, __global const uint* z, __global const uint* kinds,
                   __global const uint* lowersBefore, __global const uint* freshBefore, __global const Aabb* aabbs,
                   __global uint* selves, __global uint* from, __global uint* end, __global Aabb* boxes,
                   __global uint* order) {
  FOR_EACH(p, 2 * bodyCount) {
    const uint at = endAt(p, axis, x, y, z), i = at / 2, kind = AT(kinds, i);
    const uint all = lowersBefore[p], among = freshFirst + freshBefore[p];
    if (at % 2) {
      AT(end, i) = kind == FRESH ? all : among;
      continue;
    }
    AT(selves, i) = i;
    AT(from, i) = kind == FRESH ? all + 1 : among;
    if (kind == ABSENT) continue;
    AT(order, all) = i;
    storeBox(boxes, all, AT(aabbs, i));
    if (kind != FRESH) continue;
    AT(order, among) = i;
    storeBox(boxes, among, AT(aabbs, i));
  }
}

KERNEL freshPieces(uint bodyCount, __global const uint* kinds, __global const uint* from, __global const uint* end,
                   __global uint* pieces) {
  FOR_EACH(i, bodyCount) {
    const int some = kinds[i] != ABSENT && end[i] > from[i];
    pieces[i] = some ? (end[i] - from[i] + PIECE - 1) / PIECE : 0;
  }
}

// ---- for the next step ---------------------------------------------------------------------------------------------

KERNEL rememberBodies(uint bodyCount, __global const BodyInfo* infos, __global const Aabb* aabbs,
                      __global BodyInfo* oldInfos, __global Aabb* oldAabbs) {
  FOR_EACH(i, bodyCount) {
    oldInfos[i] = infos[i];
    oldAabbs[i] = aabbs[i];
  }
}

// Of a step that found no room for its pairs nothing is known.
KERNEL rememberPairs(__global const StepCounters* counters, __global const uint* pairCount,
                     __global const ulong* keys, __global ulong* oldKeys, __global uint* oldPairCount,
                     __global uint* known) {
  const uint pairs = counters->overflow ? 0 : *pairCount;
  FOR_EACH(k, pairs) oldKeys[k] = keys[k];
  if (get_global_id(0) != 0) return;
  *oldPairCount = pairs;
  *known = counters->overflow == 0;
}
