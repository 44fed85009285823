// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The debug build of the kernels: silent in a sound world, whose results stay the same, and with a word for each fault
// that is planted in a kernel - what, where, by which work item - while nothing is written where it must not be.
#include <cstdlib>

#include "gpu_engine/world_engine.h"
#include "kernels/shared/debug.h"
#include "tests/support/changed_kernels.h"
#include "tests/support/device_test.h"
#include "tests/support/mixed_world.h"
#include "tests/support/same_bits.h"
#include "tests/support/scoped_environment.h"

namespace btgpu {
namespace {

bool gpuShape() {
  static const bool gpu = ComputeDevice::open("")->shape() == KernelShape::Gpu;
  return gpu;
}

EngineSettings debugSettings() {
  EngineSettings settings;
  settings.debugKernels = true;
  return settings;
}

// An engine and what its host knows.
struct Side {
  Side(const WorldInput& world, const EngineSettings& settings) : input(world), engine(settings) {}

  const StepResults& step(StepSettings settings = {}) {
    engine.begin(input, settings);
    engine.finish(results);
    input.poses.values = results.poses;
    input.velocities.values = results.velocities;
    input.activations.values = results.activations;
    input.clearChanges();
    return results;
  }

  WorldInput input;
  WorldEngine engine;
  StepResults results;
};

// Twelve boxes in a row, each in touch with the next: 11 pairs of boxes, in the order of their bodies.
WorldInput rowOfBoxes() {
  WorldBuilder b;
  const int box = b.box({0.5f, 0.5f, 0.5f, 0});
  for (int i = 0; i < 12; ++i) b.add(box, {0.99f * float(i), 0, 0, 0});
  return b.finish();
}

// The steps of the row with a fault in a kernel.
StepResults stepWith(const std::string& file, const std::string& old, const std::string& faulty, int steps = 1) {
  const test::ChangedKernels kernels(file, old, faulty);
  const ScopedVariable changed("BTGPU_KERNEL_DIR", kernels.path());
  Side side(rowOfBoxes(), debugSettings());
  for (; steps > 1; --steps) side.step();
  return side.step();
}

// Where text stands in a kernel's file.
std::string placeOf(const std::string& file, const std::string& text) {
  const std::string all = test::readFile(BTGPU_SOURCE_DIR "/kernels/" + file);
  const auto end = all.begin() + static_cast<std::ptrdiff_t>(all.find(text));
  return "kernels/" + file + " line " + std::to_string(1 + std::count(all.begin(), end, '\n'));
}

// In the GPU shape each item of the fault has a work item of its own; in the CPU shape they are all of the first.
std::string workItem(int item) { return ", work item " + std::to_string(gpuShape() ? item : 0) + ": "; }

const std::string kClip = "stages/46_clip_faces.cl", kSeparate = "stages/44_find_separating_axis.cl";
const std::string kItem = "const uint i = AT(items, first + k);";
const std::string kNoItem = "const uint i = AT(items, first + k + (k == 7 ? 1000000 : 0));";

// Hulls, joints in colours and in the serial batch, contacts of the host; both kinds of solver settings.
TEST(Assertions, ASoundWorldFailsNoneAndStaysTheSame) {
  Side checked(mixedWorldWithJoints(40), debugSettings()), plain(mixedWorldWithJoints(40), {});
  for (int i = 0; i < 6; ++i) {
    StepSettings step;
    step.contacts = true;
    step.twoFrictionDirections = i >= 3;
    checked.step(step);
    plain.step(step);
    EXPECT_EQ(checked.results.failedAssertions, 0u) << i << ": " << checked.results.firstAssertion;
    EXPECT_TRUE(same(checked.results.poses, plain.results.poses)) << i;
    EXPECT_TRUE(same(checked.results.velocities, plain.results.velocities)) << i;
    EXPECT_TRUE(same(checked.results.activations, plain.results.activations)) << i;
    EXPECT_TRUE(same(checked.results.contactKeys, plain.results.contactKeys)) << i;
    EXPECT_TRUE(same(checked.results.hostManifolds, plain.results.hostManifolds)) << i;
    EXPECT_TRUE(same(checked.results.jointImpulses, plain.results.jointImpulses)) << i;
    EXPECT_GT(checked.results.counters.contactPoints, 0u) << i;
  }
  EXPECT_EQ(plain.results.failedAssertions, 0u);
}

// An index that is read from memory.
TEST(Assertions, AnIndexBeyondTheEnd) {
  const StepResults results = stepWith(kClip, kItem, kNoItem);
  EXPECT_GE(results.failedAssertions, 1u);
  EXPECT_EQ(results.firstAssertion.rfind("assertion in 46_clip_faces, clipFaces, " +
                                             placeOf(kClip, "const uint i = AT(items") + workItem(7) +
                                             "items[first + k + (k == 7 ? 1000000 : 0)], index 1000007 of ",
                                         0),
            0u)
      << results.firstAssertion;
}

// What is reported is not done: the zone behind the array stays whole, or it would count as a second failure.
TEST(Assertions, AWriteBeyondTheEndIsNotDone) {
  const StepResults results =
      stepWith(kClip, "AT(contacts, i) = raw;", "AT(contacts, k == 7 ? LENGTH(contacts) : i) = raw;");
  EXPECT_EQ(results.failedAssertions, 1u);
  EXPECT_NE(results.firstAssertion.find("clipFaces, " + placeOf(kClip, "AT(contacts, i) = raw") + workItem(7) +
                                        "contacts[k == 7 ? LENGTH(contacts) : i], index "),
            std::string::npos)
      << results.firstAssertion;
}

// A write that no macro sees.
TEST(Assertions, AnUncheckedWriteBreaksTheGuardZone) {
  for (const char* offset : {"0", "3"}) {
    const StepResults results =
        stepWith(kSeparate, "AT(axes, k) = axis;",
                 "AT(axes, k) = axis;\n    if (k == 7) axes[LENGTH(axes) + " + std::string(offset) + "].code = 1;");
    EXPECT_EQ(results.failedAssertions, 1u) << offset;
    EXPECT_EQ(results.firstAssertion,
              "guard zone in 44_find_separating_axis: something was written behind the end of array 'separating axes'");
  }
}

// Each step anew: the first one's result would do in the second one.
TEST(Assertions, AnOutputThatIsNotWritten) {
  for (const int steps : {1, 2}) {
    const StepResults results = stepWith(kSeparate, "AT(axes, k) = axis;", "if (k != 7) AT(axes, k) = axis;", steps);
    EXPECT_GE(results.failedAssertions, 1u);
    EXPECT_EQ(results.firstAssertion,
              "assertion in 46_clip_faces, clipFaces, " + placeOf(kClip, "ASSERT(axis.code >= -1") + workItem(7) +
                  "axis.code >= -1 && axis.code <= 14, values " + std::to_string(DEBUG_PATTERN) + " and 7");
  }
}

// Floats are told as such; and a kernel of a step's later part is named with its own stage.
TEST(Assertions, AnAssertionAboutFloats) {
  const StepResults results = stepWith(kSeparate, "AT(axes, k) = axis;",
                                       "AT(axes, k) = axis;\n    if (k == 7) AT(axes, k).normal = vec3(0.5f, 0, 0);");
  EXPECT_NE(results.firstAssertion.find("isUnit(axis.normal), values 0.5 and 0"), std::string::npos)
      << results.firstAssertion;
}

// In the solver's vector code of the CPU shape too: a body that is not there.
TEST(Assertions, ABodyThatIsNotThere) {
  const StepResults results = stepWith("lib/slots.h", "  AT(slots, s) = header;",
                                       "  if (s == 0) header.bodyA = 500000;\n  AT(slots, s) = header;");
  EXPECT_GE(results.failedAssertions, 1u);
  EXPECT_EQ(results.firstAssertion.rfind("assertion in 70_solve_velocities, solve", 0), 0u) << results.firstAssertion;
  EXPECT_NE(results.firstAssertion.find("bodies[h.bodyA], index 500000 of 12"), std::string::npos)
      << results.firstAssertion;
}

// The count goes on from zero, and the text is that of the step.
TEST(Assertions, EachStepHasItsOwn) {
  const test::ChangedKernels kernels(kClip, kItem, kNoItem);
  Side sound(rowOfBoxes(), debugSettings());
  EXPECT_EQ(sound.step().failedAssertions, 0u);
  const ScopedVariable changed("BTGPU_KERNEL_DIR", kernels.path());
  Side faulty(rowOfBoxes(), debugSettings());
  const unsigned long first = faulty.step().failedAssertions;
  EXPECT_GT(first, 0u);
  EXPECT_EQ(faulty.step().failedAssertions, first);
}

// Asked for by the environment; without it the same fault (harmless by itself) goes unnoticed.
TEST(Assertions, OnlyIfAskedFor) {
  const test::ChangedKernels kernels(kClip, "    AT(contacts, i) = raw;",
                                     "    ASSERT(k != 7, k, 23);\n    AT(contacts, i) = raw;");
  const ScopedVariable changed("BTGPU_KERNEL_DIR", kernels.path());
  Side plain(rowOfBoxes(), {});
  EXPECT_EQ(plain.step().failedAssertions, 0u);
  const ScopedVariable on("BTGPU_DEBUG_KERNELS", "1");
  Side checked(rowOfBoxes(), {});
  EXPECT_EQ(checked.step().failedAssertions, 1u);
  EXPECT_NE(checked.results.firstAssertion.find(workItem(7) + "k != 7, values 7 and 23"), std::string::npos)
      << checked.results.firstAssertion;
}

}  // namespace
}  // namespace btgpu
