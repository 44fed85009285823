// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// An application that knows nothing of profiles and never destroys its world: how it ends is its argument.
#include <cstdlib>
#include <cstring>

#include "compat/btGpuDynamicsWorld.h"
#include "tests/support/world_of.h"

int main(int argc, char** argv) {
  auto* run = new btgpu::test::WorldOf<btGpuDynamicsWorld>;
  scenes::find("stack")->build(run->objects, {2, 3, 2});
  run->run(5);
  if (argc > 1 && std::strcmp(argv[1], "quick_exit") == 0) std::_Exit(0);
  return run->world.statistics().m_deviceSteps == 5 ? 0 : 1;
}
