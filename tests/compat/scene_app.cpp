// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// An application linked with btgpu that knows nothing of the cross-check: steps a built-in scene as a game does and
// prints where its steps ran and a sum of where its bodies are.
//   scene_app SCENE STEPS [X Y Z]
#include <cstdio>
#include <cstdlib>

#include "compat/btGpuDynamicsWorld.h"
#include "tests/support/world_of.h"

int main(int argc, char** argv) {
  const scenes::Scene* scene = argc == 3 || argc == 6 ? scenes::find(argv[1]) : nullptr;
  const int steps = scene ? std::atoi(argv[2]) : 0;
  if (!scene || steps < 1) {
    std::fprintf(stderr, "usage: scene_app SCENE STEPS [X Y Z]\n");
    return 2;
  }
  btgpu::test::WorldOf<btGpuDynamicsWorld> w;
  scene->build(w.objects,
               argc == 3 ? scene->size : scenes::Size{std::atoi(argv[3]), std::atoi(argv[4]), std::atoi(argv[5])});
  w.run(steps, scene->timeStep);
  double sum = 0;
  for (const btRigidBody* body : w.objects.bodies()) sum += double(body->getWorldTransform().getOrigin().length());
  const btGpuStatistics s = w.world.statistics();
  std::printf("deviceSteps %llu\nstockSteps %llu\npositions %.17g\n", s.m_deviceSteps, s.m_stockSteps, sum);
  return 0;
}
