// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stages captured in a running engine and run again: the replay leaves the same bits, and a kernel that is broken on
// purpose is found out.
#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>

#include "gpu_engine/debug/capture_file.h"
#include "gpu_engine/debug/capture_recorder.h"
#include "gpu_engine/debug/replay.h"
#include "gpu_engine/opencl/kernel_sources.h"
#include "gpu_engine/primitives/primitives.h"
#include "gpu_engine/world_engine.h"
#include "tests/support/changed_kernels.h"
#include "tests/support/device_test.h"
#include "tests/support/mixed_world.h"
#include "tests/support/roomy_world.h"
#include "tests/support/scoped_environment.h"
#include "tests/support/subprocess.h"

namespace btgpu {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

// What a step's caller sees of it.
struct Seen {
  std::vector<BodyPose> poses;
  std::vector<BodyVelocity> velocities;
  std::vector<ulong> contactKeys;
  int launches, waits;
  bool prefetched;
};

// Those with stages of their own.
const Solver kSolvers[] = {Solver::Parity, Solver::Fast, Solver::MassSplitting, Solver::TwoLevel};

// Steps a world in an engine of its own, made with the environment as it is.
std::vector<Seen> stepEngine(WorldInput input, int steps, int substeps, Solver solver = Solver::Parity,
                             PairFinder finder = PairFinder::Bvh) {
  WorldEngine engine({});
  StepResults results;
  std::vector<Seen> seen;
  for (int i = 0; i < steps; ++i) {
    StepSettings settings;
    settings.contacts = true;
    settings.solver = solver;
    settings.pairFinder = finder;
    settings.substepsToFollow = (steps - 1 - i) % substeps;
    engine.begin(input, settings);
    engine.finish(results);
    input.poses.values = results.poses;
    input.velocities.values = results.velocities;
    input.activations.values = results.activations;
    input.clearChanges();
    input.born.clear();
    seen.push_back(
        {results.poses, results.velocities, results.contactKeys, results.launches, results.waits, results.prefetched});
  }
  return seen;
}

std::set<std::string> stemsIn(const fs::path& folder) {
  std::set<std::string> stems;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    stems.insert(name.substr(6, name.rfind('-') - 6));
  }
  return stems;
}

// All stages that have kernels of their own.
std::set<std::string> stagesWithKernels() {
  std::set<std::string> stems;
  for (const auto& [path, text] : embeddedKernels()) {
    if (path.rfind("kernels/stages/", 0) == 0) stems.insert(fs::path(path).stem().string());
  }
  return stems;
}

std::vector<std::string> kernelsIn(const std::string& source) {
  static const std::regex kernel("(?:^|\\n)(?:SINGLE_)?KERNEL (\\w+)\\(");
  std::vector<std::string> names;
  for (std::sregex_iterator i(source.begin(), source.end(), kernel), end; i != end; ++i) names.push_back((*i)[1]);
  EXPECT_FALSE(names.empty()) << source.substr(0, 200);
  return names;
}

// As "stages/44_find_separating_axis.cl findSeparatingAxis".
void addKernels(const Capture& capture, std::set<std::string>& kernels) {
  for (const CapturedCommand& command : capture.commands) {
    if (const auto* launch = std::get_if<CapturedLaunch>(&command)) kernels.insert(launch->file + " " + launch->name);
  }
}

size_t changedArrays(const Capture& capture) {
  return static_cast<size_t>(std::count_if(capture.arrays.begin(), capture.arrays.end(),
                                           [](const CapturedArray& a) { return !a.after.empty(); }));
}

class CaptureTest : public DeviceTest {
 protected:
  // The commands that `work` gives the queue, as a stage.
  template <typename Work>
  Capture captureOf(Work&& work) {
    Capture captured;
    m_queue.setRecorder(std::make_unique<CaptureRecorder>(std::vector<CaptureRequest>{{"44_test", 3}},
                                                          [&](const Capture& c) { captured = c; }));
    m_queue.enterStep(3);
    m_queue.enterStage("44_test");
    work();
    m_queue.leaveStep();
    m_queue.setRecorder(nullptr);
    return captured;
  }

