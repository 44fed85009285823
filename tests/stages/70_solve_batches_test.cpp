// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/70_solve_batches.h"

#include "gpu_engine/stages/60_batch_constraints.h"
#include "gpu_engine/stages/65_prepare_contacts.h"
#include "gpu_engine/stages/70_solve_velocities_reference.h"
#include "kernels/lib/batches.h"
#include "kernels/lib/vec.h"
#include "tests/support/contact_scene.h"
#include "tests/support/device_test.h"

namespace btgpu {
namespace {

class SolveBatchesTest : public DeviceTest {
 protected:
  SolveReference read(StageBench& bench, const ContactScene& scene) {
    DeviceWorld& w = bench.world();
    return {bench.read(w.solverBodies, w.bodyCount),
            bench.read(w.rows),
            bench.read(w.tangent2),
            bench.read(w.torsion),
            bench.read(w.manifolds, scene.manifolds.size()),
            {},
            {}};
  }

  SolveReference expectAsReference(const ContactScene& scene, uint launches = 2) {
    const auto bench = benchForContacts(queue(), scene);
    writeConstraints(*bench, scene, BATCH_BLOCK * scene.manifolds.size() + 2 * BTGPU_LANES);
    bench->run<BatchConstraints>(scene.settings);
    bench->run<PrepareContacts>();
    m_serialCount = bench->counters().serialCount;
    const SolveReference before = read(*bench, scene);
    bench->world().capacities.colourLaunches = launches;
    bench->run<SolveBatches>(scene.settings, scene.torsionRows);
    const SolveReference device = read(*bench, scene);
    Contract contract("70_solve_batches");
    checkSolvedVelocities(contract, bench->params(), scene.settings.iterations, readSlots(*bench),
                          bench->read(bench->world().solverMasses, bench->world().bodyCount), before, device);
    EXPECT_TRUE(contract.ok()) << contract.text();
    return device;
  }

  static void expectSame(const SolveReference& a, const SolveReference& b) {
    for (size_t i = 0; i < a.bodies.size(); ++i) ASSERT_TRUE(sameBits(a.bodies[i], b.bodies[i])) << "body " << i;
    for (size_t m = 0; m < a.manifolds.size(); ++m) ASSERT_TRUE(sameBits(a.manifolds[m], b.manifolds[m])) << m;
  }

  uint m_serialCount = 0;  // of the last scene
};

void setVariant(ContactScene& scene, uint bits) {
  scene.settings.warmStarting = bits & 1;
  scene.settings.splitImpulse = bits & 2;
  scene.settings.interleaveContactAndFriction = bits & 4;
  scene.settings.twoFrictionDirections = bits & 8;
  scene.torsionRows = bits & 16;
  scene.settings.groupSplit = bits & 1 ? GroupSplit::Space : GroupSplit::Index;
}

TEST_F(SolveBatchesTest, RandomSmall) {
  std::mt19937 random(1);
  for (const uint bits : {8u, 31u}) {
    ContactScene scene = randomContacts(random, {12, 14});
    setVariant(scene, bits);
    scene.settings.iterations = 2;
    expectAsReference(scene);
  }
}

TEST_F(SolveBatchesTest, Random) {
  std::mt19937 random(2);
  for (uint bits = 0; bits < 32; ++bits) {
    SCOPED_TRACE(bits);
    ContactScene scene = randomContacts(random, {150, 200});
    setVariant(scene, bits);
    for (const int iterations : {0, 1, 10}) {
      scene.settings.iterations = iterations;
      expectAsReference(scene);
      if (HasFailure()) return;
    }
  }
}

// Several groups a phase; and what is a launch is a question of speed: the result is the same, bit by bit.
TEST_F(SolveBatchesTest, LaunchesDoNotMatter) {
  std::mt19937 random(3);
  for (const GroupSplit by : {GroupSplit::Space, GroupSplit::Index}) {
    ContactScene scene = randomContacts(random, {1500, 4000});
    setVariant(scene, 19);
    scene.settings.groupSplit = by;
    scene.settings.iterations = 3;
    const SolveReference inPhases = expectAsReference(scene);
    expectSame(expectAsReference(scene), inPhases);
    scene.settings.batchLaunches = BatchLaunches::Batch;
    for (const uint launches : {0u, 1u, 7u, uint{BATCH_LIMIT}})
      expectSame(expectAsReference(scene, launches), inPhases);
  }
}

// More contacts of a body than a group has batches.
TEST_F(SolveBatchesTest, SerialBatch) {
  std::mt19937 random(4);
  ContactScene scene;
  const int shape = scene.builder.sphere(0.5f);
  const uint hub = scene.builder.add(shape, {}, 16);
  for (uint i = 0; i < 1500; ++i) {
    const uint other = scene.builder.add(shape, uniform3(random, -3, 3), 1);
    scene.builder.velocity(other).linear = uniform3(random, -3, 3);
    const float4 normal = rotate(randomTurn(random), {0, 1, 0, 0});
    scene.addPoint(scene.addManifold(hub, other), normal, -0.01f, normal * -0.5f, normal * 0.5f);
  }
  scene.settings.iterations = 3;
  expectAsReference(scene);
  EXPECT_GT(m_serialCount, 0u);
}

}  // namespace
}  // namespace btgpu
