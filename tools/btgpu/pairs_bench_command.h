// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// bench --scene pairs: its options and its run.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace btgpu::tool {

struct PairsBenchArguments {
  std::vector<std::string> worlds;  // as given with --worlds; empty: all
  std::vector<int> bodies;          // empty: 10000
  int steps = 0;                    // 0: 20
  std::string device, csv;
  // The first of each is what the others are varied from, one at a time.
  std::vector<double> moving = {1}, speed = {0.05}, spread = {2}, churn = {0};
};

void addPairsOptions(CLI::App& bench, PairsBenchArguments& arguments);
// Throws InputError.
int runPairsBench(const PairsBenchArguments& arguments);

}  // namespace btgpu::tool