  void expectIdentical(const Capture& capture) {
    const std::vector<Bytes> found = runCapture(capture, m_device);
    ASSERT_EQ(found.size(), capture.arrays.size());
    for (size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i] == capture.arrays[i].expected(), true) << capture.stage << ": " << capture.arrays[i].name;
    }
  }

  // Kernels of the other shape, or of worlds with more bodies; a CPU's contacts are read in place.
  bool notCaptured(const std::string& kernel) {
    if (kernel == "bvhHigh") return true;
    const std::set<std::string> onlyCpu = {
        "colourGreedy", "solveInTeam", "solveJointsInTeam", "substepsInTeam",
        "layBoxes",     "listPairs",   "islandsByOne",      "prepareBodiesAndContacts"};
    const std::set<std::string> onlyGpu = {
        "colourRound",    "colourRest",    "countColours", "fillSlots",     "solveColour",   "solveRest",
        "gatherContacts", "substepColour", "substepRest",  "substepBodies", "islandUnite",   "islandUniteJoints",
        "findWaysOut",    "islandFlatten", "islandStates", "selectJoints",  "prepareBodies", "prepareContacts"};
    const auto& foreign = device().shape() == KernelShape::Cpu ? onlyGpu : onlyCpu;
    return foreign.count(kernel) > 0;
  }

  void expectAllIdentical(const fs::path& folder) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      SCOPED_TRACE(entry.path().filename());
      const Capture capture = readCapture(entry.path().string());
      // The keys of what touches, and the pairs, may be those of the step before.
      const bool mayBeSame = capture.stage == "95_send_contacts" || capture.stage == "35_group_pairs";
      EXPECT_TRUE(mayBeSame || changedArrays(capture) > 0) << "nothing to be seen";
      const ReplayReport report = replayFile(entry.path().string(), {});
      EXPECT_TRUE(report.sameDevice);
      EXPECT_EQ(report.differentArrays, 0) << report.text;
      expectHostAgrees(entry.path().string());
    }
  }

  // The stage's reference, given the capture alone, agrees with what the device made of it.
  void expectHostAgrees(const std::string& file) {
    const Capture capture = readCapture(file);
    if (kWithoutReference.count(capture.stage) > 0) {
      EXPECT_THROW(replayOnHost(file), CaptureError);
    } else {
      const ReplayReport report = replayOnHost(file);
      EXPECT_EQ(report.differentArrays, 0) << report.text;
    }
  }
  // One starts the step; the other only copies.
  const std::set<std::string> kWithoutReference = {"05_follow_substep", "95_send_contacts"};

  TemporaryFolder m_folder;
};

TEST_F(CaptureTest, EveryStageOfAStep) {
  std::set<std::string> captured;
  for (const Solver solver : kSolvers) {
    const TemporaryFolder folder;
    const ScopedVariable what("BTGPU_CAPTURE", "all@2"), where("BTGPU_CAPTURE_FILE", folder.path().string());
    stepEngine(mixedWorldWithJoints(), 4, 1, solver);
    expectAllIdentical(folder.path());
    captured.merge(stemsIn(folder.path()));
  }
  {
    const TemporaryFolder folder;
    const ScopedVariable what("BTGPU_CAPTURE", "all@2"), where("BTGPU_CAPTURE_FILE", folder.path().string());
    stepEngine(otherShapesWorld(), 4, 1);
    expectAllIdentical(folder.path());
    captured.merge(stemsIn(folder.path()));
  }
  auto stems = stagesWithKernels();
  // Launched within another stage: see EveryKernelOfEveryStage.
  for (const char* within : {"30_find_pairs_brute_force", "30_find_pairs_grid", "30_find_pairs_incremental",
                             "30_find_pairs_sweep", "30_sort_pairs", "47_pick_touches"}) {
    EXPECT_EQ(stems.erase(within), 1u) << within;
  }
  stems.erase("05_follow_substep");        // see SubstepsAhead
  stems.erase("70_solve_joint_substeps");  // launched within 70_solve_substeps: see EveryKernelOfEveryStage
  stems.erase("70_solve_joints");          // likewise, within 70_solve_velocities
  stems.insert("95_send_contacts");
  EXPECT_EQ(captured, stems);
}

