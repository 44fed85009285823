// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "kernels/lib/colour.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "kernels/shared/rows.h"

namespace btgpu {
namespace {

TEST(Colour, IndexBits) {
  EXPECT_EQ(indexBits(1), 1u);
  EXPECT_EQ(indexBits(2), 1u);
  EXPECT_EQ(indexBits(3), 2u);
  for (uint bits = 2; bits < 32; ++bits) {
    EXPECT_EQ(indexBits(1u << bits), bits);
    EXPECT_EQ(indexBits((1u << bits) + 1), bits + 1);
  }
  EXPECT_EQ(indexBits(0xffffffffu), 32u);
}

TEST(Colour, LowMask) {
  EXPECT_EQ(lowMask(1), 1u);
  EXPECT_EQ(lowMask(31), 0x7fffffffu);
  EXPECT_EQ(lowMask(32), 0xffffffffu);
}

TEST(Colour, PermutationsOfFewBits) {
  for (uint bits = 1; bits <= 16; ++bits) {
    std::vector<bool> seen(size_t{1} << bits, false);
    for (uint x = 0; x <= lowMask(bits); ++x) {
      const uint p = permute(x, bits);
      ASSERT_LE(p, lowMask(bits)) << bits << " bits";
      ASSERT_FALSE(seen[p]) << x << " collides, " << bits << " bits";
      seen[p] = true;
      ASSERT_EQ(unpermute(p, bits), x) << bits << " bits";
    }
  }
}

// An inverse on either side for samples proves what matters: that no sample collides with another.
TEST(Colour, PermutationsOfManyBits) {
  std::mt19937 generator(1);
  for (uint bits = 17; bits <= 32; ++bits) {
    for (int n = 0; n < 20000; ++n) {
      const uint x = generator() & lowMask(bits);
      ASSERT_LE(permute(x, bits), lowMask(bits));
      ASSERT_EQ(unpermute(permute(x, bits), bits), x) << bits << " bits";
      ASSERT_EQ(permute(unpermute(x, bits), bits), x) << bits << " bits";
    }
    for (const uint x : {0u, 1u, lowMask(bits), lowMask(bits) - 1}) {
      ASSERT_EQ(unpermute(permute(x, bits), bits), x) << bits << " bits";
    }
  }
}

// Ranks of neighbours must not rise or fall in long runs, else a chain takes as many rounds as it has links.
// In a random permutation a run of 12 or more occurs with probability 2 * 65536 / 13! = 2e-5.
TEST(Colour, PermutationIsIrregular) {
  for (const uint bits : {10u, 13u, 16u}) {
    int run = 1, longest = 1;
    bool rising = true;
    for (uint x = 1; x <= lowMask(bits); ++x) {
      const bool rises = permute(x, bits) > permute(x - 1, bits);
      run = rises == rising ? run + 1 : 2;
      rising = rises;
      longest = std::max(longest, run);
    }
    EXPECT_LT(longest, 12) << bits << " bits";
  }
}

TEST(Colour, FreeColour) {
  EXPECT_EQ(freeColour(0, 0), 0u);
  EXPECT_EQ(freeColour(0xffffffffu, 0xffffffffu), static_cast<uint>(COLOUR_LIMIT));
  for (uint c = 0; c < 32; ++c) {
    EXPECT_EQ(freeColour((1u << c) - 1, 0), c);
    EXPECT_EQ(freeColour(~(1u << c), 0xffffffffu), c);
    EXPECT_EQ(freeColour(0xffffffffu, (1u << c) - 1), 32 + c);
    EXPECT_EQ(freeColour(0xffffffffu, ~(1u << c)), 32 + c);
  }
  std::mt19937 generator(2);
  for (int n = 0; n < 1000; ++n) {
    const ulong taken = ulong{generator()} << 32 | generator() | lowMask(generator() % 20);
    uint expected = 0;
    while (expected < 64 && (taken >> expected & 1)) ++expected;
    EXPECT_EQ(freeColour(static_cast<uint>(taken), static_cast<uint>(taken >> 32)), expected);
  }
}

}  // namespace
}  // namespace btgpu
