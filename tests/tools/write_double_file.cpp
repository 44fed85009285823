// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Helper of command_line_test: writes a .bullet file with Bullet's double-precision serializer.
#include <cstdio>
#include <fstream>

#include "samples/scenes/scene.h"

static_assert(sizeof(btScalar) == sizeof(double), "link with Bullet's double build");

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  scenes::Objects objects(world);
  world.setGravity(btVector3(0, -10, 0));
  scenes::find("stack")->build(objects, {2, 2, 2});

  btDefaultSerializer serializer;
  world.serialize(&serializer);
  std::ofstream file(argv[1], std::ios::binary);
  file.write(reinterpret_cast<const char*>(serializer.getBufferPointer()), serializer.getCurrentBufferSize());
  return file.flush() ? 0 : 1;
}
