// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "small_world.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "environment.h"
#include "solver_choice.h"

namespace btgpu {
namespace {

constexpr long kDefaultLimit = 440;  // docs/decisions/0015-small-worlds.md
constexpr int kManifoldsABody = 3;   // of a pile, before any is known

bool isOn(const char* variable) {
  const char* value = environment(variable);
  return value && std::string(value) != "0";
}

bool isTimed(const btGpuSettings& s) { return s.m_profile || !s.m_profileFile.empty() || isOn("BTGPU_PROFILE"); }

long limitOf(const btGpuSettings& s) {
  if (s.m_smallWorld >= 0) return s.m_smallWorld;
  if (!s.m_device.empty() || isTimed(s) || looksAtSteps(s) || solverOf(s) != Solver::Parity) return 0;
  const char* text = environment("BTGPU_SMALL_WORLD");
  if (!text) return kDefaultLimit;
  char* end = nullptr;
  const long value = std::strtol(text, &end, 10);
  if (*end == '\0' && value >= 0) return value;
  std::fprintf(stderr, "btgpu: BTGPU_SMALL_WORLD=%s is no number of manifolds; it is left aside\n", text);
  return kDefaultLimit;
}

}  // namespace

bool looksAtSteps(const btGpuSettings& s) {
  constexpr const char* kVariables[] = {"BTGPU_CROSSCHECK", "BTGPU_CHECK_STAGES", "BTGPU_HOST_STAGES",
                                        "BTGPU_CAPTURE",    "BTGPU_STAGE_HASHES", "BTGPU_WATCH",
                                        "BTGPU_PRINTF",     "BTGPU_DEBUG_KERNELS"};
  return s.m_crosscheckEvery > 0 || s.m_keepContacts || s.m_checkStages || s.m_debugKernels ||
         !s.m_hostStages.empty() || std::any_of(std::begin(kVariables), std::end(kVariables), isOn);
}

void SmallWorld::use(const btGpuSettings& settings) { m_limit = limitOf(settings); }

// A world on the device stays there until it is half as small: each change of path takes all manifolds along.
bool SmallWorld::isSmall(int bodies, int manifolds) {
  if (m_limit == 0) return false;
  const bool first = manifolds < 0;
  const long work = workOf(bodies, first ? kManifoldsABody * bodies : manifolds);
  m_small = work < (m_small || first ? m_limit : m_limit / 2);
  return m_small;
}

}  // namespace btgpu
