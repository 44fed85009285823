// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstring>

namespace btgpu {

// Whether two arrays, vectors or views, hold the same bits.
template <typename Values>
bool same(const Values& a, const Values& b) {
  return a.size() == b.size() && (a.size() == 0 || std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0);
}

}  // namespace btgpu
