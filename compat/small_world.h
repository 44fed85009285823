// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "btGpuDynamicsWorld.h"

namespace btgpu {

// Whether settings or the environment ask for what becomes of each of the device's steps: the cross-check, captures,
// stages that are checked and the like. Profiles are not among them.
bool looksAtSteps(const btGpuSettings& settings);

// Whether a world is so small that stock Bullet has done its step before a device would be through its launches
// (docs/decisions/0015-small-worlds.md). It goes by counts, not by clocks: the same run takes the same paths.
class SmallWorld {
 public:
  // Work of a step on one thread, in contact manifolds: eight bodies are worth one.
  static long workOf(int bodies, int manifolds) { return bodies / 8 + manifolds; }

  // Whoever looks at the device's steps, by settings or by the environment, gets them: then no world is small.
  void use(const btGpuSettings& settings);

  // Asked once a step. `manifolds`: of the last step; negative: there was none.
  bool isSmall(int bodies, int manifolds);

 private:
  long m_limit = 0;      // 0: never
  bool m_small = false;  // in the last step
};

}  // namespace btgpu
