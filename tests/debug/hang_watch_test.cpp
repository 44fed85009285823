// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The log of launches: complete, there while a kernel still runs, and naming the one that hangs.
#include "gpu_engine/debug/hang_watch.h"

#include <chrono>
#include <cstdlib>
#include <thread>

#include "gpu_engine/opencl/kernel.h"
#include "gpu_engine/world_engine.h"
#include "kernels/shared/team.h"
#include "tests/support/device_test.h"
#include "tests/support/mixed_world.h"
#include "tests/support/scoped_environment.h"
#include "tests/support/subprocess.h"

namespace btgpu {
namespace {

size_t countOf(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++count;
  return count;
}

class HangWatchTest : public DeviceTest {
 protected:
  std::string logged() const { return test::readFile(m_log); }
  void watchFor(double seconds) { m_queue.setRecorder(std::make_unique<HangWatch>(seconds, m_log, "a device")); }

  // One round whose first part takes `delay` turns.
  void playSlowly(uint delay) {
    DeviceArray<uint> parts("parts"), values("values"), last("last values"), visits("visits"), impatient("impatient"),
        team("team");
    parts.copyFromHost(queue(), {1});
    values.copyFromHost(queue(), {1});
    last.copyFromHost(queue(), {1});
    visits.copyFromHost(queue(), {0});
    impatient.copyFromHost(queue(), {0});
    team.copyFromHost(queue(), std::vector<uint>(TEAM_SIZE, 0));
    Kernel play(device(), "primitives/team_rounds.cl", "playRounds");
    queue().enterStep(7);
    queue().enterStage("99_play");
    play.launch(queue(), {1, 1}, 1u, 1u, 0u, delay, parts, values, last, visits, impatient, team);
    queue().leaveStep();
  }

  test::TemporaryFolder m_folder;
  const std::string m_log = m_folder.file("watch.log");
};

const std::string kPlay = "step 7 99_play playRounds of primitives/team_rounds.cl, 1 x 1";

TEST_F(HangWatchTest, ASlowKernelIsNamed) {
  watchFor(0.02);
  testing::internal::CaptureStderr();
  playSlowly(200'000'000);
  const std::string said = testing::internal::GetCapturedStderr(), log = logged();
  const size_t begins = log.find(kPlay + " begins\n"), hangs = log.find(kPlay + " has been running for 0.02 s"),
               ends = log.find(kPlay + " ends, ");
  EXPECT_LT(begins, hangs) << log;
  EXPECT_LT(hangs, ends) << log;
  EXPECT_NE(ends, std::string::npos) << log;
  EXPECT_EQ(countOf(log, "seems to hang"), 1u) << log;
  EXPECT_EQ(countOf(said, "btgpu: " + kPlay + " has been running"), 1u) << said;
}

TEST_F(HangWatchTest, AQuickKernelIsNot) {
  watchFor(60);
  testing::internal::CaptureStderr();
  for (int i = 0; i < 3; ++i) playSlowly(0);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(countOf(logged(), " begins\n"), 3u);
  EXPECT_EQ(countOf(logged(), " ends, "), 3u);
  EXPECT_EQ(countOf(logged(), "seems to hang"), 0u);
}

// The time between two launches is nobody's fault.
TEST_F(HangWatchTest, NothingHangsBetweenLaunches) {
  watchFor(0.5);
  testing::internal::CaptureStderr();
  playSlowly(0);
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  playSlowly(0);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(countOf(logged(), "seems to hang"), 0u) << logged();
}

// Each line is in the file at once: what a kernel that never ends leaves behind.
TEST_F(HangWatchTest, LinesAreThereWhileAKernelRuns) {
  HangWatch watch(0.05, m_log, "a device");
  watch.enterStep(queue(), 3);
  watch.enterStage(queue(), "44_test");
  Launch launch;
  launch.file = "f.cl";
  launch.name = "spin";
  launch.grid = {256, 128};
  testing::internal::CaptureStderr();
  watch.beforeLaunch(queue(), launch);
  EXPECT_NE(logged().find("step 3 44_test spin of f.cl, 2 x 128 begins\n"), std::string::npos) << logged();
  for (int i = 0; i < 500 && countOf(logged(), "seems to hang\n") == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(countOf(logged(), "spin of f.cl, 2 x 128 has been running for 0.05 s and seems to hang\n"), 1u) << logged();
  EXPECT_EQ(countOf(logged(), " ends"), 0u);
  watch.afterLaunch(queue());
  testing::internal::GetCapturedStderr();
}

// An engine, switched on by the environment; the file is appended to.
TEST_F(HangWatchTest, WholeSteps) {
  test::writeFile(m_log, "what was there\n");
  const ScopedVariable on("BTGPU_WATCH", "1"), where("BTGPU_WATCH_FILE", m_log);
  StepResults results;
  {
    WorldEngine engine({});
    engine.begin(mixedWorld(), {});
    engine.finish(results);
  }
  const std::string log = logged();
  EXPECT_EQ(log.rfind("what was there\n", 0), 0u);
  EXPECT_NE(log.find("limit 10 s\n"), std::string::npos);
  EXPECT_EQ(countOf(log, " begins\n"), static_cast<size_t>(results.launches));
  EXPECT_EQ(countOf(log, " ends, "), static_cast<size_t>(results.launches));
  EXPECT_EQ(countOf(log, " step 0 "), 2 * static_cast<size_t>(results.launches));
  for (const char* stage : {"10_apply_forces", "44_find_separating_axis", "70_solve_velocities"}) {
    EXPECT_GE(countOf(log, stage), 2u) << stage;
  }
}

// With a capture and hashes at the same time.
TEST_F(HangWatchTest, BesideACapture) {
  const std::string hashes = m_folder.file("hashes");
  const ScopedVariable hash("BTGPU_STAGE_HASHES", hashes);
  const ScopedVariable on("BTGPU_WATCH", "5"), where("BTGPU_WATCH_FILE", m_log), what("BTGPU_CAPTURE", "10@0"),
      to("BTGPU_CAPTURE_FILE", m_folder.file("forces"));
  StepResults results;
  WorldEngine engine({});
  engine.begin(mixedWorld(), {});
  engine.finish(results);
  EXPECT_TRUE(std::filesystem::exists(m_folder.file("forces")));
  EXPECT_EQ(countOf(logged(), " ends, "), static_cast<size_t>(results.launches));
  EXPECT_EQ(countOf(test::readFile(hashes), " 0 10_apply_forces "), 1u);
  EXPECT_EQ(countOf(test::readFile(hashes), " 0 90_update_activation "), 1u);
}

TEST_F(HangWatchTest, SettingsThatMakeNoSense) {
  {
    const ScopedVariable hash("BTGPU_STAGE_HASHES", m_folder.file("no/such/file"));
    EXPECT_THROW(WorldEngine({}), OpenClError);
  }
  for (const char* limit : {"x", "-1", "0.0", "1s", "nan", "inf", "1e9"}) {
    const ScopedVariable on("BTGPU_WATCH", limit), where("BTGPU_WATCH_FILE", m_log);
    EXPECT_THROW(WorldEngine({}), OpenClError) << limit;
  }
  const ScopedVariable on("BTGPU_WATCH", "1"), where("BTGPU_WATCH_FILE", m_folder.file("no/such/file"));
  EXPECT_THROW(WorldEngine({}), OpenClError);
  const ScopedVariable off("BTGPU_WATCH", "0");
  EXPECT_NO_THROW(WorldEngine({}));
}

}  // namespace
}  // namespace btgpu
