// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The debug build of the kernels in whole worlds: no built-in scene fails an assertion, and each takes the same course
// as in the normal build; and how an application hears of a failure.
#include "tests/support/changed_kernels.h"
#include "tests/support/scoped_environment.h"
#include "tests/support/test_world.h"
#include "tests/support/world_hash.h"

namespace btgpu::test {
namespace {

btGpuSettings debugSettings() {
  btGpuSettings settings;
  settings.m_debugKernels = true;
  return settings;
}

TEST(DebugScenes, NoneFailsAndAllStayTheSame) {
  // The programs of a device live as long as a world uses it.
  GpuWorld keeper(debugSettings());
  scenes::find("stack")->build(keeper.objects, {1, 1, 1});
  keeper.run(1);
  for (const scenes::Scene& scene : scenes::all()) {
    GpuWorld checked(debugSettings()), plain;
    WorldHash checkedHash, plainHash;
    for (GpuWorld* world : {&checked, &plain}) scene.build(world->objects, {3, 3, 3});
    for (int i = 0; i < 4; ++i) {
      checked.run(1, scene.timeStep);
      checkedHash.add(checked.world);
      plain.run(1, scene.timeStep);
      plainHash.add(plain.world);
    }
    const btGpuStatistics statistics = checked.world.statistics();
    EXPECT_GT(statistics.m_deviceSteps, 0u) << scene.name;
    EXPECT_EQ(statistics.m_failedAssertions, 0u) << scene.name << ": " << statistics.m_firstAssertion;
    EXPECT_EQ(checkedHash.value(), plainHash.value()) << scene.name;
  }
}

TEST(DebugScenes, AFailureIsSaidOnceAndCounted) {
  const ChangedKernels kernels("stages/90_update_activation.cl", "KERNEL updateActivation(uint bodyCount",
                               "KERNEL updateActivation(CHECKS uint bodyCount");
  const ScopedVariable changed("BTGPU_KERNEL_DIR", kernels.path());
  const std::string file = kernels.path() + "/kernels/stages/90_update_activation.cl", text = readFile(file);
  const std::string begin = "    const uint flags = infos[i].flags;\n";
  writeFile(file, std::string(text).replace(text.find(begin), begin.size(), begin + "    ASSERT(i != 3, i, 42);\n"));
  GpuWorld run(debugSettings());
  scenes::find("stack")->build(run.objects, {2, 2, 2});
  testing::internal::CaptureStderr();
  run.run(3);
  const std::string said = testing::internal::GetCapturedStderr();
  const btGpuStatistics statistics = run.world.statistics();
  EXPECT_EQ(statistics.m_deviceSteps, 3u);  // they go on
  EXPECT_EQ(statistics.m_failedAssertions, 3u);
  const std::string start =
      "assertion in 90_update_activation, updateActivation, "
      "kernels/stages/90_update_activation.cl line ";
  EXPECT_EQ(statistics.m_firstAssertion.rfind(start, 0), 0u) << statistics.m_firstAssertion;
  EXPECT_NE(statistics.m_firstAssertion.find(": i != 3, values 3 and 42"), std::string::npos);
  EXPECT_EQ(said, "btgpu: " + statistics.m_firstAssertion + "\n");
}

}  // namespace
}  // namespace btgpu::test
