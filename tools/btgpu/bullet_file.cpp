// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "bullet_file.h"

#include <BulletWorldImporter/btBulletWorldImporter.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace btgpu::tool {
namespace {

// What the importer may take: a damaged file may send it round in circles, or have it ask for all memory there is.
constexpr unsigned kImportSeconds = 60;     // by the clock, whatever it waits for
constexpr long kImportCpuSeconds = 3;       // of its own time, and as much for each kBytesPerShare
constexpr rlim_t kImportBytes = 1ul << 30;  // of memory beyond what the tool has, and 100 times the file's size
constexpr std::uintmax_t kBytesPerShare = 4u << 20;

// Figures beyond these are a damaged file's; single precision squares and multiplies them without overflow.
constexpr double kLargestLength = 1e9, kLargestMass = 1e12, kLargestGravity = 1e5, kLargestFactor = 10;
constexpr int kMostIterations = 10'000;
constexpr double kNoRotation = 0.01;  // of the axes' lengths and of their cosines

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

// False for NaN.
bool isWithin(double value, double lowest, double highest) { return value >= lowest && value <= highest; }

bool isWithin(const btVector3& v, double largest) {
  return isWithin(double(v.x()), -largest, largest) && isWithin(double(v.y()), -largest, largest) &&
         isWithin(double(v.z()), -largest, largest);
}

bool isRotation(const btMatrix3x3& m) {
  for (int row = 0; row < 3; ++row) {
    if (!isWithin(double(m[row].length()), 1 - kNoRotation, 1 + kNoRotation)) return false;
    if (!isWithin(double(m[row].dot(m[(row + 1) % 3])), -kNoRotation, kNoRotation)) return false;
  }
  return m.determinant() > 0;
}

void checkShape(const btCollisionShape& shape, const std::function<void(const char*)>& fail) {
  if (shape.getShapeType() < 0 || shape.getShapeType() >= MAX_BROADPHASE_COLLISION_TYPES) fail("has an unknown shape");
  if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE) {
    const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
    if (!isWithin(double(plane.getPlaneNormal().length()), 1 - kNoRotation, 1 + kNoRotation) ||
        !isWithin(double(plane.getPlaneConstant()), -kLargestLength, kLargestLength)) {
      fail("its plane is none");
    }
    return;
  }
  btVector3 lower, upper;
  shape.getAabb(btTransform::getIdentity(), lower, upper);
  if (!isWithin(lower, kLargestLength) || !isWithin(upper, kLargestLength)) fail("its size is not finite");
  if (lower.x() > upper.x() || lower.y() > upper.y() || lower.z() > upper.z()) fail("its size is negative");
}

void checkBody(const btRigidBody& body, const std::function<void(const char*)>& fail) {
  if (!isFinite(body.getLinearVelocity()) || !isFinite(body.getAngularVelocity())) fail("its velocity is not finite");
  const auto inverseMass = double(body.getInvMass());
  if (inverseMass != 0 && !isWithin(inverseMass, 1 / kLargestMass, kLargestMass))
    fail("its mass is not a positive number");
  if (!isFinite(body.getInvInertiaDiagLocal())) fail("its inertia is not finite");
  if (!isWithin(body.getLinearFactor(), kLargestFactor) || !isWithin(body.getAngularFactor(), kLargestFactor)) {
    fail("the factors of its motion are out of range");
  }
}

void checkObject(const std::string& path, int i, const btCollisionObject& object) {
  const std::function<void(const char*)> fail = [&](const char* what) {
    throw InputError(fmt::format("{}: body {}: {}; the file is damaged", path, i, what));
  };
  const btCollisionShape* shape = object.getCollisionShape();
  if (!shape) fail("has no shape");
  checkShape(*shape, fail);
  const btTransform& pose = object.getWorldTransform();
  if (!isWithin(pose.getOrigin(), kLargestLength)) fail("its pose is not finite");
  if (!isRotation(pose.getBasis())) fail("its pose is no rotation");
  if (!isWithin(double(object.getFriction()), 0, kLargestLength) ||
      !isWithin(double(object.getRestitution()), 0, kLargestFactor)) {
    fail("its friction or restitution is out of range");
  }
  if (const btRigidBody* body = btRigidBody::upcast(&object)) checkBody(*body, fail);
}

void checkSettings(const std::string& path, btDiscreteDynamicsWorld& world) {
  const auto fail = [&](const char* what) { throw InputError(fmt::format("{}: {}; the file is damaged", path, what)); };
  if (!isWithin(world.getGravity(), kLargestGravity)) fail("its gravity is out of range");
  const btContactSolverInfo& info = world.getSolverInfo();
  if (info.m_numIterations < 0 || info.m_numIterations > kMostIterations) {
    fail("its number of solver iterations is out of range");
  }
  // Shares, and lengths that penetrations are held against.
  for (const btScalar share : {info.m_sor, info.m_erp, info.m_erp2, info.m_warmstartingFactor, info.m_globalCfm,
                               info.m_linearSlop, info.m_splitImpulsePenetrationThreshold, info.m_splitImpulseTurnErp,
                               info.m_damping, info.m_tau, info.m_friction, info.m_restitution}) {
    if (!isWithin(double(share), -kLargestFactor, kLargestFactor)) fail("its solver settings are out of range");
  }
}

void checkWorld(const std::string& path, btDiscreteDynamicsWorld& world) {
  if (world.getNumCollisionObjects() == 0) throw InputError(fmt::format("{}: holds no bodies", path));
  checkSettings(path, world);
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) checkObject(path, i, *world.getCollisionObjectArray()[i]);
}

