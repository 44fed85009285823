// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "bullet3_peer.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "Bullet3Collision/BroadPhaseCollision/b3DynamicBvhBroadphase.h"
#include "Bullet3Collision/NarrowPhaseCollision/b3Config.h"
#include "Bullet3Collision/NarrowPhaseCollision/b3Contact4.h"
#include "Bullet3Collision/NarrowPhaseCollision/b3ConvexUtility.h"
#include "Bullet3Common/b3Logging.h"
#include "Bullet3OpenCL/BroadphaseCollision/b3GpuSapBroadphase.h"
#include "Bullet3OpenCL/Initialize/b3OpenCLUtils.h"
#include "Bullet3OpenCL/RigidBody/b3GpuNarrowPhase.h"
#include "Bullet3OpenCL/RigidBody/b3GpuRigidBodyPipeline.h"

namespace btgpu::tool {
namespace {

// While Bullet3 runs: its chatter goes nowhere, and if it ends the process (it does so on many errors), the tool's
// user is told. Costs a few microseconds.
class Bullet3Runs {
 public:
  Bullet3Runs() {
    if (s_nowhere < 0) {
      s_nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
      s_out = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0);
      s_err = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 0);
      std::atexit(explain);
    }
    std::fflush(stdout);
    dup2(s_nowhere, STDOUT_FILENO);
    dup2(s_nowhere, STDERR_FILENO);
    s_running = true;
  }
  ~Bullet3Runs() {
    std::fflush(stdout);
    restore();
  }
  Bullet3Runs(const Bullet3Runs&) = delete;
  Bullet3Runs& operator=(const Bullet3Runs&) = delete;

 private:
  static void restore() {
    dup2(s_out, STDOUT_FILENO);
    dup2(s_err, STDERR_FILENO);
    s_running = false;
  }
  static void explain() {
    if (!s_running) return;
    restore();
    std::fputs(
        "btgpu: bullet3: its pipeline ended the process, as it does on OpenCL errors; leave it out of --worlds\n",
        stderr);
    _exit(1);
  }
  static inline int s_nowhere = -1, s_out = -1, s_err = -1;
  static inline bool s_running = false;
};

// Bullet3 saves programs here; without a folder of its own it makes one in the current folder.
std::string cacheFolder() {
  namespace fs = std::filesystem;
  const auto get = [](const char* name) { return fs::path(std::getenv(name) ? std::getenv(name) : ""); };
  fs::path folder = get("BTGPU_CACHE_DIR");
  if (folder.empty() && !get("XDG_CACHE_HOME").empty()) folder = get("XDG_CACHE_HOME") / "btgpu";
  if (folder.empty()) folder = get("HOME") / ".cache" / "btgpu";
  std::error_code ignored;
  fs::create_directories(folder / "bullet3", ignored);
  return (folder / "bullet3").string();
}

template <typename Object, typename What, typename Getter>
std::string textOf(Getter getter, Object object, What what) {
  char text[512] = "";
  getter(object, what, sizeof text, text, nullptr);
  return text;
}

cl_device_id findDevice(const std::string& platformName, const std::string& deviceName) {
  cl_platform_id platforms[16];
  cl_uint platformCount = 0;
  clGetPlatformIDs(16, platforms, &platformCount);
  for (cl_uint p = 0; p < std::min<cl_uint>(16, platformCount); ++p) {
    if (textOf(clGetPlatformInfo, platforms[p], CL_PLATFORM_NAME) != platformName) continue;
    cl_device_id devices[16];
    cl_uint deviceCount = 0;
    clGetDeviceIDs(platforms[p], CL_DEVICE_TYPE_ALL, 16, devices, &deviceCount);
    for (cl_uint d = 0; d < std::min<cl_uint>(16, deviceCount); ++d) {
      if (textOf(clGetDeviceInfo, devices[d], CL_DEVICE_NAME) == deviceName) return devices[d];
    }
  }
  throw std::runtime_error("bullet3: no OpenCL device " + deviceName + "; 'btgpu info' lists them");
}

// Room as in Bullet3's demos, for as many bodies as there are.
b3Config configFor(int bodies) {
  b3Config config;
  config.m_maxConvexBodies = std::max(config.m_maxConvexBodies, bodies + 10);
  config.m_maxConvexShapes = config.m_maxConvexBodies;
  config.m_maxBroadphasePairs = 16 * config.m_maxConvexBodies;
  config.m_maxContactCapacity = config.m_maxBroadphasePairs;
  config.m_maxCompoundChildShapes = config.m_maxConvexBodies;
  return config;
}

