// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "parallel.h"

#ifdef BTGPU_STD_THREADS

#include <algorithm>
#include <thread>
#include <vector>

namespace btgpu {

// For the thread sanitizer, which does not know Debian's oneTBB.
void parallelFor(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& work) {
  const std::size_t most = std::max<std::size_t>(1, std::thread::hardware_concurrency());
  const std::size_t parts = std::min(most, (count + grain - 1) / std::max<std::size_t>(1, grain));
  if (parts < 2) {
    work(0, count);
    return;
  }
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < parts; ++t) { threads.emplace_back(work, count * t / parts, count * (t + 1) / parts); }
  for (auto& thread : threads) thread.join();
}

}  // namespace btgpu

#else

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace btgpu {

void parallelFor(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& work) {
  if (count <= grain) {
    work(0, count);
    return;
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain),
                    [&](const tbb::blocked_range<std::size_t>& range) { work(range.begin(), range.end()); });
}

}  // namespace btgpu

#endif

namespace btgpu {

void parallelChunks(std::size_t count, std::size_t chunkSize,
                    const std::function<void(std::size_t, std::size_t, std::size_t)>& work) {
  parallelFor(chunkCount(count, chunkSize), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t chunk = first; chunk < last; ++chunk) {
      const std::size_t end = (chunk + 1) * chunkSize;
      work(chunk, chunk * chunkSize, end < count ? end : count);
    }
  });
}

}  // namespace btgpu