void load(const std::string& path, ImportedScene& scene, btDiscreteDynamicsWorld& world) {
  bool taken = false;
  try {
    taken = scene.importer.loadFile(path.c_str());
  } catch (const std::exception&) {
    // From the standard library, on strings and arrays that the file only promised.
  }
  if (!taken) throw InputError(fmt::format("{}: Bullet's importer does not take it; is it a .bullet file?", path));
  checkWorld(path, world);
}

std::string serialized(const btDiscreteDynamicsWorld& world) {
  btDefaultSerializer serializer;
  const_cast<btDiscreteDynamicsWorld&>(world).serialize(&serializer);
  return {reinterpret_cast<const char*>(serializer.getBufferPointer()),
          static_cast<size_t>(serializer.getCurrentBufferSize())};
}

rlim_t memoryInUse() {
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

// Limits this process for the rest of its life.
void limitForImport(const std::string& path) {
  std::error_code none;
  const std::uintmax_t found = std::filesystem::file_size(path, none);
  const std::uintmax_t size = none ? 0 : found;
  alarm(kImportSeconds);
  const itimerval time{{0, 0}, {kImportCpuSeconds * static_cast<long>(1 + size / kBytesPerShare), 0}};
  setitimer(ITIMER_PROF, &time, nullptr);
  rlimit memory{};
  getrlimit(RLIMIT_AS, &memory);
  memory.rlim_cur = std::min<rlim_t>(memory.rlim_max, memoryInUse() + kImportBytes + 100 * size);
  setrlimit(RLIMIT_AS, &memory);
  const rlimit noCore{0, 0};
  setrlimit(RLIMIT_CORE, &noCore);
}

std::string causeOf(int signal) {
  if (signal == SIGALRM || signal == SIGPROF) return "Bullet's importer does not come to an end on it";
  return fmt::format("Bullet's importer died on it ({})", strsignal(signal));
}

// In the child process: writes the world of the file to `channel`, or what is wrong with it. Returns the exit status.
int copyWorld(const std::string& path, int channel) {
  limitForImport(path);
  const QuietStdout quiet;
  dup2(STDOUT_FILENO, STDERR_FILENO);  // nor does what a debug build or a sanitizer says of a damaged file belong there
  std::string answer;
  int status = 0;
  try {
    TestWorld<btDiscreteDynamicsWorld> world([&path](btDiscreteDynamicsWorld& empty) {
      auto scene = std::make_unique<ImportedScene>(empty);
      load(path, *scene, empty);
      return scene;
    });
    answer = serialized(world.world());
  } catch (const InputError& e) {
    answer = e.what();
    status = 1;
  } catch (const std::exception&) {  // out of the memory that it was given
    status = 1;
  }
  size_t written = 0;
  while (written < answer.size()) {
    const ssize_t n = write(channel, answer.data() + written, answer.size() - written);
    if (n <= 0) return 1;
    written += static_cast<size_t>(n);
  }
  return status;
}

std::string readAll(int channel) {
  std::string text;
  char buffer[65536];
  for (ssize_t n; (n = read(channel, buffer, sizeof buffer)) != 0;) {
    if (n > 0) text.append(buffer, static_cast<size_t>(n));
    if (n < 0 && errno != EINTR) break;
  }
  return text;
}

// The world of a file, written anew by a child process: the importer may die, hang or spoil memory in there.
std::string copyOfWorld(const std::string& path) {
  int channel[2];
  if (pipe2(channel, O_CLOEXEC) != 0) throw std::runtime_error("no pipe to the child process");
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no child process to read the file in");
  if (child == 0) {
    close(channel[0]);
    _exit(copyWorld(path, channel[1]));
  }
  close(channel[1]);
  std::string answer = readAll(channel[0]);
  close(channel[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) {
    throw InputError(fmt::format("{}: {}: the file is damaged, write it anew", path, causeOf(WTERMSIG(status))));
  }
  if (status != 0)
    throw InputError(answer.empty() ? fmt::format("{}: can't be read: the file is damaged, write it anew", path)
                                    : answer);
  return answer;
}

}  // namespace

bool isBulletFile(const std::string& name) {
  constexpr const char* kEnding = ".bullet";
  const size_t length = std::strlen(kEnding);
  return name.size() > length && name.compare(name.size() - length, length, kEnding) == 0;
}

Builder builderOfFile(const std::string& path) {
  if (access(path.c_str(), R_OK) != 0) {
    throw InputError(fmt::format("{}: {}; check the path", path, std::strerror(errno)));
  }
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) {
    throw InputError(fmt::format("{}: is no regular file; is it a .bullet file?", path));
  }
  return [path, copy = copyOfWorld(path)](btDiscreteDynamicsWorld& world) -> std::unique_ptr<SceneContents> {
    auto scene = std::make_unique<ImportedScene>(world);
    std::string bytes = copy;  // the importer works in it
    const QuietStdout quiet;
    if (!scene->importer.loadFileFromMemory(bytes.data(), static_cast<int>(bytes.size()))) {
      throw std::runtime_error(fmt::format("{}: its copy could not be read", path));
    }
    checkWorld(path, world);
    return scene;
  };
}

void writeBulletFile(const scenes::Scene& scene, scenes::Size size, const std::string& path) {
  const TestWorld<btDiscreteDynamicsWorld> world(builderOf(scene, size));
  std::ofstream file(path, std::ios::binary);
  file << serialized(world.world());
  if (!file.flush())
    throw InputError(fmt::format("{}: can't be written: {}; check the path", path, std::strerror(errno)));
}

}  // namespace btgpu::tool