class Bullet3World : public BenchWorld {
 public:
  Bullet3World(const Bullet3Scene& scene, const std::string& platform, const std::string& device)
      : m_name(device), m_bodies(static_cast<int>(scene.bodies.size())) {
    const cl_device_id id = findDevice(platform, device);
    const Bullet3Runs running;
    b3SetCustomPrintfFunc([](const char*) {});
    b3SetCustomWarningMessageFunc([](const char*) {});
    b3SetCustomErrorMessageFunc([](const char*) {});
    static const std::string folder = cacheFolder();  // Bullet3 keeps the pointer
    b3OpenCLUtils::setCachePath(folder.c_str());
    b3OpenCLUtils::getNumPlatforms(nullptr);  // makes it load OpenCL
    cl_int error = CL_SUCCESS;
    m_context = clCreateContext(nullptr, 1, &id, nullptr, nullptr, &error);
    if (m_context) m_queue = clCreateCommandQueue(m_context, id, 0, &error);
    if (!m_queue) throw std::runtime_error("bullet3: no OpenCL context on " + device + "; 'btgpu info' lists devices");
    const b3Config config = configFor(static_cast<int>(scene.bodies.size()));
    m_narrowphase = std::make_unique<b3GpuNarrowPhase>(m_context, id, m_queue, config);
    m_broadphase = std::make_unique<b3GpuSapBroadphase>(m_context, id, m_queue);
    m_hostBroadphase = std::make_unique<b3DynamicBvhBroadphase>(config.m_maxConvexBodies);
    m_pipeline = std::make_unique<b3GpuRigidBodyPipeline>(m_context, id, m_queue, m_narrowphase.get(),
                                                          m_broadphase.get(), m_hostBroadphase.get(), config);
    addBodies(scene);
  }

  // The queue and the context are left to the end of the process: Bullet3 still holds objects of theirs.
  ~Bullet3World() override {
    const Bullet3Runs running;
    clFinish(m_queue);
    m_pipeline.reset();
    m_hostBroadphase.reset();
    m_broadphase.reset();
    m_narrowphase.reset();
  }

  void step() override {
    const Bullet3Runs running;
    m_pipeline->stepSimulation(1 / 60.f);
    m_narrowphase->readbackAllBodiesToCpu();
    clFinish(m_queue);
  }

  StepCounts counts() override {
    const Bullet3Runs running;
    StepCounts counts;
    const int manifolds = m_narrowphase->getNumContactsGpu();
    const b3Contact4* contacts = manifolds ? m_narrowphase->getContactsCPU() : nullptr;
    long points = 0;
    for (int i = 0; i < manifolds; ++i) points += contacts[i].getNPoints();
    counts.manifolds = manifolds;
    counts.contacts = points;
    return counts;
  }

  int bodies() const override { return m_bodies; }
  std::string device() const override { return m_name; }

 private:
  int addShape(const Bullet3Shape& shape) {
    if (shape.radius > 0) return m_narrowphase->registerSphereShape(shape.radius);
    b3AlignedObjectArray<b3Vector3> corners;
    const float* h = shape.halfExtents;
    for (int i = 0; i < 8; ++i) {
      corners.push_back(b3MakeVector3(i & 1 ? h[0] : -h[0], i & 2 ? h[1] : -h[1], i & 4 ? h[2] : -h[2]));
    }
    m_hulls.push_back(std::make_unique<b3ConvexUtility>());
    m_hulls.back()->initializePolyhedralFeatures(&corners[0], corners.size(), true);
    return m_narrowphase->registerConvexHullShape(m_hulls.back().get());
  }

  void addBodies(const Bullet3Scene& scene) {
    std::vector<int> shapes;
    for (const Bullet3Shape& shape : scene.shapes) shapes.push_back(addShape(shape));
    int index = 0;
    for (Bullet3Body body : scene.bodies) {
      m_pipeline->registerPhysicsInstance(body.mass, body.position, body.orientation,
                                          shapes[static_cast<size_t>(body.shape)], index, false);
      m_narrowphase->setObjectVelocityCpu(body.linearVelocity, body.angularVelocity, index++);
    }
    m_pipeline->setGravity(scene.gravity);
    m_pipeline->writeAllInstancesToGpu();
    m_narrowphase->writeAllBodiesToGpu();
    m_broadphase->writeAabbsToGpu();
    clFinish(m_queue);
  }

  std::string m_name;
  int m_bodies;
  cl_context m_context = nullptr;
  cl_command_queue m_queue = nullptr;
  std::vector<std::unique_ptr<b3ConvexUtility>> m_hulls;
  std::unique_ptr<b3GpuNarrowPhase> m_narrowphase;
  std::unique_ptr<b3GpuSapBroadphase> m_broadphase;
  std::unique_ptr<b3DynamicBvhBroadphase> m_hostBroadphase;
  std::unique_ptr<b3GpuRigidBodyPipeline> m_pipeline;
};

}  // namespace

std::unique_ptr<BenchWorld> makeBullet3World(const Bullet3Scene& scene, const std::string& platform,
                                             const std::string& device) {
  return std::make_unique<Bullet3World>(scene, platform, device);
}

}  // namespace btgpu::tool
