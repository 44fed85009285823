// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The same world gives the same bits after 100 steps, or the long list's 300, in which most bodies fall asleep, whatever
// happens around it. The hash covers poses, velocities and sleep of all bodies after every one of the steps, so that a
// difference can't heal unseen.
#include <gtest/gtest.h>

#include <future>
#include <sstream>

#include "hashed_run.h"
#include "tests/support/subprocess.h"

namespace btgpu::test {
namespace {

int steps() {
  const char* asked = std::getenv("BTGPU_TEST_STEPS");
  return asked ? std::atoi(asked) : 100;
}
const int kSteps = steps();
const RunPlan kStack{"stack", {6, 6, 6}, kSteps};
const RunPlan kShort{"stack", {3, 3, 3}, 30};
const RunPlan kMixed{"mixed", {6, 6, 6}, kSteps};

bool gpuShape() {
  const char* shape = std::getenv("BTGPU_KERNEL_SHAPE");
  return shape && std::string(shape) == "gpu";
}
std::string otherShape() { return gpuShape() ? "cpu" : "gpu"; }

// Spreads the small scene over many work items in the CPU's shape; the GPU's has several work-groups anyway.
std::string manyItems() { return gpuShape() ? "BTGPU_GRAIN" : "BTGPU_GRAIN=8"; }

RunOutcome runHere(const RunPlan& plan) {
  HashedRun run(plan);
  run.step(plan.steps);
  return run.outcome();
}

RunOutcome runElsewhere(const RunPlan& plan, const std::vector<std::string>& environment) {
  RunOptions options;
  options.environment = environment;
  const Finished f = runProgram({HASH_RUN, plan.scene, std::to_string(plan.size.x), std::to_string(plan.size.y),
                                 std::to_string(plan.size.z), std::to_string(plan.steps)},
                                options);
  EXPECT_EQ(f.exitCode, 0) << f.err;
  RunOutcome o;
  std::istringstream line(f.out);
  line >> std::hex >> o.hash >> std::dec >> o.deviceSteps >> o.stockSteps >> o.repeatedSteps >> o.colours >> o.asleep >>
      o.programsBuilt >> o.programsLoaded;
  EXPECT_TRUE(line) << f.out;
  return o;
}

void expectAllSteps(const RunOutcome& o, int steps = kSteps) {
  EXPECT_EQ(o.deviceSteps, static_cast<unsigned long long>(steps));
  EXPECT_EQ(o.stockSteps, 0u);
}

// What every other run has to give; made once.
const RunOutcome& stack() {
  static const RunOutcome outcome = runHere(kStack);
  return outcome;
}
const RunOutcome& mixed() {
  static const RunOutcome outcome = runHere(kMixed);
  return outcome;
}

// Without contacts in several colours, sleep and time to warm start there is little that could differ.
TEST(Determinism, SceneIsWorthHashing) {
  expectAllSteps(stack());
  EXPECT_GE(stack().colours, 6u);
  // Nothing sleeps yet in the short list's steps; the long list's see to that.
  if (kSteps >= 300) {
    EXPECT_GE(stack().asleep, 100);
  }
  expectAllSteps(mixed());
  EXPECT_GE(mixed().colours, 6u);
  EXPECT_NE(stack().hash, mixed().hash);
}

TEST(Determinism, SameProcess) {
  EXPECT_EQ(runHere(kStack).hash, stack().hash);
  EXPECT_EQ(runHere(kMixed).hash, mixed().hash);
}

TEST(Determinism, NumberOfThreads) {
  for (const char* threads : {"POCL_MAX_PTHREAD_COUNT=1", "POCL_MAX_PTHREAD_COUNT=2"}) {
    const RunOutcome a = runElsewhere(kStack, {threads, manyItems()}), b = runElsewhere(kMixed, {threads, manyItems()});
    expectAllSteps(a);
    expectAllSteps(b);
    EXPECT_EQ(a.hash, stack().hash) << threads;
    EXPECT_EQ(b.hash, mixed().hash) << threads;
  }
}

// Into how many pieces the work is cut.
TEST(Determinism, NumberOfWorkItems) {
  for (const char* grain : {"BTGPU_GRAIN=1", "BTGPU_GRAIN=99999"}) {
    EXPECT_EQ(runElsewhere(kMixed, {grain}).hash, mixed().hash) << grain;
  }
}

TEST(Determinism, KernelShape) {
  const std::string shape = "BTGPU_KERNEL_SHAPE=" + otherShape();
  EXPECT_EQ(runElsewhere(kStack, {shape}).hash, stack().hash) << shape;
  EXPECT_EQ(runElsewhere(kMixed, {shape}).hash, mixed().hash) << shape;
}

// A program from the cache on disk is the one that was built.
TEST(Determinism, CacheOfPrograms) {
  const TemporaryFolder folder;
  const std::vector<std::string> environment = {"BTGPU_CACHE_DIR=" + folder.file("btgpu"),
                                                "POCL_CACHE_DIR=" + folder.file("pocl")};
  const RunOutcome built = runElsewhere(kStack, environment);
  const RunOutcome loaded = runElsewhere(kStack, environment);
  EXPECT_GT(built.programsBuilt, 0);
  EXPECT_EQ(built.programsLoaded, 0);
  EXPECT_EQ(loaded.programsBuilt, 0);
  EXPECT_EQ(loaded.programsLoaded, built.programsBuilt);
  EXPECT_EQ(built.hash, stack().hash);
  EXPECT_EQ(loaded.hash, stack().hash);
}

// Eight processes build the same programs and write them to the same empty cache at once: each gets its bits, and what
// they leave is whole (a program a step is saved).
TEST(Determinism, CacheWrittenByManyProcessesAtOnce) {
  const TemporaryFolder cache;
  const std::string variable = "BTGPU_CACHE_DIR=" + cache.path().string();
  std::vector<std::future<RunOutcome>> processes;
  for (int i = 0; i < 8; ++i) {
    processes.push_back(std::async(std::launch::async, [&] { return runElsewhere(kShort, {variable}); }));
  }
  for (auto& process : processes) EXPECT_EQ(process.get().hash, runHere(kShort).hash);
  const RunOutcome after = runElsewhere(kShort, {variable});
  EXPECT_EQ(after.programsBuilt, 0);
  EXPECT_GT(after.programsLoaded, 0);
}

// An engine that has seen no body yet starts with room for 256 pairs, and steps that need more are done
// again.
TEST(Determinism, RepeatedSteps) {
  for (const RunPlan& plan : {kStack, kMixed}) {
    RunPlan roomy = plan, late = plan;
    roomy.pairCapacity = 20000;
    late.emptyStep = true;
    const RunOutcome a = runHere(roomy), b = runHere(late);
    const RunOutcome& expected = plan.scene == "stack" ? stack() : mixed();
    expectAllSteps(b, kSteps + 1);
    EXPECT_GT(b.repeatedSteps, a.repeatedSteps);
    EXPECT_EQ(a.hash, expected.hash) << plan.scene;
    EXPECT_EQ(b.hash, expected.hash) << plan.scene;
  }
}

// Nothing stays behind in the device, its programs or the plugin.
TEST(Determinism, AfterAnotherWorld) {
  RunPlan other = kMixed;
  other.size = {9, 3, 5};
  other.steps = 20;
  expectAllSteps(runHere(other), other.steps);
  EXPECT_EQ(runHere(kStack).hash, stack().hash);
}

TEST(Determinism, TwoWorldsInTurns) {
  HashedRun a(kStack), b(kMixed);
  for (int i = 0; i < kSteps; ++i) {
    a.step();
    b.step();
  }
  EXPECT_EQ(a.outcome().hash, stack().hash);
  EXPECT_EQ(b.outcome().hash, mixed().hash);
}

// Bodies 20, 30 and 40 of a stack go in one order or the other, between the same steps, and come back in one or the
// other.
std::uint64_t hashOfExchange(const std::vector<size_t>& going, const std::vector<size_t>& coming) {
  HashedRun run(kStack);
  run.step(60);
  btGpuDynamicsWorld& world = run.world();
  const auto& bodies = run.objects().bodies();
  for (const size_t i : going) world.removeRigidBody(bodies[i]);
  run.step(10);
  for (const size_t i : coming) world.addRigidBody(bodies[i]);
  run.step(100);
  // Body by body, since removing changes the order of the world's own array.
  WorldHash hash;
  for (const btRigidBody* body : bodies) hash.add(*body);
  return hash.value();
}

// An index is a free slot, the lowest first, given in the order in which bodies were added (docs/determinism.md): which
// ones went first plays no part, which ones came first does.
TEST(Determinism, RemovedInAnotherOrder) {
  const std::uint64_t expected = hashOfExchange({20, 30, 40}, {20, 30, 40});
  EXPECT_EQ(hashOfExchange({40, 20, 30}, {20, 30, 40}), expected);
  EXPECT_EQ(hashOfExchange({30, 40, 20}, {20, 30, 40}), expected);
  EXPECT_NE(hashOfExchange({20, 30, 40}, {40, 30, 20}), expected)
      << "as in stock, the order of adding is part of the world";
}

// Settings that are made again between steps.
TEST(Determinism, ConfiguredAgain) {
  HashedRun run(kStack);
  for (int i = 0; i < kSteps; i += 50) {
    run.step(50);
    btGpuSettings settings;
    settings.m_bodyCapacity = 1000 + i;
    btGpuDynamicsWorld::configure(&run.world(), settings);
  }
  EXPECT_EQ(run.outcome().hash, stack().hash);
}

// Or the hash would see nothing.
TEST(Determinism, OneUlpOfOneBody) {
  for (const int body : {1, 216}) {
    RunPlan changed = kStack;
    changed.changedBody = body;
    EXPECT_NE(runHere(changed).hash, stack().hash) << "body " << body;
  }
}

}  // namespace
}  // namespace btgpu::test
