// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Helper of command_line_test: writes a .bullet file with Bullet's double-precision serializer.
#include <fstream>

#include "tests/support/world_of.h"

static_assert(sizeof(btScalar) == sizeof(double), "link with Bullet's double build");

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  btgpu::test::WorldOf<btDiscreteDynamicsWorld> run;
  run.world.setGravity(btVector3(0, -10, 0));
  scenes::find("stack")->build(run.objects, {2, 2, 2});

  std::ofstream file(argv[1], std::ios::binary);
  file << btgpu::test::serialized(run.world);
  return file.flush() ? 0 : 1;
}
