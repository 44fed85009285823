// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Runs one scene and prints what came out, for tests that need a process of its own:
//   hash_run SCENE X Y Z STEPS
#include <cstdio>

#include "hashed_run.h"

int main(int argc, char** argv) {
  if (argc != 6) return 2;
  btgpu::test::RunPlan plan;
  plan.scene = argv[1];
  plan.size = {std::atoi(argv[2]), std::atoi(argv[3]), std::atoi(argv[4])};
  plan.steps = std::atoi(argv[5]);
  btgpu::test::HashedRun run(plan);
  run.step(plan.steps);
  const btgpu::test::RunOutcome o = run.outcome();
  std::printf("%016llx %llu %llu %llu %u %d %d %d\n", static_cast<unsigned long long>(o.hash), o.deviceSteps,
              o.stockSteps, o.repeatedSteps, o.colours, o.asleep, o.programsBuilt, o.programsLoaded);
  return 0;
}
