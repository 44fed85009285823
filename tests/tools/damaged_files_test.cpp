// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Damaged .bullet files: whatever is wrong with one, the tool neither dies nor hangs nor computes with NaN. It compares
// what is in there (all figures finite) or says in one line what is wrong.
// BTGPU_TOOL is the path of the binary, BTGPU_DOUBLE_WRITER of the helper that writes a double-precision file.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/support/subprocess.h"
#include "tests/support/world_of.h"

namespace btgpu::test {
namespace {

using nlohmann::json;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kHuge = 1e30f;
constexpr int kCopies = 100;       // of each of the two files
constexpr unsigned kSeconds = 60;  // for three steps of 65 bodies, on a machine that does other things as well

struct Damage {
  std::string bytes, kind;
};

Damage flipBits(std::string bytes, std::mt19937& random) {
  constexpr int kCounts[] = {1, 1, 2, 4, 16, 64, 512};
  const int count = kCounts[random() % std::size(kCounts)];
  for (int i = 0; i < count; ++i) bytes[random() % bytes.size()] ^= static_cast<char>(1u << random() % 8);
  return {bytes, std::to_string(count) + " bits flipped"};
}

Damage truncate(const std::string& bytes, std::mt19937& random) {
  const size_t length = random() % bytes.size();
  return {bytes.substr(0, length), "cut off at " + std::to_string(length)};
}

Damage overwrite(std::string bytes, std::mt19937& random) {
  constexpr size_t kLengths[] = {4, 16, 64, 256};
  const size_t length = kLengths[random() % std::size(kLengths)], from = random() % (bytes.size() - length);
  for (size_t i = 0; i < length; ++i) bytes[from + i] = static_cast<char>(random());
  return {bytes, std::to_string(length) + " bytes overwritten at " + std::to_string(from)};
}

// JSON has no NaN and no infinity: such a figure is null.
bool allFinite(const json& value) {
  if (value.is_null()) return false;
  if (!value.is_structured()) return true;
  for (const json& part : value) {
    if (!allFinite(part)) return false;
  }
  return true;
}

struct Outcome {
  bool refused = false;
  std::string message;
};

class DamagedFiles : public testing::Test {
 protected:
  Outcome compare(const std::string& bytes) {
    const std::string path = m_folder.file("damaged.bullet"), result = m_folder.file("result.json");
    writeFile(path, bytes);
    std::filesystem::remove(result);
    const Finished run = runProgram({BTGPU_TOOL, "compare", path, "--steps", "3", "--json", result}, {{}, kSeconds});
    EXPECT_EQ(run.signal, 0);
    if (run.exitCode == 2) {
      EXPECT_EQ(run.errLines().size(), 1u) << run.err;
      EXPECT_EQ(run.err.rfind("btgpu: " + path, 0), 0u) << run.err;
      EXPECT_EQ(run.out, "");
      return {true, run.err};
    }
    EXPECT_TRUE(run.exitCode == 0 || run.exitCode == 1) << run.exitCode;
    EXPECT_TRUE(std::filesystem::exists(result)) << run.err;
    const std::string text = readFile(result);
    EXPECT_TRUE(!text.empty() && allFinite(json::parse(text))) << text;
    return {false, run.err};
  }

  void tryCopies(const std::string& whole, unsigned seed) {
    std::mt19937 random(seed);
    int refused = 0, compared = 0;
    for (int i = 0; i < kCopies; ++i) {
      const Damage damage = i % 3 == 0   ? flipBits(whole, random)
                            : i % 3 == 1 ? truncate(whole, random)
                                         : overwrite(whole, random);
      SCOPED_TRACE(std::to_string(i) + ": " + damage.kind);
      ++(compare(damage.bytes).refused ? refused : compared);
    }
    // Else the damage was too small, or too large, to show anything.
    EXPECT_GT(refused, 0);
    EXPECT_GT(compared, 0);
  }

