// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstddef>
#include <functional>

namespace btgpu {

// Calls work(first, last) for ranges that cover [0, count), on several threads where count is worth it (more than
// `grain` items). Returns when all are done. `work` must not throw and must not touch the same thing for two items.
void parallelFor(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& work);

// The same in chunks of `chunkSize` items, numbered from 0: for results that are to be put together in order.
// work(chunk, first, last).
void parallelChunks(std::size_t count, std::size_t chunkSize,
                    const std::function<void(std::size_t, std::size_t, std::size_t)>& work);
inline std::size_t chunkCount(std::size_t count, std::size_t chunkSize) { return (count + chunkSize - 1) / chunkSize; }

}  // namespace btgpu
