// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstddef>

namespace btgpu {

namespace parallel {
using Call = void (*)(const void* work, std::size_t first, std::size_t last);
void run(std::size_t count, std::size_t grain, const void* work, Call call);
}  // namespace parallel

// Calls work(first, last) for ranges that cover [0, count), on several threads where count is worth it (more than
// `grain` items). Returns when all are done. `work` must not throw and must not touch the same thing for two items.
template <typename Work>
void parallelFor(std::size_t count, std::size_t grain, const Work& work) {
  parallel::run(count, grain, &work, [](const void* w, std::size_t first, std::size_t last) {
    (*static_cast<const Work*>(w))(first, last);
  });
}

// The same in chunks of `chunkSize` items, numbered from 0: for results that are to be put together in order.
// work(chunk, first, last).
inline std::size_t chunkCount(std::size_t count, std::size_t chunkSize) { return (count + chunkSize - 1) / chunkSize; }
template <typename Work>
void parallelChunks(std::size_t count, std::size_t chunkSize, const Work& work) {
  parallelFor(chunkCount(count, chunkSize), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t chunk = first; chunk < last; ++chunk) {
      const std::size_t end = (chunk + 1) * chunkSize;
      work(chunk, chunk * chunkSize, end < count ? end : count);
    }
  });
}

}  // namespace btgpu
