// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// `btgpu bench` without Bullet3's own run (bench_bullet3_test.cpp). BTGPU_TOOL_WITHOUT_BULLET3 is a tool that was built
// without that peer.
#include <set>
#include <sstream>

#include "bench_run.h"
#include "tests/support/world_of.h"
#include "tools/btgpu/bench_worlds.h"
#include "tools/btgpu/bullet3_scene.h"
#include "tools/btgpu/bullet_file.h"

namespace btgpu::test {
namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  bool quoted = false;
  fields.emplace_back();
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

TEST(Bench, RowsOfTheJsonHoldEveryFigure) {
  const json result = resultOf({"--size", "3,3,3", "--steps", "30", "--worlds", "gpu,cpu"});
  EXPECT_EQ(result.at("scene"), "stack");
  EXPECT_EQ(result.at("steps"), 30);
  EXPECT_EQ(result.at("measured"), 15);
  EXPECT_EQ(result.at("sleeping"), false);
  ASSERT_EQ(result.at("rows").size(), 2u);
  const json& gpu = result.at("rows")[0];
  const json& cpu = result.at("rows")[1];
  EXPECT_EQ(gpu.at("world"), "gpu");
  EXPECT_EQ(cpu.at("world"), "cpu");
  for (const json& row : result.at("rows")) {
    SCOPED_TRACE(row.at("world"));
    EXPECT_EQ(row.at("scene"), "stack");
    EXPECT_EQ(row.at("bodies"), 28) << "27 boxes and the ground";
    EXPECT_FALSE(row.at("device").get<std::string>().empty());
    EXPECT_GT(row.at("msMedian"), 0.0);
    EXPECT_GE(row.at("msP95"), row.at("msMedian"));
    // The same scene at the same step: the bottom layer rests on the ground, whoever steps it.
    EXPECT_GE(row.at("manifolds"), 9);
    EXPECT_GE(row.at("contacts"), row.at("manifolds"));
    EXPECT_LE(row.at("contacts"), 4 * row.at("manifolds").get<int>());
  }
  // Medians of the parts: of some steps the one, of some the other, hence a little room above the median of the whole.
  EXPECT_GT(gpu.at("deviceMs"), 0.0);
  EXPECT_GT(gpu.at("translateMs"), 0.0);
  EXPECT_LE(gpu.at("deviceMs").get<double>() + gpu.at("translateMs").get<double>(),
            1.2 * gpu.at("msP95").get<double>());
  EXPECT_EQ(gpu.at("waits"), 1) << "for the step and its contacts";
  EXPECT_GT(gpu.at("launches"), 20);
  EXPECT_GT(gpu.at("colours"), 0);
  for (const char* name : {"deviceMs", "translateMs", "launches", "waits", "colours"}) {
    EXPECT_TRUE(cpu.at(name).is_null()) << name;
  }
  EXPECT_TRUE(cpu.at("stages").empty());
  std::set<std::string> stages;
  for (const auto& [stage, ms] : gpu.at("stages").items()) {
    EXPECT_GE(ms, 0.0) << stage;
    stages.insert(stage);
  }
  for (const char* stage : {"10_apply_forces", "30_find_pairs", "70_solve_velocities", "90_update_activation"}) {
    EXPECT_EQ(stages.count(stage), 1u) << stage;
  }
}

// The same counts as the comparison's: one world is stepped like the other.
TEST(Bench, CountsAreThoseOfTheComparison) {
  const TemporaryFolder folder;
  const std::string path = folder.file("compare.json");
  ASSERT_EQ(runProgram({BTGPU_TOOL, "compare", "domino", "--size", "4,1,2", "--steps", "4", "--json", path}).exitCode,
            0);
  const json compared = json::parse(readFile(path));
  const json result =
      resultOf({"--scene", "domino", "--size", "4,1,2", "--steps", "4", "--worlds", "gpu", "--contacts", "off"});
  EXPECT_EQ(result.at("rows")[0].at("bodies"), compared.at("bodies"));
  EXPECT_EQ(result.at("rows")[0].at("device"), compared.at("device"));
  EXPECT_EQ(result.at("steps"), compared.at("steps"));
  EXPECT_EQ(result.at("rows")[0].at("manifolds"), 8) << "each domino stands on the plane";
  EXPECT_EQ(result.at("contacts"), false);
  EXPECT_EQ(result.at("rows")[0].at("waits"), 1) << "no contacts to wait for";
}

TEST(Bench, TableOnStdout) {
  const Finished run = bench({"--size", "2,2,2", "--steps", "4", "--worlds", "cpu,gpu", "--host-queries", "off"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const auto lines = run.outLines();
  ASSERT_GT(lines.size(), 8u);
  EXPECT_EQ(lines[0], "stack: 9 bodies, 4 steps, figures of the last 2; solver parity, sleeping off, contacts on, host queries off, motion states off");
  EXPECT_TRUE(contains(lines[1], "ms median")) << lines[1];
  EXPECT_EQ(lines[2].rfind("  cpu ", 0), 0u) << "worlds in the order they were asked for: " << lines[2];
  EXPECT_TRUE(contains(lines[2], " 1.00 ")) << "cpu is the measure: " << lines[2];
  EXPECT_EQ(lines[3].rfind("  gpu ", 0), 0u) << lines[3];
  EXPECT_TRUE(contains(run.out, "translation")) << run.out;
  EXPECT_TRUE(contains(run.out, "70_solve_velocities")) << run.out;
}

TEST(Bench, CsvHasALineAWorldAndAColumnAFigure) {
  const TemporaryFolder folder;
  const std::string path = folder.file("bench.csv");
  const Finished run = bench({"--size", "2,2,2", "--steps", "4", "--worlds", "gpu,cpu", "--csv", path});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  std::istringstream file(readFile(path));
  std::string line;
  std::vector<std::vector<std::string>> rows;
  while (std::getline(file, line)) rows.push_back(split(line));
  ASSERT_EQ(rows.size(), 3u);
  const std::vector<std::string> first(rows[0].begin(), rows[0].begin() + 22);
  EXPECT_EQ(first, (std::vector<std::string>{"scene",
                                             "size",
                                             "world",
                                             "device",
                                             "bodies",
                                             "steps",
                                             "msMedian",
                                             "msP95",
                                             "timesCpu",
                                             "deviceMs",
                                             "translateMs",
                                             "restMs",
                                             "launches",
                                             "waits",
                                             "manifolds",
                                             "contacts",
                                             "colours",
                                             "deviceBytes",
                                             "deviceBytesPerBody",
                                             "meanHeight",
                                             "kineticEnergy",
                                             "10_apply_forces"}));
  for (size_t r = 1; r < rows.size(); ++r) ASSERT_EQ(rows[r].size(), rows[0].size()) << r;
  EXPECT_EQ(rows[1][0], "stack");
  EXPECT_EQ(rows[1][1], "2,2,2");
  EXPECT_EQ(rows[1][2], "gpu");
  for (size_t i = 4; i < rows[1].size(); ++i) EXPECT_NO_THROW(std::stod(rows[1][i])) << rows[0][i];
  EXPECT_EQ(rows[2][2], "cpu");
  EXPECT_EQ(std::stod(rows[2][8]), 1.0) << "cpu is the measure";
  EXPECT_EQ(rows[2][9], "") << "stock has no device time";
  EXPECT_EQ(rows[2][21], "");
}

// Arrays that grow with the scene are in it, and not much else: the states of bodies alone take 200 bytes and more.
TEST(Bench, MemoryGrowsWithTheScene) {
  const auto bytes = [](const char* size) {
    return resultOf({"--size", size, "--steps", "4", "--worlds", "gpu", "--stages", "off"})
        .at("rows")[0]
        .at("deviceBytes")
        .get<double>();
  };
  const double small = bytes("4,4,4"), large = bytes("12,12,12");
  EXPECT_GT(small, 65 * 200.0);
  EXPECT_GT(large - small, (12 * 12 * 12 - 4 * 4 * 4) * 200.0);
  EXPECT_LT(large, 1e9);
}

TEST(Bench, OneRunForEachSceneAndSize) {
  const json file = fileOf({"--scene", "stack,large_pyramid", "--bodies", "10,30", "--steps", "4", "--worlds",
                            "gpu,cpu:20", "--stages", "off"});
  EXPECT_EQ(file.at("version").get<std::string>().find('.'), 1u);
  EXPECT_FALSE(file.at("processor").get<std::string>().empty());
  const json& runs = file.at("runs");
  ASSERT_EQ(runs.size(), 4u);
  const std::vector<std::pair<std::string, int>> wanted = {
      {"stack", 9}, {"stack", 28}, {"large_pyramid", 11}, {"large_pyramid", 29}};
  for (size_t i = 0; i < runs.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(runs[i].at("scene"), wanted[i].first);
    const bool small = wanted[i].second <= 20;
    ASSERT_EQ(runs[i].at("rows").size(), small ? 2u : 1u) << "cpu up to 20 bodies";
    for (const json& row : runs[i].at("rows")) EXPECT_EQ(row.at("bodies"), wanted[i].second);
    EXPECT_EQ(runs[i].at("leftOut").size(), small ? 0u : 1u);
    EXPECT_TRUE(runs[i].at("rows")[0].at("stages").empty()) << "--stages off";
    EXPECT_EQ(runs[i].at("error"), "");
  }
}

TEST(Bench, OneLineAWorldAtTheEndOfAList) {
  const Finished run =
      bench({"--scene", "stack,domino", "--bodies", "8", "--steps", "4", "--worlds", "cpu", "--stages", "off"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const auto lines = run.outLines();
  ASSERT_GT(lines.size(), 3u);
  EXPECT_EQ(lines[lines.size() - 3].rfind("scene ", 0), 0u) << run.out;
  EXPECT_EQ(lines[lines.size() - 2].rfind("stack ", 0), 0u) << run.out;
  EXPECT_EQ(lines[lines.size() - 1].rfind("domino ", 0), 0u) << run.out;
}

// In a list, a world that can't hold a scene does not end the run; alone it does (BuiltWithoutBullet3...).
TEST(Bench, InAListAWorldIsLeftOut) {
  const TemporaryFolder folder;
  const std::string path = folder.file("bench.json");
  const Finished run =
      bench({"--scene", "stack,domino", "--bodies", "8", "--steps", "4", "--worlds", "cpu,bullet3", "--json", path}, {},
            BTGPU_TOOL_WITHOUT_BULLET3);
  EXPECT_EQ(run.exitCode, 0) << run.err;
  const json runs = json::parse(readFile(path)).at("runs");
  ASSERT_EQ(runs.size(), 2u);
  for (const json& result : runs) {
    EXPECT_EQ(result.at("rows").size(), 1u);
    ASSERT_EQ(result.at("leftOut").size(), 1u);
    EXPECT_TRUE(contains(result.at("leftOut")[0], "install libbullet-dev"));
  }
}

TEST(Bench, StockAloneNeedsNoDevice) {
  const RunOptions noDevice{{"OCL_ICD_VENDORS=/nonexistent", "BTGPU_ENGINE=/nonexistent/engine.so"}};
  const json result = resultOf({"--size", "2,2,2", "--steps", "4", "--worlds", "cpu"}, noDevice);
  ASSERT_EQ(result.at("rows").size(), 1u);
  EXPECT_EQ(result.at("rows")[0].at("world"), "cpu");
}

// Stock's times under btgpu's name would be the worst of results.
TEST(Bench, NoDeviceIsOne) {
  for (const char* worlds : {"gpu", "cpu,gpu", "bullet3"}) {
    SCOPED_TRACE(worlds);
    expectOneLine(bench({"--size", "2,2,2", "--worlds", worlds}, {{"OCL_ICD_VENDORS=/nonexistent"}}), 1,
                  {"no OpenCL device", "install", "--worlds cpu"});
  }
}

TEST(Bench, BadUsageIsTwo) {
  const std::string help = "btgpu --help";
  expectOneLine(bench({"--worlds", "gpu,physx"}), 2, {"physx", "gpu, cpu and bullet3"});
  expectOneLine(bench({"--worlds", "cpu,cpu"}), 2, {"cpu twice"});
  expectOneLine(bench({"--worlds", "cpu:many"}), 2, {"cpu:many", "cpu:100000"});
  expectOneLine(bench({"--scene", "slope", "--bodies", "100"}), 2, {"slope", "--size"});
  expectOneLine(bench({"--size", "2,2,2", "--bodies", "100"}), 2, {"--bodies", help});
  expectOneLine(bench({"--worlds"}), 2, {"--worlds", help});
  expectOneLine(bench({"--scene", "nosuch"}), 2, {"nosuch", "btgpu scenes"});
  expectOneLine(bench({"--scene", "/nonexistent.bullet"}), 2, {"/nonexistent.bullet", "check the path"});
  expectOneLine(bench({"--size", "0,1,1"}), 2, {"--size", "as in 8,8,8"});
  expectOneLine(bench({"--steps", "1"}), 2, {"--steps", help});
  expectOneLine(bench({"--contacts", "maybe"}), 2, {"--contacts", help});
  expectOneLine(bench({"--host-queries", ""}), 2, {"--host-queries", help});
  expectOneLine(bench({"--sleeping", "1"}), 2, {"--sleeping", help});
  expectOneLine(bench({"--size", "2,2,2", "--device", "nosuch"}), 2, {"nosuch", "btgpu info"});
  expectOneLine(bench({"--json", ""}), 2, {"--json", "empty"});
}

TEST(Bench, BuiltWithoutBullet3SaysWhatToInstall) {
  const Finished run =
      bench({"--size", "2,2,2", "--steps", "4", "--worlds", "cpu,bullet3"}, {}, BTGPU_TOOL_WITHOUT_BULLET3);
  expectOneLine(run, 2, {"bullet3", "install libbullet-dev", "--worlds"});
}

TEST(Bench, NobodySleepsUnlessAskedTo) {
  const tool::Builder build = tool::builderOf(*scenes::find("stack"), {2, 1, 1});
  tool::TestWorld<btDiscreteDynamicsWorld> usual(build), awake(tool::withoutSleeping(build));
  const auto& bodies = awake.world().getCollisionObjectArray();
  ASSERT_EQ(bodies.size(), 3);
  EXPECT_EQ(bodies[1]->getActivationState(), DISABLE_DEACTIVATION);
  EXPECT_EQ(bodies[2]->getActivationState(), DISABLE_DEACTIVATION);
  EXPECT_NE(bodies[0]->getActivationState(), DISABLE_DEACTIVATION) << "the ground has nothing to stay awake for";
  EXPECT_NE(usual.world().getCollisionObjectArray()[1]->getActivationState(), DISABLE_DEACTIVATION);
}

// What Bullet3 gets to see of a world.
class Bullet3Conversion : public ::testing::Test {
 protected:
  tool::Bullet3Scene convert() { return tool::convertToBullet3(m_run.world, btScalar(1) / 60); }
  void expectRefused(const std::string& what) {
    try {
      convert();
      ADD_FAILURE() << "taken: " << what;
    } catch (const tool::InputError& e) {
      EXPECT_TRUE(contains(e.what(), what)) << e.what();
      EXPECT_TRUE(contains(e.what(), "leave bullet3 out of --worlds")) << e.what();
    }
  }
  WorldOf<btDiscreteDynamicsWorld> m_run;
};

TEST_F(Bullet3Conversion, StaticBodiesComeFirstAndShapesAreShared) {
  scenes::Objects& o = m_run.objects;
  btBoxShape* box = o.box(btVector3(1, 2, 3));
  o.world().setGravity(btVector3(0, -10, 0));
  o.add(2, box, btVector3(1, 0, 0))->setLinearVelocity(btVector3(4, 5, 6));
  o.add(0, box, btVector3(7, 0, 0));
  o.add(1, o.sphere(btScalar(0.5)), btVector3(2, 0, 0));
  const tool::Bullet3Scene scene = convert();
  ASSERT_EQ(scene.bodies.size(), 3u);
  ASSERT_EQ(scene.shapes.size(), 2u);
  EXPECT_EQ(scene.gravity[1], -10.0f);
  EXPECT_EQ(scene.bodies[0].mass, 0.0f);
  EXPECT_EQ(scene.bodies[0].position[0], 7.0f);
  EXPECT_EQ(scene.bodies[1].mass, 2.0f);
  EXPECT_EQ(scene.bodies[1].linearVelocity[2], 6.0f);
  EXPECT_EQ(scene.bodies[0].shape, scene.bodies[1].shape);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(scene.shapes[0].halfExtents[i], i + 1, 1e-6) << "margin included";
  EXPECT_EQ(scene.shapes[1].radius, 0.5f);
}

// The top of the box that stands for a plane lies where the plane is.
TEST_F(Bullet3Conversion, PlanesBecomeBoxes) {
  const btVector3 normal = btVector3(1, 2, -2) / 3;
  const btTransform pose(btQuaternion(btVector3(0, 0, 1), btScalar(0.3)), btVector3(5, 6, 7));
  m_run.objects.add(0, m_run.objects.plane(normal, btScalar(1.5)), pose);
  const tool::Bullet3Scene scene = convert();
  ASSERT_EQ(scene.bodies.size(), 1u);
  const tool::Bullet3Body& box = scene.bodies[0];
  const btTransform boxPose(
      btQuaternion(box.orientation[0], box.orientation[1], box.orientation[2], box.orientation[3]),
      btVector3(box.position[0], box.position[1], box.position[2]));
  const btVector3 top = boxPose * btVector3(0, scene.shapes[0].halfExtents[1], 0);
  const btVector3 up = boxPose.getBasis() * btVector3(0, 1, 0), wanted = pose.getBasis() * normal;
  // Single precision, lengths of 400.
  EXPECT_NEAR(up.dot(wanted), 1, 1e-5);
  EXPECT_NEAR(wanted.dot(top - pose * (normal * btScalar(1.5))), 0, 1e-3);
}

TEST_F(Bullet3Conversion, WhatItCantHoldIsNamed) {
  btCylinderShape cylinder(btVector3(1, 1, 1));
  btRigidBody* body = m_run.objects.add(1, &cylinder, btVector3(0, 0, 0));
  expectRefused("CylinderY");
  body->setCollisionShape(m_run.objects.sphere(1));
  convert();
  body->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
  expectRefused("kinematic");
  body->setCollisionFlags(0);
  btPoint2PointConstraint joint(*body, btVector3(0, 0, 0));
  m_run.world.addConstraint(&joint);
  expectRefused("joints");
  m_run.world.removeConstraint(&joint);
  EXPECT_THROW(tool::convertToBullet3(m_run.world, btScalar(1) / 120), tool::InputError);
}

}  // namespace
}  // namespace btgpu::test