  TemporaryFolder m_folder;
};

TEST_F(DamagedFiles, Float) { tryCopies(readFile(BTGPU_SOURCE_DIR "/samples/scenes/mixed.bullet"), 1); }

TEST_F(DamagedFiles, Double) {
  const std::string path = m_folder.file("double.bullet");
  ASSERT_EQ(runProgram({BTGPU_DOUBLE_WRITER, path, "mixed"}).exitCode, 0);
  const std::string whole = readFile(path);
  ASSERT_EQ(whole.substr(0, 7), "BULLETd");
  ASSERT_GT(whole.size(), 40000u);
  tryCopies(whole, 2);
}

// Files that are whole, of worlds that no simulation survives: one figure wrong in each.
TEST_F(DamagedFiles, EachFigureIsChecked) {
  using World = WorldOf<btDiscreteDynamicsWorld>;
  struct Case {
    const char* named;  // in the message
    std::function<void(World&, btRigidBody&)> spoil;
  };
  const auto turned = [](float scale) {
    btMatrix3x3 basis = btMatrix3x3::getIdentity();
    basis[1] *= scale;
    return btTransform(basis, btVector3(0, 0, 0));
  };
  const std::vector<Case> cases = {
      {"gravity", [](World& w, btRigidBody&) { w.world.setGravity(btVector3(0, kNan, 0)); }},
      {"gravity", [](World& w, btRigidBody&) { w.world.setGravity(btVector3(0, -kHuge, 0)); }},
      {"iterations", [](World& w, btRigidBody&) { w.world.getSolverInfo().m_numIterations = 2'000'000'000; }},
      {"iterations", [](World& w, btRigidBody&) { w.world.getSolverInfo().m_numIterations = -1; }},
      {"settings", [](World& w, btRigidBody&) { w.world.getSolverInfo().m_sor = kNan; }},
      {"settings", [](World& w, btRigidBody&) { w.world.getSolverInfo().m_erp2 = kHuge; }},
      {"body 1: its pose", [&](World&, btRigidBody& b) { b.setWorldTransform(turned(kNan)); }},
      {"body 1: its pose", [&](World&, btRigidBody& b) { b.setWorldTransform(turned(1000)); }},
      {"body 1: its pose", [&](World&, btRigidBody& b) { b.setWorldTransform(turned(-1)); }},
      {"body 1: its pose",
       [](World&, btRigidBody& b) {
         b.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(kHuge, 0, 0)));
       }},
      {"body 1: its friction", [](World&, btRigidBody& b) { b.setFriction(kNan); }},
      {"body 1: its friction", [](World&, btRigidBody& b) { b.setRestitution(kHuge); }},
      {"body 1: the factors", [](World&, btRigidBody& b) { b.setLinearFactor(btVector3(1, kNan, 1)); }},
      {"body 1: the factors", [](World&, btRigidBody& b) { b.setAngularFactor(btVector3(kHuge, 1, 1)); }},
      {"body 1: its mass", [](World&, btRigidBody& b) { b.setMassProps(kHuge, btVector3(1, 1, 1)); }},
      {"body 1: its mass", [](World&, btRigidBody& b) { b.setMassProps(-1, btVector3(1, 1, 1)); }},
      {"body 1: its size", [](World& w, btRigidBody& b) { b.setCollisionShape(w.objects.sphere(kHuge)); }},
      {"body 1: its size", [](World& w, btRigidBody& b) { b.setCollisionShape(w.objects.sphere(-1)); }},
      {"body 1: its plane",
       [](World& w, btRigidBody& b) {
         b.setMassProps(0, btVector3(0, 0, 0));
         b.setCollisionShape(w.objects.plane(btVector3(0, 1, 0), kNan));
       }},
  };
  for (size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(std::to_string(i) + ": " + cases[i].named);
    World run;
    run.world.setGravity(btVector3(0, -10, 0));
    run.objects.add(1, run.objects.sphere(1), btVector3(5, 0, 0));
    btRigidBody* body = run.objects.add(1, run.objects.box(btVector3(1, 1, 1)), btVector3(0, 0, 0));
    cases[i].spoil(run, *body);
    const Outcome outcome = compare(serialized(run.world));
    EXPECT_TRUE(outcome.refused);
    EXPECT_NE(outcome.message.find(cases[i].named), std::string::npos) << outcome.message;
  }
}

}  // namespace
}  // namespace btgpu::test
