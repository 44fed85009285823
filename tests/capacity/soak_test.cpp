// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Memory over many steps in which bodies come and go: what the host has allocated, OpenCL's driver included where it is
// part of the process, and the buffers on the device.
#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>
#include <malloc.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <memory>
#include <random>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

std::atomic<long> bufferBytes{0};

void CL_CALLBACK bufferGone(cl_mem, void* size) { bufferBytes -= static_cast<long>(reinterpret_cast<size_t>(size)); }

}  // namespace
}  // namespace btgpu::test

// Found by the engine's plugin before libOpenCL's own.
extern "C" cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void* host, cl_int* error) {
  static const auto real = reinterpret_cast<decltype(&clCreateBuffer)>(
      dlsym(dlopen("libOpenCL.so.1", RTLD_NOW | RTLD_LOCAL), "clCreateBuffer"));
  const cl_mem buffer = real(context, flags, size, host, error);
  if (buffer) {
    btgpu::test::bufferBytes += static_cast<long>(size);
    clSetMemObjectDestructorCallback(buffer, btgpu::test::bufferGone, reinterpret_cast<void*>(size));
  }
  return buffer;
}

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }

// At most 24 bodies of four shapes that fall on the ground; a new one comes every fourth step and the oldest goes.
class Coming {
 public:
  Coming() {
    m_world.world.setGravity(btVector3(0, -10, 0));
    m_world.objects.add(0, m_world.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
  }
  ~Coming() {
    while (!m_bodies.empty()) takeOldest();
  }

  void step() {
    if (m_step % 4 == 0) {
      if (m_bodies.size() >= 24) takeOldest();
      addOne();
    }
    m_world.world.stepSimulation(s(1 / 60.0), 0);
    ++m_step;
  }
  GpuWorld& world() { return m_world; }

 private:
  void addOne() {
    btCollisionShape* shapes[] = {&m_box, &m_ball, &m_capsule, &m_hull};
    btCollisionShape* shape = shapes[m_random() % 4];
    btVector3 inertia;
    shape->calculateLocalInertia(1, inertia);
    m_bodies.push_back(std::make_unique<btRigidBody>(s(1), nullptr, shape, inertia));
    btTransform at(btQuaternion(btVector3(1, 0, 0), s(0.1 * double(m_random() % 30))),
                   btVector3(s(0.1 * double(m_random() % 30)), s(2.5), s(0.1 * double(m_random() % 20))));
    m_bodies.back()->setWorldTransform(at);
    m_world.world.addRigidBody(m_bodies.back().get());
  }
  void takeOldest() {
    m_world.world.removeRigidBody(m_bodies.front().get());
    m_bodies.pop_front();
  }

  btBoxShape m_box{btVector3(s(0.3), s(0.2), s(0.4))};
  btSphereShape m_ball{s(0.3)};
  btCapsuleShape m_capsule{s(0.2), s(0.4)};
  btConvexHullShape m_hull = hull();
  static btConvexHullShape hull() {
    btConvexHullShape shape;
    for (const btVector3& p : scenes::prism(6, 0.3, 0.25)) shape.addPoint(p);
    return shape;
  }
  std::mt19937 m_random{1};
  GpuWorld m_world;
  std::deque<std::unique_ptr<btRigidBody>> m_bodies;
  int m_step = 0;
};

TEST(Soak, MemoryDoesNotGrow) {
  const char* wanted = std::getenv("BTGPU_TEST_STEPS");
  const int steps = wanted ? std::atoi(wanted) : 1000;
  Coming run;
  size_t hostBytes = 0;
  long deviceBytes = 0;
  for (int i = 0; i < steps; ++i) {
    if (i == steps / 2) {
      hostBytes = mallinfo2().uordblks;
      deviceBytes = bufferBytes;
    }
    run.step();
  }
  const auto hostGrowth = static_cast<long>(mallinfo2().uordblks) - static_cast<long>(hostBytes);
  std::printf("%d steps; host %zu bytes, and %ld more at the end; device %ld, and %ld more\n", steps, hostBytes,
              hostGrowth, deviceBytes, bufferBytes - deviceBytes);
  EXPECT_EQ(run.world().world.statistics().m_stockSteps, 0u);
  EXPECT_GT(deviceBytes, 0);
  EXPECT_EQ(bufferBytes, deviceBytes);
  // The least that malloc gives is 32 bytes. One such piece lost with every tenth body would be more than this in a
  // long run; in a short one it is what arrays that are still growing take.
  EXPECT_LE(hostGrowth, 65536);
}

}  // namespace
}  // namespace btgpu::test
