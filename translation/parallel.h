// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstddef>
#include <functional>

namespace btgpu {

// Calls work(first, last) for ranges that cover [0, count), on several threads where count is worth it (more than
// `grain` items). Returns when all are done. `work` must not throw and must not touch the same thing for two items.
void parallelFor(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& work);

}  // namespace btgpu
