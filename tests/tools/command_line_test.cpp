// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The command line tool as a user or a script meets it: exit status, the two output streams, the JSON file.
// BTGPU_TOOL is the path of the binary, BTGPU_DOUBLE_WRITER of the helper that writes a double-precision
// file.
#include <gtest/gtest.h>

#include <csignal>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/support/subprocess.h"
#include "tests/support/world_of.h"

namespace btgpu::test {
namespace {

using Arguments = std::vector<std::string>;
using nlohmann::json;

const std::string kSample = BTGPU_SOURCE_DIR "/samples/scenes/mixed.bullet";
const Arguments kSmallRun = {"compare", "stack", "--size", "2,2,2", "--steps", "20"};
constexpr int kSmallBodies = 9, kSmallSteps = 20;

Finished tool(Arguments arguments, const RunOptions& options = {}) {
  arguments.insert(arguments.begin(), BTGPU_TOOL);
  return runProgram(arguments, options);
}

Arguments operator+(Arguments a, const Arguments& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

// What a script relies on when something is wrong: the status, and one line for its user that holds all of
// `parts`.
void expectOneLine(const Finished& run, int exitCode, const std::vector<std::string>& parts) {
  EXPECT_EQ(run.exitCode, exitCode) << run.err;
  EXPECT_EQ(run.signal, 0);
  ASSERT_EQ(run.errLines().size(), 1u) << run.err;
  EXPECT_EQ(run.err.rfind("btgpu: ", 0), 0u) << run.err;
  EXPECT_EQ(run.err.back(), '\n');
  EXPECT_LE(run.err.size(), 300u) << run.err;
  for (const auto& part : parts) EXPECT_TRUE(contains(run.err, part)) << part << " is not in: " << run.err;
}

// Bad usage and input are found before anything is run: nothing on stdout that could be taken for a result.
void expectBadInput(const Finished& run, const std::vector<std::string>& parts) {
  expectOneLine(run, 2, parts);
  EXPECT_EQ(run.out, "");
}

// A .bullet file of a float world with these contents.
void writeWorld(const std::string& path, const std::function<void(scenes::Objects&)>& fill) {
  WorldOf<btDiscreteDynamicsWorld> run;
  fill(run.objects);
  writeFile(path, serialized(run.world));
}

TEST(CommandLine, InfoNamesTheDevices) {
  const Finished run = tool({"info"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_EQ(run.err, "");
  const auto lines = run.outLines();
  ASSERT_GE(lines.size(), 3u);
  EXPECT_EQ(lines[0].rfind("btgpu ", 0), 0u) << lines[0];
  EXPECT_TRUE(contains(lines[0], "single precision")) << lines[0];
  EXPECT_EQ(lines[1].rfind("0: ", 0), 0u) << lines[1];
  EXPECT_TRUE(contains(lines[1], "compute units")) << lines[1];
}

TEST(CommandLine, InfoWithoutDeviceSaysWhatToInstall) {
  const Finished run = tool({"info"}, {{"OCL_ICD_VENDORS=/nonexistent"}});
  expectOneLine(run, 1, {"no OpenCL device", "install"});
}

TEST(CommandLine, InfoWithoutEngineSaysWhatToChange) {
  const Finished run = tool({"info"}, {{"BTGPU_ENGINE=/nonexistent/engine.so"}});
  expectOneLine(run, 1, {"/nonexistent/engine.so", "unset BTGPU_ENGINE"});
}

TEST(CommandLine, ScenesListsEachSceneWithSizeAndSteps) {
  const Finished run = tool({"scenes"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_EQ(run.err, "");
  const auto lines = run.outLines();
  const size_t first = scenes::all().size(), second = scenes::big().size();
  // An empty line and a heading in between; at the end, after another such two, of what the names of shapes' scenes are
  // made.
  ASSERT_EQ(lines.size(), first + 2 + second + 4);
  EXPECT_TRUE(contains(lines[first + second + 4], "cone_x")) << lines[first + second + 4];
  EXPECT_TRUE(contains(lines[first + second + 5], "heightfield")) << lines[first + second + 5];
  for (size_t i = 0; i < first + second; ++i) {
    const scenes::Scene& scene = i < first ? scenes::all()[i] : scenes::big()[i - first];
    const std::string& line = lines[i < first ? i : i + 2];
    EXPECT_EQ(line.rfind(scene.name + " ", 0), 0u) << line;
    EXPECT_TRUE(contains(line, std::to_string(scene.steps) + " steps")) << line;
  }
}

TEST(CommandLine, HelpAndVersionAreNoErrors) {
  for (const Arguments& arguments : {Arguments{"--help"}, Arguments{"compare", "--help"}, Arguments{"--version"}}) {
    const Finished run = tool(arguments);
    EXPECT_EQ(run.exitCode, 0) << arguments.back();
    EXPECT_EQ(run.err, "") << arguments.back();
    EXPECT_FALSE(run.out.empty()) << arguments.back();
  }
}

TEST(CommandLine, BadUsageIsTwo) {
  const std::string help = "btgpu --help";
  expectBadInput(tool({}), {"subcommand", help});
  expectBadInput(tool({"nosuch"}), {help});
  expectBadInput(tool({"compare"}), {"scene is required", help});
  expectBadInput(tool({"compare", "stack", "--nosuch"}), {"--nosuch", help});
  expectBadInput(tool({"compare", "stack", "extra"}), {"extra", help});
  expectBadInput(tool({"compare", "stack", "--size"}), {"--size", help});
  expectBadInput(tool({"compare", "stack", "--steps", "0"}), {"--steps", "0 not in range 1 to", help});
  expectBadInput(tool({"compare", "stack", "--steps", "-3"}), {"--steps", "-3", help});
  expectBadInput(tool({"compare", "stack", "--steps", "many"}), {"--steps", "many", help});
  expectBadInput(tool({"scenes", "--write", "stack"}), {"file", help});
  expectBadInput(tool({"scenes", "--size", "1,1,1"}), {"--write", help});
}

TEST(CommandLine, UnknownSceneIsTwo) {
  expectBadInput(tool({"compare", "nosuch"}), {"nosuch", "btgpu scenes"});
  expectBadInput(tool({"compare", ""}), {"btgpu scenes"});
  const TemporaryFolder folder;
  expectBadInput(tool({"scenes", "--write", "nosuch", folder.file("a.bullet")}), {"nosuch", "btgpu scenes"});
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.bullet")));
}

TEST(CommandLine, BadSizeIsTwo) {
  for (const char* size : {"0,1,1", "1,-1,1", "2,2", "2,2,2,2", "abc", "1,1,1.5", "2 2 2", "2,2,2x"}) {
    SCOPED_TRACE(size);
    expectBadInput(tool({"compare", "stack", "--size", size}), {"--size", "three positive numbers, as in 8,8,8"});
  }
  // Sizes that no machine holds, and that no int holds.
  for (const char* size :
       {"100000,100000,100000", "4000001,1,1", "99999999999,1,1", "4294967297,1,1", "99999999999999999999,1,1"}) {
    SCOPED_TRACE(size);
    expectBadInput(tool({"compare", "stack", "--size", size}, {{}, 10}), {"--size", "too large", "at most"});
  }
  // As of a script whose variable is not set: not the default instead.
  expectBadInput(tool({"compare", "stack", "--size", ""}), {"--size", "empty"});
  expectBadInput(tool({"compare", "stack", "--json", ""}), {"--json", "empty"});
  expectBadInput(tool({"compare", "stack", "--report", ""}), {"--report", "empty"});
  expectBadInput(tool({"compare", kSample, "--size", "2,2,2"}), {"--size", ".bullet file"});
}

TEST(CommandLine, UnknownDeviceIsTwo) {
  for (const char* device : {"nosuch", "99"}) {
    SCOPED_TRACE(device);
    expectBadInput(tool(kSmallRun + Arguments{"--device", device}), {device, "btgpu info"});
    expectBadInput(tool({"compare", kSample, "--steps", "2", "--device", device}), {device, "btgpu info"});
  }
}

TEST(CommandLine, FilesThatAreNoneAreTwo) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.bullet");
  expectBadInput(tool({"compare", path}), {path, "No such file", "check the path"});
  writeFile(path, "");
  expectBadInput(tool({"compare", path}), {path, "is it a .bullet file?"});
  writeFile(path, "no scene at all\n");
  expectBadInput(tool({"compare", path}), {path, "is it a .bullet file?"});
  std::filesystem::remove(path);
  std::filesystem::create_directory(path);
  expectBadInput(tool({"compare", path}), {path, "is it a .bullet file?"});
}

TEST(CommandLine, TruncatedFilesAreTwo) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.bullet"), whole = readFile(kSample);
  ASSERT_GT(whole.size(), 20000u);
  for (const size_t length : {size_t(7), size_t(12), size_t(100), size_t(5000), whole.size() / 2}) {
    SCOPED_TRACE(length);
    writeFile(path, whole.substr(0, length));
    expectBadInput(tool({"compare", path, "--steps", "1"}), {path});
  }
}

// Bullet's importer dies on some of these: the tool must not, and whatever it takes must be compared in
// earnest.
TEST(CommandLine, DamagedFilesNeverKillTheTool) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.bullet"), whole = readFile(kSample);
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(i);
    std::string damaged = whole;
    const size_t from = random() % (whole.size() - 512);
    for (size_t k = 0; k < 256; ++k) damaged[from + k] = static_cast<char>(random());
    writeFile(path, damaged);
    const Finished run = tool({"compare", path, "--steps", "1"});
    EXPECT_EQ(run.signal, 0);
    EXPECT_TRUE(run.exitCode >= 0 && run.exitCode <= 2) << run.exitCode;
    if (run.exitCode != 2) continue;
    ++refused;
    expectBadInput(run, {path});
  }
  EXPECT_GT(refused, 0) << "none of the files was damaged enough: the test shows nothing";
}

TEST(CommandLine, WorldsThatCantBeComparedAreTwo) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.bullet");
  writeWorld(path, [](scenes::Objects&) {});
  expectBadInput(tool({"compare", path}), {path, "no bodies"});

  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto sphere = [](scenes::Objects& o, btScalar radius = 1) {
    return o.add(1, o.sphere(radius), btVector3(0, 0, 0));
  };
  writeWorld(path, [&](scenes::Objects& o) {
    sphere(o);
    sphere(o)->setMassProps(kNan, btVector3(1, 1, 1));
  });
  expectBadInput(tool({"compare", path}), {path, "body 1", "mass"});
  writeWorld(path, [&](scenes::Objects& o) { sphere(o, std::numeric_limits<float>::infinity()); });
  expectBadInput(tool({"compare", path}), {path, "body 0", "size"});
  writeWorld(path, [&](scenes::Objects& o) {
    btTransform transform(btQuaternion::getIdentity(), btVector3(kNan, 0, 0));
    sphere(o)->setWorldTransform(transform);
  });
  expectBadInput(tool({"compare", path}), {path, "body 0", "pose"});
}

TEST(CommandLine, AgreementIsZero) {
  const Finished run = tool(kSmallRun);
  EXPECT_EQ(run.exitCode, 0) << run.out;
  EXPECT_EQ(run.err, "") << "no terminal: no progress bar, and nothing else to say";
  const auto lines = run.outLines();
  ASSERT_GT(lines.size(), 10u);
  EXPECT_EQ(lines.front().rfind("stack: 9 bodies, 20 steps, 20 on ", 0), 0u) << lines.front();
  EXPECT_EQ(lines.back(), "in agreement");
  EXPECT_FALSE(contains(run.out, "FAILED"));
}

// Stock compared with stock would always agree.
TEST(CommandLine, NoDeviceIsNotCompared) {
  const TemporaryFolder folder;
  const std::string path = folder.file("result.json");
  const Arguments arguments = kSmallRun + Arguments{"--json", path};
  const Finished run = tool(arguments, {{"OCL_ICD_VENDORS=/nonexistent"}});
  expectOneLine(run, 1, {"no OpenCL device", "install"});
  EXPECT_EQ(run.outLines().back(), "not compared: no step ran on a device");

  const json result = json::parse(readFile(path));
  EXPECT_FALSE(result.at("pass").get<bool>());
  EXPECT_FALSE(result.at("compared").get<bool>());
  EXPECT_EQ(result.at("deviceSteps"), 0);
  EXPECT_EQ(result.at("device"), "");
  ASSERT_EQ(result.at("fallbacks").size(), 1u);
  EXPECT_EQ(result.at("fallbacks")[0].at("what"), "device");

  expectOneLine(tool(arguments, {{"BTGPU_ENGINE=/nonexistent/engine.so"}}), 1,
                {"/nonexistent/engine.so", "unset BTGPU_ENGINE"});
  // Asking for a device where there is none changes nothing.
  expectOneLine(tool(arguments + Arguments{"--device", "gpu"}, {{"OCL_ICD_VENDORS=/nonexistent"}}), 1,
                {"no OpenCL device", "install"});
}

// What the CPU does inside the device's steps is listed, and compared like the rest.
TEST(CommandLine, SharesOfTheCpuAreListed) {
  const TemporaryFolder folder;
  const std::string path = folder.file("joint.bullet"), jsonPath = folder.file("result.json");
  writeWorld(path, [&](scenes::Objects& o) {
    o.add(0, o.box(btVector3(50, 1, 50)), btVector3(0, -1, 0));
    btRigidBody* box = o.add(1, o.box(btVector3(1, 1, 1)), btVector3(0, 1, 0));
    btRigidBody* ball = o.add(1, o.sphere(1), btVector3(5, 1, 0));
    o.joint<btPoint2PointConstraint>(false, *box, *ball, btVector3(1, 0, 0), btVector3(-4, 0, 0));
  });
  const Finished run = tool({"compare", path, "--steps", "30", "--json", jsonPath});
  EXPECT_EQ(run.exitCode, 0) << run.out << run.err;
  EXPECT_TRUE(contains(run.out, "  on the CPU: joints")) << run.out;
  const json result = json::parse(readFile(jsonPath));
  EXPECT_EQ(result.at("deviceSteps"), 30);
  ASSERT_EQ(result.at("fallbacks").size(), 1u);
  EXPECT_FALSE(result.at("fallbacks")[0].at("wholeStep").get<bool>());
}

// A failing check: the world holds something that the device can't do.
TEST(CommandLine, StepsOnTheStockPathFail) {
  const TemporaryFolder folder;
  const std::string path = folder.file("random.bullet"), jsonPath = folder.file("result.json");
  writeWorld(path, [&](scenes::Objects& o) {
    o.world().getSolverInfo().m_solverMode |= SOLVER_RANDMIZE_ORDER;
    o.add(1, o.sphere(1), btVector3(5, 5, 0));
  });
  const Finished run = tool({"compare", path, "--steps", "4", "--json", jsonPath});
  expectOneLine(run, 1, {"not compared", "on the CPU"});
  EXPECT_TRUE(contains(run.out, "step on the CPU: SOLVER_RANDMIZE_ORDER (not on the device)")) << run.out;

  const json result = json::parse(readFile(jsonPath));
  EXPECT_FALSE(result.at("pass").get<bool>());
  EXPECT_EQ(result.at("steps"), 4);
  EXPECT_EQ(result.at("deviceSteps"), 0);
  ASSERT_EQ(result.at("fallbacks").size(), 1u);
  const json& fallback = result.at("fallbacks")[0];
  EXPECT_EQ(fallback.at("what"), "SOLVER_RANDMIZE_ORDER");
  EXPECT_EQ(fallback.at("reason"), "not on the device");
  EXPECT_GE(fallback.at("count").get<int>(), 1);
  bool failed = false;
  for (const json& check : result.at("checks")) {
    if (check.at("name") != "device.missing_steps") continue;
    failed = !check.at("pass").get<bool>();
    EXPECT_EQ(check.at("value"), 4);
  }
  EXPECT_TRUE(failed) << result.dump(2);
}

TEST(CommandLine, JsonFile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("result.json");
  const Finished run = tool(kSmallRun + Arguments{"--json", path, "--hash"});
  ASSERT_EQ(run.exitCode, 0) << run.out << run.err;
  const json result = json::parse(readFile(path));
  EXPECT_EQ(result.at("scene"), "stack");
  EXPECT_EQ(result.at("bodies"), kSmallBodies);
  EXPECT_EQ(result.at("steps"), kSmallSteps);
  EXPECT_EQ(result.at("deviceSteps"), kSmallSteps);
  EXPECT_FALSE(result.at("device").get<std::string>().empty());
  EXPECT_TRUE(contains(run.out, result.at("device").get<std::string>()));
  EXPECT_TRUE(result.at("pass").get<bool>());
  EXPECT_GT(result.at("cpu").at("msPerStep").get<double>(), 0);
  EXPECT_GT(result.at("gpu").at("msPerStep").get<double>(), 0);
  EXPECT_TRUE(result.at("fallbacks").is_array());
  EXPECT_TRUE(result.at("fallbacks").empty());
  EXPECT_TRUE(contains(run.out, "hash " + result.at("hash").get<std::string>()));

  ASSERT_GT(result.at("checks").size(), 10u);
  for (const json& check : result.at("checks")) {
    const std::string name = check.at("name").get<std::string>();
    ASSERT_TRUE(check.at("value").is_number()) << name;
    EXPECT_EQ(check.at("pass").get<bool>(), check.at("value").get<double>() <= check.at("limit").get<double>()) << name;
    EXPECT_TRUE(contains(run.out, name)) << name;
  }
}

TEST(CommandLine, UnwritableFilesAreTwo) {
  const TemporaryFolder folder;
  const std::string path = folder.file("nosuch/result");
  expectOneLine(tool(kSmallRun + Arguments{"--json", path}), 2, {path, "can't be written", "check the path"});
  expectOneLine(tool({"compare", kSample, "--steps", "2", "--json", path}), 2, {path, "can't be written"});
  expectOneLine(tool(kSmallRun + Arguments{"--report", path}), 2, {path, "can't be written", "check the path"});
  expectBadInput(tool({"scenes", "--write", "stack", path, "--size", "1,1,1"}), {path, "can't be written"});
}

// Stage, or nothing for the hash of the end, and hash.
std::vector<std::pair<std::string, std::string>> hashLines(const Finished& run) {
  std::vector<std::pair<std::string, std::string>> found;
  for (const auto& line : run.outLines()) {
    if (line.rfind("hash ", 0) != 0) continue;
    const size_t last = line.rfind(' ');
    found.emplace_back(last == 4 ? "" : line.substr(5, last - 5), line.substr(last + 1));
  }
  return found;
}

TEST(CommandLine, AHashAStageAndTheSameTwice) {
  const auto first = hashLines(tool(kSmallRun + Arguments{"--hash"}));
  ASSERT_GT(first.size(), 15u);
  EXPECT_EQ(first.front().first, "10_apply_forces");
  EXPECT_EQ(first.back().first, "");
  for (const auto& [stage, hash] : first) {
    EXPECT_EQ(hash.size(), 16u) << stage;
    EXPECT_EQ(hash.find_first_not_of("0123456789abcdef"), std::string::npos) << stage << hash;
  }
  EXPECT_EQ(first, hashLines(tool(kSmallRun + Arguments{"--hash"})));
  EXPECT_TRUE(hashLines(tool(kSmallRun)).empty());
  // It depends on the outcome: one step more gives another.
  const auto longer = hashLines(tool({"compare", "stack", "--size", "2,2,2", "--steps", "21", "--hash"}));
  ASSERT_EQ(longer.size(), first.size());
  EXPECT_NE(first.back(), longer.back());
}

// The same hashes from the file of all steps, which only the user removes.
TEST(CommandLine, HashesOfTheLastStepAreThoseOfTheFile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("hashes");
  const auto printed = hashLines(tool(kSmallRun + Arguments{"--hash"}));
  EXPECT_EQ(printed, hashLines(tool(kSmallRun + Arguments{"--hash", "--stage-hashes", path})));
  const std::string text = readFile(path);
  ASSERT_GT(printed.size(), 1u);
  for (size_t i = 0; i + 1 < printed.size(); ++i) EXPECT_TRUE(contains(text, printed[i].second)) << printed[i].first;
}

TEST(CommandLine, StepsToHash) {
  RunOptions options;
  for (const char* step : {"x", "-1", "3x", "99999999999999999999"}) {
    options.environment = {"BTGPU_STAGE_HASHES=/dev/null", std::string("BTGPU_STAGE_HASHES_STEP=") + step};
    const Finished run = tool(kSmallRun, options);
    EXPECT_NE(run.exitCode, 0) << step;
    EXPECT_TRUE(contains(run.out + run.err, std::string("BTGPU_STAGE_HASHES_STEP=") + step)) << run.out << run.err;
  }
}

TEST(CommandLine, ProgressBarOnATerminalOnly) {
  if (!hasTerminals()) GTEST_SKIP() << "no /dev/pts: not tested";
  RunOptions options;
  options.terminal = true;
  const Finished run = tool(kSmallRun, options);
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_TRUE(contains(run.err, "stack [##")) << run.err;
  EXPECT_TRUE(contains(run.err, " 50 %")) << run.err;
  EXPECT_TRUE(contains(run.err, "100 %")) << run.err;
  EXPECT_FALSE(contains(run.err, "\n")) << "the bar stays in its line";
  const std::string cleared = "\r\033[K";
  ASSERT_GE(run.err.size(), cleared.size());
  EXPECT_EQ(run.err.substr(run.err.size() - cleared.size()), cleared) << "the bar leaves the line empty";
  EXPECT_FALSE(contains(run.out, "\r")) << "stdout holds the result alone";
  EXPECT_EQ(tool(kSmallRun).err, "") << "no terminal, no bar";
}

TEST(CommandLine, ProfileNamesTheStages) {
  const Finished run = tool(kSmallRun + Arguments{"--profile"});
  EXPECT_EQ(run.exitCode, 0) << run.out;
  EXPECT_TRUE(contains(run.out, "70_solve_velocities")) << run.out;
}

TEST(CommandLine, ProfileTellsZonesAndStages) {
  const TemporaryFolder folder;
  const std::string trace = folder.file("trace.json"), csv = folder.file("table.csv");
  const Finished run = tool({"profile", "--scene", "stack", "--size", "2,3,2", "--steps", "8", "--warm-up", "2",
                             "--trace", trace, "--csv", csv});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.err, "");
  for (const char* part :
       {"stack: 13 bodies, 8 steps after 2 to warm up, ", "\nstepSimulation                                      8 ",
        "\n      launch ", "\n70_solve_velocities ", "\n  integratePoses ", "100.0 %",
        "device times lie on the host's axis to within "}) {
    EXPECT_TRUE(contains(run.out, part)) << part << "\n" << run.out;
  }
  EXPECT_FALSE(contains(run.out, "createEngine")) << "that was before\n" << run.out;
  EXPECT_FALSE(contains(run.out, "not in the trace")) << run.out;
  EXPECT_GT(json::parse(readFile(trace)).at("traceEvents").size(), 8u * 30u);
  EXPECT_EQ(readFile(csv).rfind("row,path,", 0), 0u);
}

TEST(CommandLine, ProfileOfTheHostAlone) {
  const Finished run = tool({"profile", "--size", "2,2,2", "--steps", "3", "--host-only"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_TRUE(contains(run.out, "\n        70_solve_velocities ")) << run.out;
  EXPECT_FALSE(contains(run.out, "collectTimes")) << run.out;
  EXPECT_FALSE(contains(run.out, "device stage")) << run.out;
}

TEST(CommandLine, ProfileRefusesWhatItCannotDo) {
  for (const Arguments& arguments :
       {Arguments{"profile", "--scene", "nosuch"}, Arguments{"profile", "--steps", "0"},
        Arguments{"profile", "--scene", kSample, "--size", "1,1,1"},
        Arguments{"profile", "--size", "1,1,1", "--steps", "1", "--trace", "/no/where.json"}}) {
    const Finished run = tool(arguments);
    EXPECT_EQ(run.exitCode, 2) << run.err;
    EXPECT_EQ(run.errLines().size(), 1u) << run.err;
  }
}

TEST(CommandLine, FloatFile) {
  const Finished run = tool({"compare", kSample, "--steps", "20"});
  EXPECT_EQ(run.exitCode, 0) << run.out;
  EXPECT_EQ(run.err, "");
  EXPECT_TRUE(contains(run.out, "65 bodies, 20 steps, 20 on ")) << run.out;
}

TEST(CommandLine, DoubleFile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("double.bullet");
  ASSERT_EQ(runProgram({BTGPU_DOUBLE_WRITER, path}).exitCode, 0);
  ASSERT_EQ(readFile(path).substr(0, 7), "BULLETd") << "d: double precision";
  const Finished run = tool({"compare", path, "--steps", "20"});
  EXPECT_EQ(run.exitCode, 0) << run.out;
  EXPECT_EQ(run.err, "");
  EXPECT_TRUE(contains(run.out, "9 bodies, 20 steps, 20 on ")) << run.out;
}

TEST(CommandLine, WrittenSceneComesBackTheSame) {
  const TemporaryFolder folder;
  const std::string path = folder.file("stack.bullet"), fromFile = folder.file("file.json"),
                    builtIn = folder.file("scene.json");
  const Finished written = tool({"scenes", "--write", "stack", path, "--size", "2,2,2"});
  ASSERT_EQ(written.exitCode, 0) << written.err;
  EXPECT_EQ(written.out + written.err, "");
  ASSERT_EQ(tool({"compare", path, "--steps", "20", "--json", fromFile}).exitCode, 0);
  ASSERT_EQ(tool(kSmallRun + Arguments{"--json", builtIn}).exitCode, 0);
  const json a = json::parse(readFile(fromFile)), b = json::parse(readFile(builtIn));
  EXPECT_EQ(a.at("bodies"), b.at("bodies"));
  EXPECT_NEAR(a.at("gpu").at("meanHeight").get<double>(), b.at("gpu").at("meanHeight").get<double>(), 1e-5);
}

}  // namespace
}  // namespace btgpu::test
