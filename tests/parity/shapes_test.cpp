// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A rain of each shape on each ground, and each shape thrown over it, held against stock as `btgpu compare` does: in
// each step contacts, solver, integration and sleeping, and the run as a whole. BTGPU_TEST_SCENES=all: all of them, at
// their own length; else each shape once, falling or thrown, on one of the grounds, for a second and a half.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <cstring>

#include "tools/btgpu/compare.h"

namespace btgpu::tool {
namespace {

constexpr int kShortSteps = 90;

bool all() {
  const char* wish = std::getenv("BTGPU_TEST_SCENES");
  return wish && std::strcmp(wish, "all") == 0;
}

// The list is one of shapes on three grounds each, rains first.
std::vector<const scenes::Scene*> chosen() {
  const auto& list = scenes::ofShapes();
  constexpr size_t kGrounds = 3;
  const size_t kinds = list.size() / 2 / kGrounds;
  std::vector<const scenes::Scene*> out;
  for (size_t i = 0; i < list.size(); ++i) {
    const size_t kind = i / kGrounds % kinds, ground = i % kGrounds;
    const bool thrown = i >= kinds * kGrounds;
    if (all() || (ground == kind % kGrounds && thrown == (kind / kGrounds % 2 == 1))) out.push_back(&list[i]);
  }
  return out;
}

class Shapes : public ::testing::TestWithParam<const scenes::Scene*> {};

TEST_P(Shapes, AreAsInStock) {
  const scenes::Scene& scene = *GetParam();
  scenes::Expectations expectations = scene.expectations;
  CompareOptions options;
  options.timeStep = scene.timeStep;
  options.steps = all() ? scene.steps : kShortSteps;
  if (!all()) expectations.comesToRest = scenes::Rest::No;  // so soon
  const CompareResult result = compare(scene.name, builderOf(scene, scene.size), expectations, options);
  EXPECT_TRUE(result.pass()) << toText(result);
}

INSTANTIATE_TEST_SUITE_P(Each, Shapes, ::testing::ValuesIn(chosen()), [](const auto& p) { return p.param->name; });

}  // namespace
}  // namespace btgpu::tool
