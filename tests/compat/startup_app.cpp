// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// An application as small as they come, linked with btgpu alone: steps a scene, then the same one in stock Bullet,
// and prints what became of it as `name value` lines.
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>

#include "compat/btGpuDynamicsWorld.h"
#include "tests/support/world_of.h"

namespace {

constexpr int kSteps = 30;
using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

void build(scenes::Objects& objects) {
  const auto* plane = objects.plane(btVector3(0, 1, 0), 0);
  objects.add(0, const_cast<btStaticPlaneShape*>(plane), btVector3(0, 0, 0));
  auto* box = objects.box(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
  auto* ball = objects.sphere(btScalar(0.5));
  for (int i = 0; i < 60; ++i) {
    btCollisionShape* shape = i % 2 ? static_cast<btCollisionShape*>(box) : ball;
    objects.add(1, shape,
                btVector3(btScalar(0.9 * (i % 4)), btScalar(0.6 + 1.1 * (i / 16)), btScalar(0.8 * (i / 4 % 4))));
  }
}

template <typename World>
struct Run : btgpu::test::WorldOf<World> {
  Run() { build(this->objects); }
};

bool sameBits(const btRigidBody& a, const btRigidBody& b) {
  const btVector3 values[][2] = {{a.getWorldTransform().getOrigin(), b.getWorldTransform().getOrigin()},
                                 {a.getWorldTransform().getBasis()[0], b.getWorldTransform().getBasis()[0]},
                                 {a.getWorldTransform().getBasis()[1], b.getWorldTransform().getBasis()[1]},
                                 {a.getLinearVelocity(), b.getLinearVelocity()},
                                 {a.getAngularVelocity(), b.getAngularVelocity()}};
  for (const auto& v : values) {
    if (std::memcmp(v[0].m_floats, v[1].m_floats, 3 * sizeof(btScalar)) != 0) return false;
  }
  return true;
}

double meanDistance(const scenes::Objects& a, const scenes::Objects& b) {
  double sum = 0;
  for (size_t i = 0; i < a.bodies().size(); ++i) {
    sum += double(
        (a.bodies()[i]->getWorldTransform().getOrigin() - b.bodies()[i]->getWorldTransform().getOrigin()).length());
  }
  return sum / double(a.bodies().size());
}

bool isLoaderMapped() {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    if (line.find("libOpenCL") != std::string::npos) return true;
  }
  return false;
}

}  // namespace

int main() {
  std::printf("loaderAtStart %d\n", isLoaderMapped());
  const auto start = Clock::now();
  Run<btGpuDynamicsWorld> gpu;
  gpu.run(1);
  std::printf("firstStepSeconds %.3f\n", secondsSince(start));
  gpu.run(kSteps - 1);
  Run<btGpuDynamicsWorld> second;  // what is missing is said once a process
  second.run(1);
  Run<btDiscreteDynamicsWorld> stock;
  stock.run(kSteps);

  bool same = true;
  for (size_t i = 0; i < stock.objects.bodies().size(); ++i) {
    same = same && sameBits(*gpu.objects.bodies()[i], *stock.objects.bodies()[i]);
  }
  const btGpuStatistics s = gpu.world.statistics();
  std::printf("device %s\n", s.m_device.c_str());
  std::printf("deviceSteps %llu\nstockSteps %llu\n", s.m_deviceSteps, s.m_stockSteps);
  std::printf("sameAsStock %d\nmeanDistance %.6f\n", same, meanDistance(gpu.objects, stock.objects));
  for (const auto& f : gpu.world.fallbackReport()) {
    std::printf("fallback %s: %s (%llu)\n", f.m_what.c_str(), f.m_reason.c_str(), f.m_count);
  }
  return 0;
}
