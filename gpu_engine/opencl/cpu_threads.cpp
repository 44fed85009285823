// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "cpu_threads.h"

#ifdef __linux__
#include <sched.h>
#include <sys/sysinfo.h>

#include <cstdlib>
#endif

namespace btgpu {

#ifdef __linux__
namespace {

bool mayRunOnAllCores() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return false;
  const int cores = get_nprocs();
  for (int core = 0; core < cores; ++core) {
    if (!CPU_ISSET(core, &allowed)) return false;
  }
  return CPU_COUNT(&allowed) == cores;
}

}  // namespace

void spreadCpuDeviceThreads() {
  constexpr int kKeepWhatIsThere = 0;
  if (mayRunOnAllCores()) setenv("POCL_AFFINITY", "1", kKeepWhatIsThere);
}
#else
void spreadCpuDeviceThreads() {}
#endif

}  // namespace btgpu
