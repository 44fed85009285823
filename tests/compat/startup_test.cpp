// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// An application linked with btgpu starts and goes on, whatever is missing or broken around it, and says so once.
// Each case is a process of its own (startup_app.cpp), since loader, driver and caches are looked at once a process.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "tests/support/subprocess.h"

namespace btgpu::test {
namespace {

namespace fs = std::filesystem;

struct AppRun {
  std::map<std::string, std::string> values;
  std::vector<std::string> errors;
  double seconds() const { return std::stod(values.at("firstStepSeconds")); }
};

AppRun runApp(std::vector<std::string> environment) {
  RunOptions options;
  options.environment = std::move(environment);
  const Finished finished = runProgram({BTGPU_STARTUP_APP}, options);
  EXPECT_EQ(finished.exitCode, 0) << "signal " << finished.signal << "\n" << finished.err;
  AppRun run;
  for (const std::string& line : finished.outLines()) {
    const size_t space = line.find(' ');
    run.values[line.substr(0, space)] = space == std::string::npos ? "" : line.substr(space + 1);
  }
  run.errors = finished.errLines();
  return run;
}

void expectStockPath(AppRun& run, const std::string& cause) {
  EXPECT_EQ(run.values["loaderAtStart"], "0") << "btgpu itself must not need OpenCL";
  EXPECT_EQ(run.values["device"], "");
  EXPECT_EQ(run.values["deviceSteps"], "0");
  EXPECT_EQ(run.values["stockSteps"], "30");
  EXPECT_EQ(run.values["sameAsStock"], "1") << "bit for bit";
  EXPECT_NE(run.values["fallback"].find(cause), std::string::npos) << run.values["fallback"];
  ASSERT_EQ(run.errors.size(), 1u) << "two worlds, one line";
  EXPECT_NE(run.errors[0].find(cause), std::string::npos) << run.errors[0];
  EXPECT_NE(run.errors[0].find("install"), std::string::npos) << "the cure: " << run.errors[0];
}

void expectOnDevice(AppRun& run) {
  EXPECT_NE(run.values["device"], "");
  EXPECT_EQ(run.values["deviceSteps"], "30");
  EXPECT_EQ(run.values["stockSteps"], "0");
  EXPECT_EQ(run.values["sameAsStock"], "0") << "another order of rows: equal bits would mean that stock ran";
  // Half a second of falling and first contacts: the two agree to far below the size of a body.
  EXPECT_LT(std::stod(run.values["meanDistance"]), 0.05);
  EXPECT_EQ(run.values.count("fallback"), 0u) << run.values["fallback"];
}

// A copy of the engine that asks for a loader of another name is as good as a machine without one.
std::string engineWithoutLoader(const TemporaryFolder& folder) {
  std::string engine = readFile(BTGPU_ENGINE_FILE);
  const std::string wanted = "libOpenCL.so.1", missing = "libHidden.so.1";
  size_t found = 0;
  for (size_t at = engine.find(wanted); at != std::string::npos; at = engine.find(wanted, at), ++found) {
    engine.replace(at, wanted.size(), missing);
  }
  EXPECT_GT(found, 0u) << "the engine names its loader";
  writeFile(folder.file("engine.so"), engine);
  return folder.file("engine.so");
}

TEST(Startup, WithoutLoader) {
  const TemporaryFolder folder;
  AppRun run = runApp({"BTGPU_ENGINE=" + engineWithoutLoader(folder)});
  expectStockPath(run, "libHidden.so.1");
}

TEST(Startup, WithoutEngine) {
  const TemporaryFolder folder;
  AppRun run = runApp({"BTGPU_ENGINE=" + folder.file("none.so")});
  expectStockPath(run, "none.so");
}

TEST(Startup, EngineThatIsNoLibrary) {
  const TemporaryFolder folder;
  writeFile(folder.file("engine.so"), "no library");
  AppRun run = runApp({"BTGPU_ENGINE=" + folder.file("engine.so")});
  expectStockPath(run, "engine.so");
}

TEST(Startup, LoaderWithoutDevice) {
  const TemporaryFolder folder;
  fs::create_directory(folder.file("vendors"));
  AppRun run = runApp({"OCL_ICD_VENDORS=" + folder.file("vendors"), "OCL_ICD_FILENAMES"});
  expectStockPath(run, "no OpenCL device");
}

// ---- the kernel cache

std::vector<fs::path> entries(const std::string& folder) {
  std::vector<fs::path> files;
  for (const auto& e : fs::directory_iterator(folder)) files.push_back(e.path());
  std::sort(files.begin(), files.end());
  return files;
}

void damage(const fs::path& path, size_t kind) {
  std::string content = readFile(path);
  switch (kind % 4) {
    case 0:
      content[content.size() / 2] = static_cast<char>(content[content.size() / 2] ^ 0x10);
      break;
    case 1:
      content.resize(content.size() / 3);
      break;
    case 2:
      content.clear();
      break;
    case 3:
      std::fill(content.begin(), content.end(), '\xff');
      break;
  }
  writeFile(path, content);
}

TEST(Startup, DamagedKernelCache) {
  const TemporaryFolder folder;
  const std::string cache = folder.file("cache");
  const std::vector<std::string> environment = {"BTGPU_CACHE_DIR=" + cache};
  AppRun cold = runApp(environment);
  expectOnDevice(cold);
  EXPECT_TRUE(cold.errors.empty()) << cold.errors[0];

  const auto files = entries(cache);
  ASSERT_GE(files.size(), 4u);
  for (size_t i = 0; i < files.size(); ++i) damage(files[i], i);
  AppRun damaged = runApp(environment);
  expectOnDevice(damaged);
  EXPECT_EQ(damaged.values["meanDistance"], cold.values["meanDistance"]);
  ASSERT_EQ(damaged.errors.size(), 1u) << "said once";
  EXPECT_NE(damaged.errors[0].find(cache), std::string::npos) << damaged.errors[0];

  AppRun healed = runApp(environment);
  expectOnDevice(healed);
  EXPECT_TRUE(healed.errors.empty()) << "the entries were written anew: " << healed.errors[0];
  EXPECT_EQ(entries(cache), files) << "and nothing else lies there";
}

TEST(Startup, CacheThatIsAFile) {
  const TemporaryFolder folder;
  writeFile(folder.file("cache"), "in the way");
  AppRun run = runApp({"BTGPU_CACHE_DIR=" + folder.file("cache")});
  expectOnDevice(run);
  EXPECT_EQ(readFile(folder.file("cache")), "in the way");
}

}  // namespace
}  // namespace btgpu::test