// Every kernel in kernels/stages, those of the other shape apart, is in some capture, and its replay leaves the same
// bits. Of a new kernel that none of these worlds launches, this test gives the name.
TEST_F(CaptureTest, EveryKernelOfEveryStage) {
  std::set<std::string> launched;
  const auto capture = [&](const WorldInput& input, int substeps, Solver solver = Solver::Parity,
                           PairFinder finder = PairFinder::Bvh) {
    const TemporaryFolder folder;
    const ScopedVariable what("BTGPU_CAPTURE", "all@0,all@2"), where("BTGPU_CAPTURE_FILE", folder.path().string());
    stepEngine(input, 3, substeps, solver, finder);
    expectAllIdentical(folder.path());
    for (const auto& entry : fs::directory_iterator(folder.path())) addKernels(readCapture(entry.path()), launched);
  };
  for (const Solver solver : kSolvers) capture(mixedWorldWithJoints(JOINT_COLOUR_LIMIT + 2), 1, solver);
  capture(mixedWorld(), 3);
  capture(otherShapesWorld(), 1);
  for (const PairFinder finder :
       {PairFinder::Grid, PairFinder::Sweep, PairFinder::IncrementalSweep, PairFinder::BruteForce}) {
    capture(mixedWorld(), 1, Solver::Parity, finder);
  }
  for (const auto& [path, text] : embeddedKernels()) {
    if (path.rfind("kernels/stages/", 0) != 0) continue;
    for (const std::string& kernel : kernelsIn(text)) {
      EXPECT_EQ(launched.count(path.substr(8) + " " + kernel), notCaptured(kernel) ? 0u : 1u) << path << ": " << kernel;
    }
  }
}

// What a broken kernel did in the application is found out from the file alone, by value.
TEST_F(CaptureTest, TheHostNamesWhatABrokenKernelDid) {
  const ScopedVariable what("BTGPU_CAPTURE", "80@2"), where("BTGPU_CAPTURE_FILE", m_folder.file("capture"));
  stepEngine(mixedWorld(), 3, 1);
  EXPECT_EQ(replayOnHost(m_folder.file("capture")).differentArrays, 0);
  const test::ChangedKernels kernels("lib/motion.h", "pose.position + linear * timeStep",
                                     "pose.position - linear * timeStep");
  const ScopedVariable changed("BTGPU_KERNEL_DIR", kernels.path());
  stepEngine(mixedWorld(), 3, 1);
  const ReplayReport report = replayOnHost(m_folder.file("capture"));
  EXPECT_EQ(report.differentArrays, 1);
  EXPECT_NE(report.text.find("80_integrate_poses: body "), std::string::npos) << report.text;
}

// What the reference needs and the file has not is said, not made up.
TEST_F(CaptureTest, TheHostNeedsAllItReads) {
  const ScopedVariable what("BTGPU_CAPTURE", "35@2"), where("BTGPU_CAPTURE_FILE", m_folder.file("capture"));
  stepEngine(mixedWorld(), 3, 1);
  const Capture whole = readCapture(m_folder.file("capture"));
  EXPECT_FALSE(checkOnHost(whole));
  EXPECT_FALSE(checkOnHost(decodeCapture(encodeCapture(whole))));
  Capture lacking = whole, older = whole;
  lacking.views.erase(std::find_if(lacking.views.begin(), lacking.views.end(),
                                   [](const CapturedView& v) { return v.array == "shapes"; }));
  older.views.clear();
  older.numbers.clear();
  EXPECT_THROW(checkOnHost(lacking), CaptureError);
  EXPECT_THROW(checkOnHost(older), CaptureError);
  EXPECT_EQ(encodeCapture(older)[8], 1) << "the format without inputs";
  expectIdentical(decodeCapture(encodeCapture(older)));
}

