// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "pick_points_reference.h"

#include <algorithm>
#include <cmath>

namespace btgpu {
namespace {

using namespace reference;

Vec acrossNormal(const PickRules& rules, Vec v) { return v - rules.normal * dot(rules.normal, v); }

// Unit, across the line from the deepest point to the farthest.
Vec sideOf(const PickRules& rules, Vec deepest, Vec farthest) {
  const Vec side = cross(rules.normal, farthest - deepest);
  return side / length(side);
}

}  // namespace

std::vector<PickCandidate> pickPointsReference(const PickRules& rules, const std::vector<PickCandidate>& candidates) {
  std::vector<PickCandidate> picked;
  // Puts the candidate with the largest measure before those picked already, if that is above `least`.
  const auto take = [&](double least, auto measure) {
    const PickCandidate* best = nullptr;
    for (const PickCandidate& q : candidates) {
      if (!(q.distance < rules.limit) || !(measure(q) > least)) continue;
      least = measure(q);
      best = &q;
    }
    if (best) picked.insert(picked.begin(), *best);
    return best != nullptr;
  };
  if (!take(-INFINITY, [](const PickCandidate& q) { return -q.distance; })) return picked;
  const Vec deepest = picked[0].at;
  const auto farFromDeepest = [&](const PickCandidate& q) { return length(acrossNormal(rules, q.at - deepest)); };
  if (!take(rules.spacing, farFromDeepest)) return picked;
  const Vec side = sideOf(rules, deepest, picked[0].at);
  take(rules.spacing, [&](const PickCandidate& q) { return dot(side, q.at - deepest); });
  take(rules.spacing, [&](const PickCandidate& q) { return -dot(side, q.at - deepest); });
  return picked;
}

void checkPickedPoints(Contract& contract, const PickRules& rules, const std::vector<PickCandidate>& candidates,
                       const std::vector<PickCandidate>& picked, double error) {
  contract.require(picked.size() <= 4, "there are at most four points");
  if (picked.empty()) {
    for (const PickCandidate& q : candidates) {
      contract.within("how far a missing point is within the limit", rules.limit - q.distance, error + q.error);
    }
    return;
  }
  const PickCandidate& deepest = picked.back();
  const size_t others = picked.size() - 1;
  const Vec farthest = others > 0 ? acrossNormal(rules, picked[others - 1].at - deepest.at) : Vec{};
  const Vec side = others > 0 ? sideOf(rules, deepest.at, picked[others - 1].at) : Vec{};
  for (const PickCandidate& p : picked) {
    contract.within("how much deeper a point is than the last one", deepest.distance - p.distance, rules.slack + error);
    contract.within("how far a point is beyond the limit", p.distance - rules.limit, error);
  }
  for (const PickCandidate& q : candidates) {
    const double e = q.error + 2 * error;
    if (q.distance > rules.limit - e) continue;
    contract.within("how much deeper a missing point is than the last one", deepest.distance - q.distance,
                    rules.slack + e);
    const Vec offset = acrossNormal(rules, q.at - deepest.at);
    if (length(offset) <= rules.spacing + e) continue;
    contract.within("how much farther a missing point is from the last one than the last but one",
                    length(offset) - std::max(length(farthest), rules.spacing), e);
    if (others == 0) continue;
    // The line through the last two turns by their error over its length, which no candidate is far beyond.
    const double across = dot(side, offset), sideError = e + 2 * error;
    if (std::fabs(across) <= rules.spacing + sideError) continue;
    double reach = rules.spacing;
    for (size_t k = 0; k + 1 < others; ++k) {
      reach = std::max(reach, std::copysign(1.0, across) * dot(side, picked[k].at - deepest.at));
    }
    contract.within("how much farther a missing point is from the line through the last two", std::fabs(across) - reach,
                    sideError);
  }
}

}  // namespace btgpu
