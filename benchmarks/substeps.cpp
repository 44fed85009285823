// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What it brings that the device runs one substep ahead: a stack of boxes, stepSimulation with several substeps, in a
// world that may run ahead and in one that may not, since it has a tick callback. In turn, so that both see the same
// machine.
//   btgpu_substeps X,Y,Z [SUBSTEPS] [CALLS]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "compat/btGpuDynamicsWorld.h"
#include "tests/support/world_of.h"

namespace {

using GpuWorld = btgpu::test::WorldOf<btGpuDynamicsWorld>;

void nothing(btDynamicsWorld*, btScalar) {}

double stepMilliseconds(btDynamicsWorld& world, int substeps) {
  const btScalar timeStep = btScalar(1.0 / 240.0);
  const auto start = std::chrono::steady_clock::now();
  world.stepSimulation(timeStep * btScalar(substeps), substeps, timeStep);
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

void measure(scenes::Size size, int substeps, int calls, const char* what, const btGpuSettings& settings) {
  GpuWorld ahead(settings), single(settings);
  for (GpuWorld* w : {&ahead, &single}) scenes::find("stack")->build(w->objects, size);
  single.world.setInternalTickCallback(nothing);
  std::vector<double> aheadMs, singleMs;
  for (int i = 0; i < calls; ++i) {
    const double a = stepMilliseconds(ahead.world, substeps), b = stepMilliseconds(single.world, substeps);
    if (i < calls / 4) continue;  // kernels are built, room is found
    aheadMs.push_back(a);
    singleMs.push_back(b);
  }
  const btGpuStatistics s = ahead.world.statistics();
  std::printf("%-32s one by one %8.2f ms, ahead %8.2f ms, %5.2f times (%llu of %llu substeps ahead, %s)\n", what,
              median(singleMs), median(aheadMs), median(singleMs) / median(aheadMs), s.m_prefetchedSteps,
              s.m_deviceSteps, s.m_device.c_str());
}

}  // namespace

int main(int count, char** arguments) {
  scenes::Size size{8, 8, 8};
  if (count > 1 && std::sscanf(arguments[1], "%d,%d,%d", &size.x, &size.y, &size.z) != 3) {
    std::fprintf(stderr, "usage: %s X,Y,Z [SUBSTEPS] [CALLS]\n", arguments[0]);
    return 2;
  }
  const int substeps = count > 2 ? std::atoi(arguments[2]) : 4, calls = count > 3 ? std::atoi(arguments[3]) : 40;
  std::printf("stack %d,%d,%d, %d substeps a stepSimulation\n", size.x, size.y, size.z, substeps);
  btGpuSettings settings;
  settings.m_smallWorld = 0;
  measure(size, substeps, calls, "all", settings);
  settings.m_contacts = false;
  measure(size, substeps, calls, "contacts off", settings);
  settings.m_hostQueries = false;
  measure(size, substeps, calls, "contacts and host queries off", settings);
  return 0;
}
