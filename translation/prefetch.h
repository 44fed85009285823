// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bullet's objects lie anywhere in memory, so a walk over them is waiting for memory unless it asks ahead.
#pragma once

#include <cstddef>

#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

constexpr std::size_t kLine = 64;  // bytes of a cache line, on all processors that matter

// How many objects ahead.
constexpr std::size_t kAhead = 6;

// For an address that need not be valid.
inline void prefetch(const void* from, std::size_t bytes) {
  for (std::size_t at = 0; at < bytes; at += kLine) __builtin_prefetch(static_cast<const char*>(from) + at);
}
inline void prefetchToWrite(const void* from, std::size_t bytes) {
  for (std::size_t at = 0; at < bytes; at += kLine) __builtin_prefetch(static_cast<const char*>(from) + at, 1);
}

BTGPU_TRANSLATION_END
