// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "parallel.h"

#ifdef BTGPU_STD_THREADS

#include <algorithm>
#include <thread>
#include <vector>

namespace btgpu::parallel {

// For the thread sanitizer, which does not know Debian's oneTBB.
void run(std::size_t count, std::size_t grain, const void* work, Call call) {
  const std::size_t most = std::max<std::size_t>(1, std::thread::hardware_concurrency());
  const std::size_t parts = std::min(most, (count + grain - 1) / std::max<std::size_t>(1, grain));
  if (parts < 2) {
    call(work, 0, count);
    return;
  }
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < parts; ++t) {
    threads.emplace_back(call, work, count * t / parts, count * (t + 1) / parts);
  }
  for (auto& thread : threads) thread.join();
}

}  // namespace btgpu::parallel

#else

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace btgpu::parallel {

void run(std::size_t count, std::size_t grain, const void* work, Call call) {
  if (count <= grain) {
    call(work, 0, count);
    return;
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain),
                    [=](const tbb::blocked_range<std::size_t>& range) { call(work, range.begin(), range.end()); });
}

}  // namespace btgpu::parallel

#endif
