// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btgpu convergence: the solvers, number of iterations by number of iterations.
#include <algorithm>
#include <nlohmann/json.hpp>

#include <gtest/gtest.h>
#include "tests/support/subprocess.h"

namespace btgpu::test {
namespace {

using nlohmann::json;

Finished convergence(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {BTGPU_TOOL, "convergence"});
  return runProgram(arguments);
}

std::vector<double> figures(const json& file, const std::string& solver, const char* what) {
  for (const json& line : file.at("lines")) {
    if (line.at("solver") == solver) return line.at(what).get<std::vector<double>>();
  }
  ADD_FAILURE() << "no line of " << solver;
  return std::vector<double>(4, 0.0);
}

// A stack that has come down, and one hung together by joints. The paper's finding: Jacobi with split masses converges,
// more slowly than Gauss-Seidel; how the constraints are batched makes little difference.
TEST(Convergence, JacobiIsSlowerAndOrderMattersLittle) {
  for (const std::string scene : {"stack", "ragdoll"}) {
    SCOPED_TRACE(scene);
    const TemporaryFolder folder;
    const Finished run = convergence({scene, "--size", scene == "stack" ? "4,4,4" : "1,1,1", "--steps", "60",
                                      "--iterations", "1,10,100,1000", "--json", folder.file("c.json"), "--csv",
                                      folder.file("c.csv"), "--svg", folder.file("c.svg")});
    ASSERT_EQ(run.exitCode, 0) << run.out << run.err;
    const json file = json::parse(readFile(folder.file("c.json")));
    EXPECT_EQ(file.at("deviceDifferences"), 0);
    EXPECT_GT(file.at("contacts"), 0);
    EXPECT_EQ(file.at("joints") > 0, scene == "ragdoll");
    ASSERT_EQ(file.at("lines").size(), 6u);
    const auto parity = figures(file, "parity", "distance"), jacobi = figures(file, "mass_splitting", "distance");
    const auto stock = figures(file, "stock", "distance"), reversed = figures(file, "stock, reversed", "distance");
    EXPECT_LT(parity[2], parity[0] / 2);
    EXPECT_GT(jacobi[1], parity[1]);
    EXPECT_LT(jacobi[3], jacobi[1] / 2) << "it gets there";
    EXPECT_EQ(stock[3], 0.0) << "what all are measured by";
    for (const char* solver : {"two_level, space", "two_level, index"}) {
      const auto line = figures(file, solver, "distance");
      // Within what the order of the rows makes of stock, and the 10 % that compare grants.
      EXPECT_LT(line[1], 1.1 * std::max(stock[1], reversed[1])) << solver;
    }
    const std::string csv = readFile(folder.file("c.csv")), svg = readFile(folder.file("c.svg"));
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 6 * 4);
    for (const json& line : file.at("lines")) {
      EXPECT_NE(svg.find(">" + line.at("solver").get<std::string>() + "</text>"), std::string::npos);
      EXPECT_NE(run.out.find(line.at("solver").get<std::string>()), std::string::npos);
    }
  }
}

TEST(Convergence, BadUsage) {
  EXPECT_EQ(convergence({"nothing"}).exitCode, 2);
  EXPECT_EQ(convergence({"stack", "--iterations", "10,1"}).exitCode, 2);
  EXPECT_EQ(convergence({"stack", "--iterations", "0"}).exitCode, 2);
}

}  // namespace
}  // namespace btgpu::test
