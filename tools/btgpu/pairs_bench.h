// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The ways of finding pairs by themselves, and Bullet's btDbvtBroadphase, on the same AABBs (bench --scene pairs).
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace btgpu::tool {

// What the paper says the choice of a broadphase depends on.
struct PairsCriteria {
  double moving = 1;    // share of the bodies that move
  double speed = 0.05;  // a step, in sizes of a body
  double spread = 2;    // size of the largest to that of the smallest; sizes are even on a logarithmic scale
  double churn = 0;     // share of the bodies that are removed in each step and added elsewhere, in another size
};

// Limits are in bodies: above them a finder is left out.
struct PairsWish {
  std::string name;  // of pairsWorldNames()
  long mostBodies;
};

struct PairsOptions {
  std::vector<PairsWish> worlds;
  std::string device;
  int steps = 20;                     // the second half is measured
  std::function<void(int)> progress;  // called with the number of steps done
};

struct PairsRow {
  std::string world;
  double msMedian = 0, msP95 = 0;
  std::size_t repeated = 0;  // measured steps in which there was too little room at first; only the second try counts
};

struct PairsResult {
  int bodies = 0;
  PairsCriteria criteria;
  std::size_t pairs = 0;      // of the last step, as btgpu has them
  std::size_t dbvtPairs = 0;  // as btDbvtBroadphase has them; 0 without it
  std::vector<PairsRow> rows;
  std::vector<std::string> leftOut;
};

// "bvh", "grid", ... as in BTGPU_PAIR_FINDER, and "dbvt".
std::vector<std::string> pairsWorldNames();

// Steps all in turn. Throws std::runtime_error if one fails, if two finders differ, or if a pair is missing in
// Bullet's.
PairsResult benchPairs(int bodies, const PairsCriteria& criteria, const PairsOptions& options);

std::string toText(const PairsResult& result);
std::string toCsv(const std::vector<PairsResult>& results);

}  // namespace btgpu::tool
