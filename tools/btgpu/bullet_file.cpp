// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "bullet_file.h"

#include <BulletWorldImporter/btBulletWorldImporter.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>

namespace btgpu::tool {
namespace {

constexpr unsigned kImportSeconds = 60;  // a damaged file may also send the importer round in circles

// Bullet's importer reports on stdout, which belongs to the tool's own output.
class QuietStdout {
 public:
  QuietStdout() {
    std::fflush(stdout);
    m_saved = dup(STDOUT_FILENO);
    const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (null >= 0) {
      dup2(null, STDOUT_FILENO);
      close(null);
    }
  }
  ~QuietStdout() {
    std::fflush(stdout);
    dup2(m_saved, STDOUT_FILENO);
    close(m_saved);
  }
  QuietStdout(const QuietStdout&) = delete;
  QuietStdout& operator=(const QuietStdout&) = delete;

 private:
  int m_saved;
};

struct ImportedScene : SceneContents {
  explicit ImportedScene(btDiscreteDynamicsWorld& world) : importer(&world) {}
  ~ImportedScene() override { importer.deleteAllData(); }
  btBulletWorldImporter importer;
};

bool isFinite(const btVector3& v) { return std::isfinite(double(v.x() + v.y() + v.z())); }

bool isFinite(const btTransform& t) {
  return isFinite(t.getOrigin()) && isFinite(t.getBasis()[0]) && isFinite(t.getBasis()[1]) && isFinite(t.getBasis()[2]);
}

void checkObject(const std::string& path, int i, const btCollisionObject& object) {
  const auto fail = [&](const char* what) {
    throw InputError(fmt::format("{}: body {}: {}; the file is damaged", path, i, what));
  };
  const btCollisionShape* shape = object.getCollisionShape();
  if (!shape) fail("has no shape");
  if (shape->getShapeType() < 0 || shape->getShapeType() >= MAX_BROADPHASE_COLLISION_TYPES)
    fail("has an unknown shape");
  if (!isFinite(object.getWorldTransform())) fail("its pose is not finite");
  if (shape->getShapeType() != STATIC_PLANE_PROXYTYPE) {
    btVector3 lower, upper;
    shape->getAabb(btTransform::getIdentity(), lower, upper);
    if (!isFinite(lower) || !isFinite(upper) || (upper - lower).length2() > btScalar(1e24))
      fail("its size is not finite");
  }
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (!body) return;
  if (!isFinite(body->getLinearVelocity()) || !isFinite(body->getAngularVelocity())) fail("its velocity is not finite");
  if (!std::isfinite(double(body->getInvMass())) || body->getInvMass() < 0) fail("its mass is not a positive number");
  if (!isFinite(body->getInvInertiaDiagLocal())) fail("its inertia is not finite");
}

void load(const std::string& path, ImportedScene& scene, btDiscreteDynamicsWorld& world) {
  const QuietStdout quiet;
  if (!scene.importer.loadFile(path.c_str())) {
    throw InputError(fmt::format("{}: Bullet's importer does not take it; is it a .bullet file?", path));
  }
  if (world.getNumCollisionObjects() == 0) throw InputError(fmt::format("{}: holds no bodies", path));
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) checkObject(path, i, *world.getCollisionObjectArray()[i]);
}

}  // namespace

bool isBulletFile(const std::string& name) {
  constexpr const char* kEnding = ".bullet";
  const size_t length = std::strlen(kEnding);
  return name.size() > length && name.compare(name.size() - length, length, kEnding) == 0;
}

Builder builderOfFile(const std::string& path) {
  return [path](btDiscreteDynamicsWorld& world) -> std::unique_ptr<SceneContents> {
    if (!std::ifstream(path).good())
      throw InputError(fmt::format("{}: {}; check the path", path, std::strerror(errno)));
    auto scene = std::make_unique<ImportedScene>(world);
    load(path, *scene, world);
    return scene;
  };
}

void writeBulletFile(const scenes::Scene& scene, scenes::Size size, const std::string& path) {
  TestWorld<btDiscreteDynamicsWorld> world(builderOf(scene, size));
  btDefaultSerializer serializer;
  world.world().serialize(&serializer);
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(serializer.getBufferPointer()), serializer.getCurrentBufferSize());
  if (!file.flush())
    throw InputError(fmt::format("{}: can't be written: {}; check the path", path, std::strerror(errno)));
}

int runGuarded(const std::string& path, const std::function<int(const std::function<void()>&)>& work) {
  int channel[2];
  if (pipe2(channel, O_CLOEXEC) != 0) throw std::runtime_error("no pipe to the child process");
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no child process to read the file in");
  if (child == 0) {
    close(channel[0]);
    alarm(kImportSeconds);
    const int status = work([&] {
      alarm(0);
      const char done = 1;
      if (write(channel[1], &done, 1) != 1) _exit(1);
    });
    std::fflush(nullptr);
    _exit(status);
  }
  close(channel[1]);
  int status = 0;
  waitpid(child, &status, 0);
  char done = 0;
  const bool wasRead = read(channel[0], &done, 1) == 1;
  close(channel[0]);
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  const std::string signal = strsignal(WTERMSIG(status));
  if (!wasRead) {
    throw InputError(
        fmt::format("{}: Bullet's importer died on it ({}): the file is damaged, write it anew", path, signal));
  }
  throw std::runtime_error(fmt::format("the comparison died ({})", signal));
}

}  // namespace btgpu::tool
