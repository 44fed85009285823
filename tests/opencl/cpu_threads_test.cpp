// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/opencl/cpu_threads.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/sysinfo.h>

#include <cstdlib>
#include <string>

namespace btgpu {
namespace {

// Whether this process may run on all cores is up to whoever runs the test.
bool allCoresAllowed() {
  cpu_set_t allowed;
  return sched_getaffinity(0, sizeof allowed, &allowed) == 0 && CPU_COUNT(&allowed) == get_nprocs();
}

TEST(CpuThreads, EachOnItsCoreUnlessTheUserSaysOtherwise) {
  unsetenv("POCL_AFFINITY");
  spreadCpuDeviceThreads();
  const char* set = std::getenv("POCL_AFFINITY");
  EXPECT_EQ(set ? set : "", allCoresAllowed() ? std::string("1") : std::string());
  setenv("POCL_AFFINITY", "0", 1);
  spreadCpuDeviceThreads();
  EXPECT_STREQ(std::getenv("POCL_AFFINITY"), "0");
}

TEST(CpuThreads, NotWhereSomeCoresAreForbidden) {
  cpu_set_t before, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
  CPU_ZERO(&one);
  for (int core = 0; core < CPU_SETSIZE; ++core) {
    if (CPU_ISSET(core, &before) && CPU_COUNT(&one) == 0) CPU_SET(core, &one);
  }
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  unsetenv("POCL_AFFINITY");
  spreadCpuDeviceThreads();
  EXPECT_EQ(std::getenv("POCL_AFFINITY") == nullptr, get_nprocs() > 1);
  ASSERT_EQ(sched_setaffinity(0, sizeof before, &before), 0);
}

}  // namespace
}  // namespace btgpu
