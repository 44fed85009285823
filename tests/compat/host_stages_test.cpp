// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stages run on the host in place of the device, and stages held against their references while an application runs.
#include "tests/support/changed_kernels.h"
#include "tests/support/facade_world.h"
#include "tests/support/scoped_environment.h"
#include "tests/support/world_hash.h"

namespace btgpu::test {
namespace {

// A class of the application's own: its shapes are the host's.
class OwnCylinder : public btCylinderShape {
 public:
  using btCylinderShape::btCylinderShape;
};

btScalar s(double v) { return static_cast<btScalar>(v); }

// Something for every stage: all shapes, a joint, a shape that Bullet collides, sleepers that are hit.
class Heap {
 public:
  explicit Heap(const btGpuSettings& settings = {}) : m_world(settings) {
    auto& o = m_world.objects;
    m_world.world.setGravity(btVector3(0, -10, 0));
    o.add(0, o.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    o.add(0, o.box(btVector3(3, 1, 3)), btVector3(8, -1, 0));
    btBoxShape* crate = o.box(btVector3(s(0.5), s(0.4), s(0.5)));
    btConvexHullShape* drum = o.hull(scenes::prism(7, 0.4, 0.5));
    btSphereShape* ball = o.sphere(s(0.4));
    btCapsuleShape* capsule = o.capsule(s(0.3), s(0.7));
    for (int k = 0; k < 6; ++k) {
      o.add(1, crate, btVector3(s(0.05 * k), s(0.4 + 0.81 * k), 0));
      o.add(1, drum, btVector3(s(2 + 0.1 * k), s(0.6 + 1.1 * k), s(0.1 * k)));
      o.add(1, ball, btVector3(s(7 + 0.2 * k), s(0.4 + 0.9 * k), s(0.1 * k)))->setRestitution(s(0.5));
      o.add(1, capsule, btVector3(s(-2 - 0.1 * k), s(0.7 + 1.2 * k), 0))->setRollingFriction(s(0.1));
    }
    btRigidBody* hung = o.add(1, ball, btVector3(-6, 3, 0));
    o.joint<btPoint2PointConstraint>(false, *hung, btVector3(0, 1, s(0.5)));
    o.add(1, &m_cylinder, btVector3(-8, s(0.6), 0));
    o.add(1, crate, btVector3(12, s(0.4), 5))->forceActivationState(ISLAND_SLEEPING);
    o.add(1, ball, btVector3(12, s(1.5), 5));
  }
  Heap& run(int steps = 40) {
    for (int i = 0; i < steps; ++i) {
      m_world.run(1);
      m_hash.add(m_world.world);
    }
    return *this;
  }
  void configure(const btGpuSettings& settings) { btGpuDynamicsWorld::configure(&m_world.world, settings); }
  std::uint64_t hash() const { return m_hash.value(); }
  btGpuStatistics statistics() const { return m_world.world.statistics(); }
  std::string report() const { return reportText(m_world.world); }
  double height() const {
    double sum = 0;
    for (const btRigidBody* b : m_world.objects.bodies()) sum += double(b->getWorldTransform().getOrigin().y());
    return sum;
  }

 private:
  OwnCylinder m_cylinder{btVector3(s(0.4), s(0.5), s(0.4))};
  GpuWorld m_world;
  WorldHash m_hash;
};

btGpuSettings onHost(const std::string& stages) {
  btGpuSettings settings;
  settings.m_hostStages = stages;
  return settings;
}

TEST(HostStages, CheckedStepsKeepTheirBitsAndAgree) {
  btGpuSettings settings;
  settings.m_checkStages = true;
  Heap checked(settings), plain;
  EXPECT_EQ(checked.run().hash(), plain.run().hash());
  EXPECT_EQ(checked.statistics().m_deviceSteps, 40u) << checked.report();
  EXPECT_EQ(checked.statistics().m_stageDifferences, 0u) << checked.statistics().m_firstStageDifference;
}

// Stages that make nothing but integers and copies give the same bits on the host.
TEST(HostStages, ExactOnesGiveTheSameBits) {
  const std::uint64_t device = Heap().run().hash();
  for (const char* stages : {"30", "35", "50", "55", "60", "90", "95", "30,35,50,55,60,90,95", "30_find_pairs"}) {
    Heap heap(onHost(stages));
    EXPECT_EQ(heap.run().hash(), device) << stages;
    EXPECT_EQ(heap.statistics().m_stockSteps, 0u) << stages << heap.report();
  }
}

// The others round otherwise: the heap moves alike, and what the device does with their results is within its contract.
TEST(HostStages, OthersGiveTheSameMotion) {
  Heap plain;
  plain.run(5);
  for (const char* stages : {"10", "20", "42", "44", "46", "48", "52", "65", "70", "80",
                             "10,20,30,35,42,44,46,48,50,52,55,60,65,70,80,90,95"}) {
    btGpuSettings settings = onHost(stages);
    settings.m_checkStages = true;
    Heap heap(settings);
    heap.run(5);
    // Later small differences have grown, as they do in any heap.
    EXPECT_NEAR(heap.height(), plain.height(), 1e-3) << stages;
    heap.run(15);
    EXPECT_EQ(heap.statistics().m_stockSteps, 0u) << stages << heap.report();
    EXPECT_EQ(heap.statistics().m_stageDifferences, 0u) << stages << ": " << heap.statistics().m_firstStageDifference;
  }
}

// ---- the solver variants

struct Variant {
  const char* name;
  btGpuSolver solver;
  btGpuGroupSplit split;
  btGpuBatchLaunches launches;
  btGpuSettings settings() const {
    btGpuSettings s;
    s.m_solver = solver;
    s.m_groupSplit = split;
    s.m_batchLaunches = launches;
    return s;
  }
};

const Variant kVariants[] = {
    {"mass_splitting", btGpuSolver::MassSplitting, btGpuGroupSplit::Space, btGpuBatchLaunches::Phase},
    {"space, phase", btGpuSolver::TwoLevel, btGpuGroupSplit::Space, btGpuBatchLaunches::Phase},
    {"space, batch", btGpuSolver::TwoLevel, btGpuGroupSplit::Space, btGpuBatchLaunches::Batch},
    {"index, phase", btGpuSolver::TwoLevel, btGpuGroupSplit::Index, btGpuBatchLaunches::Phase},
    {"index, batch", btGpuSolver::TwoLevel, btGpuGroupSplit::Index, btGpuBatchLaunches::Batch}};

TEST(HostStages, VariantsAgreeAndAreTheSameTwice) {
  const std::uint64_t parity = Heap().run().hash();
  for (const Variant& variant : kVariants) {
    SCOPED_TRACE(variant.name);
    btGpuSettings settings = variant.settings();
    Heap plain(settings), again(settings);
    const std::uint64_t hash = plain.run().hash();
    EXPECT_EQ(again.run().hash(), hash);
    // So small a world is one group by index, whose batches are the colours of parity mode.
    if (variant.split != btGpuGroupSplit::Index) { EXPECT_NE(hash, parity) << "another solver"; }
    settings.m_checkStages = true;
    Heap checked(settings);
    EXPECT_EQ(checked.run().hash(), hash);
    EXPECT_EQ(checked.statistics().m_deviceSteps, 40u) << checked.report();
    EXPECT_EQ(checked.statistics().m_stageDifferences, 0u) << checked.statistics().m_firstStageDifference;
  }
}

// What is a launch does not show in the result.
TEST(HostStages, LaunchesOfBatchesDoNotMatter) {
  EXPECT_EQ(Heap(kVariants[1].settings()).run().hash(), Heap(kVariants[2].settings()).run().hash());
  EXPECT_EQ(Heap(kVariants[3].settings()).run().hash(), Heap(kVariants[4].settings()).run().hash());
  EXPECT_NE(Heap(kVariants[1].settings()).run().hash(), Heap(kVariants[3].settings()).run().hash());
}

TEST(HostStages, TwoLevelByTheEnvironment) {
  const std::uint64_t expected = Heap(kVariants[4].settings()).run().hash();
  const ScopedVariable solver("BTGPU_SOLVER", "two_level"), words("BTGPU_TWO_LEVEL", "batch,index");
  EXPECT_EQ(Heap().run().hash(), expected);
}

TEST(HostStages, VariantsOnTheHost) {
  for (const Variant& variant : {kVariants[0], kVariants[1], kVariants[3]}) {
    SCOPED_TRACE(variant.name);
    btGpuSettings settings = variant.settings();
    const std::uint64_t hash = Heap(settings).run().hash();
    Heap plain(settings);
    plain.run(5);
    settings.m_hostStages = "60";
    EXPECT_EQ(Heap(settings).run().hash(), hash) << "integers and copies";
    settings.m_hostStages = "60,65,67,70";
    settings.m_checkStages = true;
    Heap heap(settings);
    heap.run(5);
    EXPECT_NEAR(heap.height(), plain.height(), 1e-3);
    EXPECT_EQ(heap.statistics().m_stockSteps, 0u) << heap.report();
    EXPECT_EQ(heap.statistics().m_stageDifferences, 0u) << heap.statistics().m_firstStageDifference;
  }
}

// ---- the pair finders

struct Finder {
  btGpuPairFinder finder;
  const char *name, *stage;
};
const Finder kFinders[] = {{btGpuPairFinder::Grid, "grid", "30_find_pairs_grid"},
                           {btGpuPairFinder::Sweep, "sweep", "30_find_pairs_sweep"},
                           {btGpuPairFinder::IncrementalSweep, "incremental", "30_find_pairs_incremental"},
                           {btGpuPairFinder::BruteForce, "brute_force", "30_find_pairs_brute_force"}};

// All find the same pairs, so that every bit of the world is the same.
TEST(HostStages, PairFindersGiveTheSameBits) {
  constexpr int kSteps = 8;
  const std::uint64_t expected = Heap().run(kSteps).hash();
  for (const Finder& finder : kFinders) {
    SCOPED_TRACE(finder.name);
    btGpuSettings settings;
    settings.m_pairFinder = finder.finder;
    settings.m_checkStages = true;
    Heap checked(settings);
    EXPECT_EQ(checked.run(kSteps).hash(), expected);
    EXPECT_EQ(checked.statistics().m_stageDifferences, 0u) << checked.statistics().m_firstStageDifference;
    settings.m_checkStages = false;
    settings.m_hostStages = finder.stage;
    EXPECT_EQ(Heap(settings).run(kSteps).hash(), expected) << "its reference";
  }
}

// With a fault that keeps body 3 from all others: the stage that is off is named.
TEST(HostStages, PairFinderByTheEnvironment) {
  const ChangedKernels kernels("lib/pair_list.h", "return i != j && isCollidable(other)",
                               "return i != j && i != 3 && j != 3 && isCollidable(other)");
  const ScopedVariable folder("BTGPU_KERNEL_DIR", kernels.path());
  for (const Finder& finder : kFinders) {
    const ScopedVariable variable("BTGPU_PAIR_FINDER", finder.name);
    btGpuSettings settings;
    settings.m_checkStages = true;
    Heap heap(settings);
    heap.run(2);
    EXPECT_GT(heap.statistics().m_stageDifferences, 0u);
    EXPECT_NE(heap.statistics().m_firstStageDifference.find(finder.stage), std::string::npos)
        << heap.statistics().m_firstStageDifference;
  }
}

// Body 23 is behind the whole blocks of 16, which a CPU has other code for.
TEST(HostStages, TurnedOnByConfigure) {
  const ChangedKernels kernels("stages/80_integrate_poses.cl", "if (dynamic && isActiveState",
                               "if (i != 23 && dynamic && isActiveState");
  const ScopedVariable variable("BTGPU_KERNEL_DIR", kernels.path());
  Heap heap;
  EXPECT_EQ(heap.run(2).statistics().m_stageDifferences, 0u) << "nobody asked";
  btGpuSettings settings;
  settings.m_checkStages = true;
  heap.configure(settings);
  EXPECT_EQ(heap.run(2).statistics().m_stageDifferences, 2u);
}

TEST(HostStages, UnknownStageIsSaid) {
  Heap heap(onHost("30,31"));
  heap.run(2);
  EXPECT_EQ(heap.statistics().m_stockSteps, 2u);
  EXPECT_NE(heap.report().find("there is no stage \"31\""), std::string::npos) << heap.report();
}

TEST(HostStages, FirstDifferenceNamesStageAndElement) {
  const ChangedKernels kernels("stages/80_integrate_poses.cl", "if (dynamic && isActiveState",
                               "if (i != 23 && dynamic && isActiveState");
  const ScopedVariable variable("BTGPU_KERNEL_DIR", kernels.path());
  btGpuSettings settings;
  settings.m_checkStages = true;
  Heap heap(settings);
  heap.run(3);
  const btGpuStatistics s = heap.statistics();
  EXPECT_EQ(s.m_stageDifferences, 3u);
  EXPECT_EQ(s.m_firstStageDifference.rfind("step 1, 80_integrate_poses: body 23: position: ", 0), 0u)
      << s.m_firstStageDifference;
  // On the host the stage has no fault.
  settings.m_hostStages = "80";
  Heap healed(settings);
  EXPECT_EQ(healed.run(3).statistics().m_stageDifferences, 0u);
}

}  // namespace
}  // namespace btgpu::test