// A substep that was begun ahead of its turn is the step that it became.
TEST_F(CaptureTest, SubstepsAhead) {
  const ScopedVariable what("BTGPU_CAPTURE", "all@2"), where("BTGPU_CAPTURE_FILE", m_folder.path().string());
  const auto seen = stepEngine(mixedWorld(), 4, 3);
  ASSERT_TRUE(seen[2].prefetched);
  const auto stems = stemsIn(m_folder.path());
  EXPECT_TRUE(stems.count("05_follow_substep"));
  EXPECT_TRUE(stems.count("80_integrate_poses"));
  expectAllIdentical(m_folder.path());
  const Capture integrated = readCapture(m_folder.file("btgpu-80_integrate_poses-2.btgpucap"));
  const auto poses = std::find_if(integrated.arrays.begin(), integrated.arrays.end(),
                                  [](const CapturedArray& a) { return a.name == "poses"; });
  ASSERT_NE(poses, integrated.arrays.end());
  const size_t bytes = seen[2].poses.size() * sizeof(BodyPose);
  ASSERT_GE(poses->before.size(), bytes);
  EXPECT_EQ(std::memcmp(poses->before.data(), seen[1].poses.data(), bytes), 0);
  EXPECT_EQ(std::memcmp(poses->expected().data(), seen[2].poses.data(), bytes), 0);
}

TEST_F(CaptureTest, ChangesNothing) {
  const auto plain = stepEngine(mixedWorld(), 6, 3);
  std::vector<Seen> captured;
  {
    const ScopedVariable what("BTGPU_CAPTURE", "all@2"), where("BTGPU_CAPTURE_FILE", m_folder.path().string());
    captured = stepEngine(mixedWorld(), 6, 3);
  }
  ASSERT_FALSE(stemsIn(m_folder.path()).empty());
  for (size_t i = 0; i < plain.size(); ++i) {
    EXPECT_TRUE(same(plain[i].poses, captured[i].poses)) << i;
    EXPECT_TRUE(same(plain[i].velocities, captured[i].velocities)) << i;
    EXPECT_EQ(plain[i].contactKeys, captured[i].contactKeys) << i;
    EXPECT_EQ(plain[i].launches, captured[i].launches) << i;
    EXPECT_EQ(plain[i].waits, captured[i].waits) << i;
  }
}

TEST_F(CaptureTest, WhatCanNotBeWrittenCostsNoStep) {
  const ScopedVariable what("BTGPU_CAPTURE", "10@0,42@7"), where("BTGPU_CAPTURE_FILE", m_folder.file("no/such/file"));
  testing::internal::CaptureStderr();
  EXPECT_EQ(stepEngine(mixedWorld(), 2, 1).size(), 2u);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("no/such/file: can't be written"), std::string::npos) << said;
  EXPECT_NE(said.find("nothing to capture: no stage 42 in step 7"), std::string::npos) << said;
}

TEST_F(CaptureTest, RequestsThatMakeNoSense) {
  const ScopedVariable what("BTGPU_CAPTURE", "44");
  try {
    WorldEngine engine({});
    ADD_FAILURE() << "no error";
  } catch (const OpenClError& e) { EXPECT_NE(std::string(e.what()).find("as in 44@120"), std::string::npos); }
}

