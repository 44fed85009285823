// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstdint>

namespace btgpu {

// A step of a hash. One to one in the word, and in the hash so far, since the factor is odd. A word has to wait for the
// one before: whoever has many of them keeps several hashes going.
inline void mixWord(std::uint64_t& hash, std::uint64_t word) {
  hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
  hash ^= hash >> 29;
}

}  // namespace btgpu
