// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What benchmarks/run_all.sh makes of the figures (BTGPU_TABLES): nothing is lost or mixed up on the way.
#include <fmt/format.h>

#include "bench_run.h"

namespace btgpu::test {
namespace {

Finished tables(const TemporaryFolder& folder) { return runProgram({BTGPU_TABLES, folder.path()}); }

TEST(BenchTables, EveryRunHasItsRowAndEverySceneOfSeveralSizesItsPlot) {
  const TemporaryFolder folder;
  const Finished run = bench({"--scene", "stack,domino", "--bodies", "8,27", "--steps", "4", "--worlds", "gpu,cpu:20",
                              "--json", folder.file("sizes.json")});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const Finished made = tables(folder);
  ASSERT_EQ(made.exitCode, 0) << made.err;
  const std::string text = readFile(folder.file("tables.md"));
  const json file = json::parse(readFile(folder.file("sizes.json")));
  ASSERT_EQ(file.at("runs").size(), 4u);
  for (const json& result : file.at("runs")) {
    const json& gpu = result.at("rows")[0];
    const std::string row =
        fmt::format("| {} | {} | {} | {} |", result.at("scene").get<std::string>(),
                    result.at("size").get<std::string>(), gpu.at("bodies").get<int>(), gpu.at("manifolds").get<int>());
    EXPECT_TRUE(contains(text, row)) << row << "\n" << text;
    const std::string ms =
        fmt::format("| {:.3g} ({:.3g}) |", gpu.at("msMedian").get<double>(), gpu.at("msP95").get<double>());
    EXPECT_TRUE(contains(text, ms)) << ms << "\n" << text;
  }
  EXPECT_TRUE(contains(text, "- stack 3,3,3: cpu: left out")) << text;
  EXPECT_TRUE(contains(text, "`70_solve_velocities`")) << text;
  for (const char* scene : {"stack", "domino"}) {
    const std::string plot = std::string("sizes-") + scene + ".svg";
    EXPECT_TRUE(contains(text, "(" + plot + ")")) << text;
    const std::string svg = readFile(folder.file(plot));
    EXPECT_TRUE(contains(svg, ">btgpu</text>")) << svg;
    EXPECT_TRUE(contains(svg, ">stock</text>")) << svg;
  }
}

TEST(BenchTables, MicroBenchmarksAndDamagedFiles) {
  const TemporaryFolder folder;
  writeFile(folder.file("a.json"), R"({"context": {"device": "some device", "copyGBs": "20.5", "gflops": "100.0"},
    "benchmarks": [{"name": "scan/4096/manual_time", "real_time": 2.5, "time_unit": "ms", "MB": 8.0, "GB/s": 3.2,
    "flops/B": 0.126, "roof%": 15.625}]})");
  ASSERT_EQ(tables(folder).exitCode, 0);
  const std::string text = readFile(folder.file("tables.md"));
  EXPECT_TRUE(contains(text, "some device; copies 20.5 GB/s")) << text;
  EXPECT_TRUE(contains(text, "| scan/4096 | 2500 | 8 | 3.2 | 0.13 | 15.6 |")) << text;
  writeFile(folder.file("b.json"), "{");
  const Finished run = tables(folder);
  EXPECT_EQ(run.exitCode, 1);
  EXPECT_TRUE(contains(run.err, "b.json")) << run.err;
  EXPECT_TRUE(contains(readFile(folder.file("tables.md")), "scan/4096")) << "the others are there all the same";
}

}  // namespace
}  // namespace btgpu::test