// Writes and copies between kernels, memory that changes hands, arguments that are null, memory that no kernel got.
TEST_F(CaptureTest, EveryCommand) {
  Fill fill(device());
  Scan scan(device());
  DeviceArray<uint> a("a"), b("b"), sums("sums"), total("total");
  a.copyFromHost(queue(), {1, 2, 3, 4});
  b.copyFromHost(queue(), {9, 9, 9, 9});
  const Capture capture = captureOf([&] {
    fill.run(queue(), a, 1, 2, 7u);
    a.copyRangeFromHost(queue(), {0, 0, 0, 5}, 3, 1);
    fill.run(queue(), a, 0, 1, 6u);
    queue().copy(a.buffer(), b.buffer(), 0, sizeof(uint), 2 * sizeof(uint));
    std::swap(a, b);
    scan.exclusive(queue(), {4}, a, sums, total);
    fill.run(queue(), b, 0, 1, 8u);
  });
  EXPECT_EQ(a.toVector(queue()), (std::vector<uint>{9, 6, 7, 9}));
  EXPECT_EQ(b.toVector(queue()), (std::vector<uint>{8, 7, 7, 5}));
  std::vector<size_t> kinds;
  for (const auto& command : capture.commands) kinds.push_back(command.index());
  // On a CPU so short a scan is one launch.
  std::vector<size_t> expected = {0, 1, 0, 2, 0, 0};
  if (device().shape() == KernelShape::Gpu) expected.push_back(0);
  EXPECT_EQ(kinds, expected);
  ASSERT_GE(capture.arrays.size(), 2u);
  EXPECT_EQ(capture.arrays[0].name, "a");
  EXPECT_EQ(capture.arrays[0].before.size(), 16 * sizeof(uint)) << "all of the memory";
  const auto& first = std::get<CapturedLaunch>(capture.commands[4]).arguments;
  EXPECT_TRUE(std::any_of(first.begin(), first.end(),
                          [](const CapturedArgument& x) { return x.kind == CapturedArgument::Kind::Null; }));
  expectIdentical(capture);
  expectIdentical(decodeCapture(encodeCapture(capture)));
}

// What a stage leaves half done by an error is no capture.
TEST_F(CaptureTest, AnInterruptedStageIsDropped) {
  Fill fill(device());
  DeviceArray<uint> a("a");
  a.copyFromHost(queue(), {1, 2});
  int done = 0;
  m_queue.setRecorder(
      std::make_unique<CaptureRecorder>(std::vector<CaptureRequest>{{"44_test", 3}}, [&](const Capture& c) {
        ++done;
        EXPECT_EQ(c.commands.size(), 1u);
      }));
  for (int attempt = 0; attempt < 2; ++attempt) {
    m_queue.enterStep(3);
    m_queue.enterStage("44_test");
    fill.run(queue(), a, 0, 2, 5u);
  }
  EXPECT_EQ(done, 0);
  m_queue.leaveStep();
  fill.run(queue(), a, 0, 2, 6u);
  EXPECT_EQ(done, 1);
}

TEST_F(CaptureTest, ABrokenKernelIsFoundOut) {
  Fill fill(device());
  DeviceArray<uint> a("numbers");
  a.copyFromHost(queue(), {1, 2, 3, 4, 5});
  const std::string file = m_folder.file("fill");
  writeCapture(file, captureOf([&] { fill.run(queue(), a, 1, 3, 9u); }));
  const test::ChangedKernels kernels("primitives/fill.cl", "i] = value", "i] = value + (i == 1)");
  EXPECT_EQ(replayFile(file, {}).differentArrays, 0);
  const ScopedVariable changed("BTGPU_KERNEL_DIR", kernels.path());
  const ReplayReport report = replayFile(file, {});
  EXPECT_EQ(report.differentArrays, 1);
  EXPECT_NE(report.text.find("numbers: 1 of 16 elements differ; first: [2] is 10 (0x0000000a) and was 9 (0x00000009)"),
            std::string::npos)
      << report.text;
}

// DEBUG_PRINT prints if it is asked to, and is nothing otherwise.
TEST_F(CaptureTest, KernelsPrint) {
  const test::ChangedKernels kernels("primitives/fill.cl", "FOR_EACH(i, count) data",
                                     "FOR_EACH(i, count) DEBUG_PRINT((\"item %u of %u\\n\", i, count));\n"
                                     "FOR_EACH(i, count) data");
  const ScopedVariable changed("BTGPU_KERNEL_DIR", kernels.path());
  const auto printed = [&](const char* print) {
    const ScopedVariable variable("BTGPU_PRINTF", print);
    testing::internal::CaptureStdout();
    Fill fill(device());
    DeviceArray<uint> a("numbers");
    a.copyFromHost(queue(), {1, 2, 3});
    fill.run(queue(), a, 0, 2, 9u);
    queue().finish();
    EXPECT_EQ(a.toVector(queue()), (std::vector<uint>{9, 9, 3}));
    std::fflush(stdout);
    return testing::internal::GetCapturedStdout();
  };
  EXPECT_EQ(printed(""), "");
  const std::string text = printed("1");
  EXPECT_NE(text.find("item 0 of 2\n"), std::string::npos) << text;
  EXPECT_NE(text.find("item 1 of 2\n"), std::string::npos) << text;
  EXPECT_EQ(printed("0"), "");
}

