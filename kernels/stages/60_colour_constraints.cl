// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Gives every constraint a colour so that no two of one colour move the same body, then lays the constraints out
// by colour. The result is that of one serial greedy pass in the order of colourRank: the CPU body does just that,
// the GPU body lets each constraint choose once it comes first among its uncoloured neighbours (Jones and
// Plassmann), which takes some rounds and gives the same colours. A constraint that finds all COLOUR_LIMIT colours
// taken goes to the serial batch. The colours are a pure function of the constraints.
#include "../lib/colour.h"
#include "../lib/kernel.h"
#include "../shared/body.h"
#include "../shared/rows.h"

// A body that the solver can't move puts no constraints apart.
static uint movedBody(CHECKS __global const BodyStep* steps, uint body) {
  return AT(steps, body).angularVelocity.w != 0.0f ? body : NO_INDEX;
}

KERNEL colourInit(CHECKS uint bodyCount, uint constraintCapacity, __global StepCounters* counters,
                  __global const uint* constraints, __global const Manifold* manifolds, __global const BodyStep* steps,
                  __global uint* bodyColours, __global uint* firstClaims, __global uint* secondClaims,
                  __global SlotHeader* headers, __global uint* colours, __global uint* order) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(i, bodyCount) {
    bodyColours[2 * i] = bodyColours[2 * i + 1] = 0;
    firstClaims[i] = secondClaims[i] = NO_INDEX;
  }
  FOR_EACH(c, itemCount(constraintCapacity, &counters->constraintCount)) {
    const uint manifold = AT(constraints, c);
    SlotHeader header;
    header.bodyA = movedBody(WITH_CHECKS steps, AT(manifolds, manifold).bodyA);
    header.bodyB = movedBody(WITH_CHECKS steps, AT(manifolds, manifold).bodyB);
    header.manifold = manifold;
    header.pointCount = AT(manifolds, manifold).pointCount;
    ASSERT(header.pointCount <= MANIFOLD_POINTS, header.pointCount, manifold);
    AT(headers, c) = header;
    AT(colours, c) = COLOUR_NONE;
    AT(order, c) = c;
  }
}

static uint takenLow(CHECKS __global const uint* bodyColours, uint body) {
  return body == NO_INDEX ? 0 : AT(bodyColours, 2 * body);
}
static uint takenHigh(CHECKS __global const uint* bodyColours, uint body) {
  return body == NO_INDEX ? 0 : AT(bodyColours, 2 * body + 1);
}
static void take(CHECKS __global uint* bodyColours, uint body, uint colour) {
  if (body == NO_INDEX || colour >= COLOUR_LIMIT) return;
  // No body twice in a colour.
  ASSERT(!(AT(bodyColours, 2 * body + colour / 32) & 1u << (colour % 32)), body, colour);
  AT(bodyColours, 2 * body + colour / 32) |= 1u << (colour % 32);
}
static uint chooseColour(CHECKS __global const uint* bodyColours, SlotHeader h) {
  return freeColour(takenLow(WITH_CHECKS bodyColours, h.bodyA) | takenLow(WITH_CHECKS bodyColours, h.bodyB),
                    takenHigh(WITH_CHECKS bodyColours, h.bodyA) | takenHigh(WITH_CHECKS bodyColours, h.bodyB));
}

static int hasFixedBody(SlotHeader h) { return h.bodyA == NO_INDEX || h.bodyB == NO_INDEX; }

#ifdef BTGPU_SHAPE_CPU

SINGLE_KERNEL colourGreedy(CHECKS uint constraintCapacity, __global StepCounters* counters,
                           __global const SlotHeader* headers, __global uint* bodyColours, __global uint* colours) {
  RETURN_ON_OVERFLOW(counters);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount);
  if (count == 0) return;
  const uint bits = indexBits(count);
  for (int fixed = 0; fixed < 2; ++fixed) {
    for (uint p = 0; p <= lowMask(bits); ++p) {
      const uint c = unpermute(p, bits);
      if (c >= count || hasFixedBody(headers[c]) != fixed) continue;
      const SlotHeader h = headers[c];
      const uint colour = chooseColour(WITH_CHECKS bodyColours, h);
      take(WITH_CHECKS bodyColours, h.bodyA, colour);
      take(WITH_CHECKS bodyColours, h.bodyB, colour);
      colours[c] = colour;
    }
  }
}

#else

