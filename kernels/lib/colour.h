// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Order in which constraints choose their colours: a pseudo-random permutation of [0, 2^bits), so that the
// parallel rounds of stage 60 are few, and invertible, so that a serial pass can follow the same order. Constraints
// to fixed bodies choose after all others: solved later in an iteration, they leave less error behind in piles
// (docs/decisions/0006-order-of-colours.md).
#ifndef BTGPU_LIB_COLOUR_H
#define BTGPU_LIB_COLOUR_H
#include "../shared/types.h"

BTGPU_BEGIN

#define PERMUTE_A 0x9e3779b1u          // odd; PERMUTE_A * PERMUTE_A_INVERSE = 1 mod 2^32
#define PERMUTE_A_INVERSE 0x0e8b2f51u
#define PERMUTE_B 0x85ebca6bu
#define PERMUTE_B_INVERSE 0xa5cb9243u

// Bits needed for indices below count.
LIB uint indexBits(uint count) {
  uint bits = 1;
  while (bits < 32 && (count - 1) >> bits) ++bits;
  return bits;
}
LIB uint lowMask(uint bits) { return bits >= 32 ? 0xffffffffu : (1u << bits) - 1u; }

LIB uint permute(uint x, uint bits) {
  const uint mask = lowMask(bits), shift = (bits + 1) / 2;
  x = (x * PERMUTE_A) & mask;
  x ^= x >> shift;  // its own inverse, since 2 * shift >= bits
  x = (x * PERMUTE_B) & mask;
  x ^= x >> shift;
  return (x * PERMUTE_A) & mask;
}
LIB uint unpermute(uint x, uint bits) {
  const uint mask = lowMask(bits), shift = (bits + 1) / 2;
  x = (x * PERMUTE_A_INVERSE) & mask;
  x ^= x >> shift;
  x = (x * PERMUTE_B_INVERSE) & mask;
  x ^= x >> shift;
  return (x * PERMUTE_A_INVERSE) & mask;
}

// Place of constraint `index` in the order; at most 2^31 constraints.
LIB uint colourRank(uint index, uint bits, int hasFixedBody) {
  return permute(index, bits) | (hasFixedBody ? 1u << bits : 0u);
}

#ifndef __OPENCL_C_VERSION__
inline uint popcount(uint bits) { return static_cast<uint>(__builtin_popcount(bits)); }
#endif

// Lowest colour that is in neither mask (64 bits as low and high word), or COLOUR_LIMIT.
LIB uint freeColour(uint low, uint high) {
  const uint ones = popcount(low & ~(low + 1));  // those below the lowest zero
  return ones < 32 ? ones : 32 + popcount(high & ~(high + 1));
}

BTGPU_END
#endif