// Kernels that do not take what was captured are an error, not a launch.
TEST_F(CaptureTest, ArgumentsThatDoNotFit) {
  Fill fill(device());
  DeviceArray<uint> a("numbers");
  a.copyFromHost(queue(), {1, 2, 3});
  const Capture good = captureOf([&] { fill.run(queue(), a, 1, 2, 9u); });
  Capture fewer = good, none = good, unknown = good;
  std::get<CapturedLaunch>(fewer.commands[0]).arguments.pop_back();
  std::get<CapturedLaunch>(none.commands[0]).name = "noSuchKernel";
  std::get<CapturedLaunch>(unknown.commands[0]).file = "primitives/no_such_file.cl";
  expectIdentical(good);
  for (const Capture& bad : {fewer, none, unknown}) EXPECT_THROW(runCapture(bad, m_device), OpenClError);
}

// ---- captures that are kept in tests/data/captures ------------------------------------------------------------------

// Their stages compute with whole numbers, or round in ways that all devices have in common.
constexpr const char* kKept[] = {"35_group_pairs", "44_find_separating_axis", "60_colour_constraints"};

std::string keptFile(const std::string& stage, bool cpuShape) {
  return stage + (cpuShape ? ".cpu" : ".gpu") + ".btgpucap";
}

// One on top of the other, on a plane: small files.
WorldInput threeBoxes() {
  WorldBuilder b;
  const int plane = b.plane({0, 1, 0, 0}, 0), box = b.box({0.5f, 0.5f, 0.5f, 0});
  b.add(plane, {0, 0, 0, 0}, 0);
  for (int i = 0; i < 3; ++i) b.add(box, {0.1f * float(i), 0.49f + 0.98f * float(i), 0, 0});
  return b.finish();
}

// Writes them anew, into the folder that BTGPU_KEEP_CAPTURES names.
void keepCaptures(Queue& queue, const fs::path& folder) {
  const auto keep = [folder](const Capture& capture) {
    writeCapture((folder / keptFile(capture.stage, capture.cpuShape)).string(), capture);
  };
  WorldInput world = threeBoxes();
  RoomyWorld roomy(queue, {world.bodyCount, 8, 4 * BTGPU_LANES, 4, 8});
  for (long step = 0; step < 3; ++step) {
    if (step == 2) {  // the topmost goes elsewhere, so that the captured stages have something to change
      world.poses.values[3].position = {3, 0.49f, 0, 0};
      world.poses.changed = {3};
    }
    std::vector<CaptureRequest> requests;
    for (const char* stage : kKept) requests.push_back({stage, 2});
    queue.setRecorder(std::make_unique<CaptureRecorder>(step == 2 ? requests : std::vector<CaptureRequest>(), keep));
    queue.enterStep(step);
    const StepResults results = roomy.step(world, {});
    queue.leaveStep();
    ASSERT_EQ(results.counters.overflow, 0u);
    world.clearChanges();
  }
  queue.setRecorder(nullptr);
}

TEST_F(CaptureTest, KeptOnes) {
  const char* anew = std::getenv("BTGPU_KEEP_CAPTURES");
  if (anew && *anew) keepCaptures(queue(), anew);
  for (const char* name : kKept) {
    const std::string stage = name;
    const Capture capture =
        readCapture(BTGPU_SOURCE_DIR "/tests/data/captures/" + keptFile(stage, device().shape() == KernelShape::Cpu));
    EXPECT_EQ(capture.stage, stage);
    EXPECT_GT(changedArrays(capture), 0u);
    expectIdentical(capture);
  }
}

}  // namespace
}  // namespace btgpu
