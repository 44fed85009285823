// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The bits of every built-in scene, as they were when somebody looked at them last (tests/data/golden_hashes.json).
// They hold for one device with one driver and one instruction set: what is not in the file is skipped by name, and
// prints the entry that a person may add after looking at `btgpu compare`. A change of kernels that is meant to change
// bits changes the file in the same commit.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "hashed_run.h"
#include "tests/support/subprocess.h"

namespace btgpu::test {
namespace {

constexpr int kSteps = 60;

std::uint64_t hashOf(const scenes::Scene& scene) {
  RunPlan plan;
  plan.scene = scene.name;
  plan.size = scene.size;
  HashedRun run(plan);
  run.step(kSteps);
  EXPECT_EQ(run.outcome().deviceSteps, unsigned(kSteps)) << scene.name;
  return run.outcome().hash;
}

// PoCL's device name holds the instruction set that it compiles for.
std::string keyOfDevice() {
  RunPlan plan;
  HashedRun run(plan);
  run.step();
  const auto state = findState(&run.world());
  if (!state->engine) return "no device";
  const EngineInfo info = state->engine->info();
  return info.device + " | " + info.version + " | driver " + info.driver + " | " + info.kernelShape + " shape";
}

TEST(Golden, EverySceneHasItsBits) {
  const std::string file = std::string(BTGPU_SOURCE_DIR) + "/tests/data/golden_hashes.json";
  const nlohmann::json known = nlohmann::json::parse(readFile(file));
  const std::string key = keyOfDevice();
  ASSERT_NE(key, "no device");
  nlohmann::json actual;
  for (const scenes::Scene& scene : scenes::all()) {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hashOf(scene)));
    actual[scene.name] = text;
  }
  if (!known.contains(key)) GTEST_SKIP() << "no hashes of this device: " << nlohmann::json{{key, actual}}.dump(2);
  EXPECT_EQ(actual, known.at(key)) << key;
}

}  // namespace
}  // namespace btgpu::test
