// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Helper of tests: writes a .bullet file with Bullet's double-precision serializer.
//   write_double_file FILE          a stack of eight boxes
//   write_double_file FILE SCENE    a built-in scene of size 4,4,4
#include <fstream>

#include "tests/support/world_of.h"

static_assert(sizeof(btScalar) == sizeof(double), "link with Bullet's double build");

int main(int argc, char** argv) {
  const scenes::Scene* scene = scenes::find(argc == 3 ? argv[2] : "stack");
  if (argc < 2 || argc > 3 || !scene) return 2;
  btgpu::test::WorldOf<btDiscreteDynamicsWorld> run;
  run.world.setGravity(btVector3(0, -10, 0));
  scene->build(run.objects, argc == 3 ? scenes::Size{4, 4, 4} : scenes::Size{2, 2, 2});

  std::ofstream file(argv[1], std::ios::binary);
  file << btgpu::test::serialized(run.world);
  return file.flush() ? 0 : 1;
}