// First half of a round: every uncoloured constraint claims its bodies; the lowest rank wins a body. One that
// already finds every colour taken needs no turn, since colours are never given back.
KERNEL colourClaim(CHECKS uint constraintCapacity, __global const StepCounters* counters,
                   __global const SlotHeader* headers, __global const uint* bodyColours, __global uint* colours,
                   volatile __global uint* claims) {
  RETURN_ON_OVERFLOW(counters);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount);
  const uint bits = indexBits(count);
  FOR_EACH(c, count) {
    if (colours[c] != COLOUR_NONE) continue;
    const SlotHeader h = headers[c];
    if (chooseColour(WITH_CHECKS bodyColours, h) == COLOUR_SERIAL) {
      colours[c] = COLOUR_SERIAL;
      continue;
    }
    const uint rank = colourRank(c, bits, hasFixedBody(h));
    if (h.bodyA != NO_INDEX) atomic_min(&AT(claims, h.bodyA), rank);
    if (h.bodyB != NO_INDEX) atomic_min(&AT(claims, h.bodyB), rank);
  }
}

// Second half: who won all its bodies chooses. The other array of claims is made ready for the next round.
KERNEL colourChoose(CHECKS uint round, uint constraintCapacity, __global StepCounters* counters,
                    __global const SlotHeader* headers, __global const uint* claims, volatile __global uint* nextClaims,
                    __global uint* bodyColours, __global uint* colours) {
  RETURN_ON_OVERFLOW(counters);
  const uint count = itemCount(constraintCapacity, &counters->constraintCount);
  const uint bits = indexBits(count);
  uint coloured = 0;
  FOR_EACH(c, count) {
    if (colours[c] != COLOUR_NONE) continue;
    const SlotHeader h = headers[c];
    const uint rank = colourRank(c, bits, hasFixedBody(h));
    if (h.bodyA != NO_INDEX) atomic_xchg(&AT(nextClaims, h.bodyA), NO_INDEX);
    if (h.bodyB != NO_INDEX) atomic_xchg(&AT(nextClaims, h.bodyB), NO_INDEX);
    if (h.bodyA != NO_INDEX && AT(claims, h.bodyA) != rank) continue;
    if (h.bodyB != NO_INDEX && AT(claims, h.bodyB) != rank) continue;
    const uint colour = chooseColour(WITH_CHECKS bodyColours, h);
    take(WITH_CHECKS bodyColours, h.bodyA, colour);
    take(WITH_CHECKS bodyColours, h.bodyB, colour);
    colours[c] = colour;
    ++coloured;
  }
  if (coloured) atomic_max(&counters->colourRounds, round + 1);
}

#endif

// After the constraints are sorted by colour (colours[], order[]): where each colour begins among them, from
// colourFirst[c] on, and among the slots, from slotFirst[c] on. A parallel colour fills whole blocks of lanes.
// Single work item. Uncoloured constraints sort last.
SINGLE_KERNEL layoutColours(CHECKS uint slotCapacity, __global const uint* colourFirst, __global uint* slotFirst,
                            __global StepCounters* counters) {
  uint next = 0, used = 0, large = 0;
  for (uint c = 0; c <= COLOUR_SERIAL; ++c) {
    ASSERT(AT(colourFirst, c) <= AT(colourFirst, c + 1), c, AT(colourFirst, c + 1));
    const uint size = colourFirst[c + 1] - colourFirst[c];
    slotFirst[c] = next;
    next += (size + BTGPU_LANES - 1) / BTGPU_LANES * BTGPU_LANES;
    if (size && c < COLOUR_SERIAL) used = c + 1;
    if (size > SMALL_COLOUR && c < COLOUR_SERIAL) large = c + 1;
  }
  slotFirst[COLOUR_SERIAL + 1] = next;
  if (counters->overflow) return;
  counters->colourCount = used;
  counters->largeColours = large;
  counters->serialCount = colourFirst[COLOUR_SERIAL + 1] - colourFirst[COLOUR_SERIAL];
  counters->uncoloured = counters->constraintCount - colourFirst[COLOUR_SERIAL + 1];
  counters->slotCount = next;
  if (counters->uncoloured) counters->overflow |= OVERFLOW_ROUNDS;
  if (next > slotCapacity) counters->overflow |= OVERFLOW_SLOTS;
}

// Headers in slot order; lanes without a constraint get an empty one.
KERNEL fillSlots(CHECKS uint slotCapacity, __global const StepCounters* counters, __global const uint* colourFirst,
                 __global const uint* slotFirst, __global const uint* order, __global const SlotHeader* headers,
                 __global SlotHeader* slots) {
  RETURN_ON_OVERFLOW(counters);
  FOR_EACH(s, itemCount(slotCapacity, &counters->slotCount)) {
    ASSERT(s < slotFirst[COLOUR_SERIAL + 1], s, slotFirst[COLOUR_SERIAL + 1]);
    uint colour = 0;
    while (slotFirst[colour + 1] <= s) ++colour;
    const uint k = colourFirst[colour] + (s - slotFirst[colour]);
    SlotHeader header;
    header.bodyA = header.bodyB = header.manifold = NO_INDEX;
    header.pointCount = 0;
    if (k < colourFirst[colour + 1]) header = AT(headers, AT(order, k));
    AT(slots, s) = header;
  }
}
