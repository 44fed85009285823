// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "pairs_bench_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <limits>

#include "arguments.h"
#include "bullet_file.h"
#include "commands.h"
#include "pairs_bench.h"
#include "progress.h"

namespace btgpu::tool {
namespace {

constexpr int kBodies = 10000, kSteps = 20;

PairsWish parseWish(const std::string& text) {
  const size_t colon = text.find(':');
  PairsWish wish{text.substr(0, colon), std::numeric_limits<long>::max()};
  const std::vector<std::string> known = pairsWorldNames();
  if (std::find(known.begin(), known.end(), wish.name) == known.end()) {
    std::string list;
    for (const std::string& name : known) list += (list.empty() ? "" : ", ") + name;
    throw InputError(fmt::format("--worlds: {} does not find pairs; there are {}", wish.name, list));
  }
  char rest = 0;
  if (colon != std::string::npos &&
      (std::sscanf(text.c_str() + colon + 1, "%ld%c", &wish.mostBodies, &rest) != 1 || wish.mostBodies < 1)) {
    throw InputError(fmt::format("--worlds {}: give the most bodies behind the colon, as in dbvt:100000", text));
  }
  return wish;
}

std::vector<PairsWish> parseWishes(std::vector<std::string> worlds) {
  if (worlds.empty()) worlds = pairsWorldNames();
  std::vector<PairsWish> wishes;
  for (const std::string& text : worlds) {
    const PairsWish wish = parseWish(text);
    for (const PairsWish& other : wishes) {
      if (other.name == wish.name) throw InputError(fmt::format("--worlds: {} twice; name each once", wish.name));
    }
    wishes.push_back(wish);
  }
  return wishes;
}

std::vector<PairsCriteria> criteriaOf(const PairsBenchArguments& a) {
  const PairsCriteria base{a.moving.front(), a.speed.front(), a.spread.front(), a.churn.front()};
  std::vector<PairsCriteria> all = {base};
  const auto vary = [&](const std::vector<double>& values, double PairsCriteria::*criterion) {
    for (size_t i = 1; i < values.size(); ++i) {
      all.push_back(base);
      all.back().*criterion = values[i];
    }
  };
  vary(a.moving, &PairsCriteria::moving);
  vary(a.speed, &PairsCriteria::speed);
  vary(a.spread, &PairsCriteria::spread);
  vary(a.churn, &PairsCriteria::churn);
  return all;
}

}  // namespace

void addPairsOptions(CLI::App& bench, PairsBenchArguments& arguments) {
  const auto add = [&bench](const char* name, std::vector<double>& values, const char* what, double low, double high) {
    bench.add_option(name, values, what)->delimiter(',')->check(CLI::Range(low, high))->capture_default_str();
  };
  add("--moving", arguments.moving,
      "scene pairs: share of the bodies that move. Of this and the three that follow: a list; the first of each is "
      "run, and then each other one with the first ones of the rest",
      0, 1);
  add("--speed", arguments.speed, "scene pairs: how far they move in a step, in their own size", 0, 1000);
  add("--spread", arguments.spread, "scene pairs: the largest body's size to the smallest's", 1, 1e6);
  add("--churn", arguments.churn, "scene pairs: share of the bodies that each step replaces by others elsewhere", 0, 1);
}

int runPairsBench(const PairsBenchArguments& arguments) {
  PairsOptions options;
  options.worlds = parseWishes(arguments.worlds);
  options.device = arguments.device;
  options.steps = arguments.steps > 0 ? arguments.steps : kSteps;
  checkDevice(options.device);
  std::vector<PairsResult> results;
  for (const int bodies : arguments.bodies.empty() ? std::vector<int>{kBodies} : arguments.bodies) {
    for (const PairsCriteria& criteria : criteriaOf(arguments)) {
      ProgressBar bar("bench pairs", options.steps);
      options.progress = [&bar](int done) { bar.show(done); };
      results.push_back(benchPairs(bodies, criteria, options));
      fmt::print("{}{}", results.size() > 1 ? "\n" : "", toText(results.back()));
      std::fflush(stdout);
      if (!arguments.csv.empty()) writeFile(arguments.csv, toCsv(results));
    }
  }
  return kAgreed;
}

}  // namespace btgpu::tool
