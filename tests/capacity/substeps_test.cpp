// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The engine one substep ahead of what it is asked for: whatever happens to the substep ahead - adopted, thrown away,
// taken back because the one before it lacked room or put a body into quarantine - the results are those of an engine
// that is asked for one step at a time, bit for bit.
#include <limits>

#include "gpu_engine/world_engine.h"
#include "tests/support/device_test.h"
#include "tests/support/same_bits.h"
#include "tests/support/stage_bench.h"
#include "tests/support/world_builder.h"

namespace btgpu {
namespace {

// An engine and what its host knows.
struct Side {
  Side(const WorldInput& world, size_t pairCapacity = 0) : input(world), engine(settingsFor(pairCapacity)) {}
  static EngineSettings settingsFor(size_t pairCapacity) {
    EngineSettings s;
    s.pairCapacity = pairCapacity;
    return s;
  }

  void step(int substepsToFollow, bool contacts = true) {
    StepSettings s;
    s.contacts = contacts;
    s.iterations = iterations;
    s.substepsToFollow = substepsToFollow;
    engine.begin(input, s);
    engine.finish(results);
    input.poses.values = results.poses;
    input.velocities.values = results.velocities;
    input.activations.values = results.activations;
    for (const uint i : results.quarantined) input.infos.values[i].flags |= BODY_QUARANTINED;
    input.clearChanges();
  }

  WorldInput input;
  WorldEngine engine;
  StepResults results;
  int iterations = StepSettings{}.iterations;
};

// Everything that the two engines' last steps left, on the host and on the device.
void expectSame(Side& ahead, Side& single, const std::string& what) {
  EXPECT_TRUE(same(ahead.results.poses, single.results.poses)) << what;
  EXPECT_TRUE(same(ahead.results.velocities, single.results.velocities)) << what;
  EXPECT_TRUE(same(ahead.results.activations, single.results.activations)) << what;
  EXPECT_EQ(ahead.results.quarantined, single.results.quarantined) << what;
  EXPECT_EQ(ahead.results.counters.pairCount, single.results.counters.pairCount) << what;
  EXPECT_EQ(ahead.results.counters.contactPoints, single.results.counters.contactPoints) << what;
  EXPECT_EQ(ahead.results.counters.colourCount, single.results.counters.colourCount) << what;
  EXPECT_EQ(ahead.results.counters.overflow, 0u) << what;
  EXPECT_FALSE(single.results.prefetched) << what;
  std::vector<Manifold> a, b;
  ahead.engine.readManifolds(a);
  single.engine.readManifolds(b);
  ASSERT_EQ(a.size(), b.size()) << what;
  for (size_t i = 0; i < a.size(); ++i) {
    // What the host has seen is another matter.
    for (Manifold* m : {&a[i], &b[i]}) {
      m->unseen = 0;
      for (ContactPoint& p : m->points) p.flags &= POINT_BULLET_FLAGS;
      for (int k = m->pointCount; k < MANIFOLD_POINTS; ++k) m->points[k] = ContactPoint{};
    }
    EXPECT_TRUE(sameBits(a[i], b[i])) << what << ", manifold " << i;
  }
}

// Balls and boxes in a heap on a plane, falling.
WorldInput heap(uint bodies) {
  WorldBuilder b;
  const int plane = b.plane({0, 1, 0, 0}, 0), ball = b.sphere(0.5f), box = b.box({0.5f, 0.5f, 0.5f, 0});
  b.add(plane, {0, 0, 0, 0}, 0);
  for (uint i = 0; i + 1 < bodies; ++i) {
    const uint x = i % 4, z = i / 4 % 4, y = i / 16;
    b.add((x + y + z) % 2 ? ball : box, {0.98f * float(x), 0.49f + 0.98f * float(y), 0.98f * float(z), 0});
    b.forces(i + 1).force = {0, -10, 0, 0};
  }
  return b.finish();
}

// Balls that are all in one place `steps` steps from now, and aside a tower whose contacts have a past.
WorldInput implosion(uint bodies, float steps) {
  WorldBuilder b;
  const int ball = b.sphere(0.5f);
  for (uint i = 0; i < bodies; ++i) {
    const float turn = 6.2831853f * float(i) / float(bodies), far = 0.5f * float(bodies);
    const float4 place = {far * std::cos(turn), 0, far * std::sin(turn), 0};
    b.add(ball, place);
    b.velocity(i).linear = place * (-60.0f / steps);
  }
  b.add(b.plane({0, 1, 0, 0}, -60), {0, 0, 0, 0}, 0);
  const int box = b.box({0.5f, 0.5f, 0.5f, 0});
  for (uint i = 0; i < 3; ++i) {
    const uint body = b.add(box, {0, -59.51f + 0.99f * float(i), 0, 0});
    b.forces(body).force = {0, -10, 0, 0};
  }
  return b.finish();
}

class SubstepsAhead : public DeviceTest {};

void runBatches(const WorldInput& world, int batches) {
  Side ahead(world), single(world);
  for (int i = 0; i < batches; ++i) {
    const int substeps = i % 4 + 1;
    for (int k = 0; k < substeps; ++k) {
      ahead.step(substeps - 1 - k);
      single.step(0);
      const std::string what = std::to_string(i) + "." + std::to_string(k);
      expectSame(ahead, single, what);
      EXPECT_EQ(ahead.results.prefetched, k > 0) << what;
      EXPECT_EQ(ahead.results.contactKeys.empty(), k + 1 < substeps) << what;
    }
    // The keys too; which contacts are sent depends on what was sent before.
    for (auto* r : {&ahead.results, &single.results}) {
      for (ulong& key : r->contactKeys) key &= ~CONTACT_CARRIED;
    }
    EXPECT_EQ(ahead.results.contactKeys, single.results.contactKeys);
  }
}

// For the interpreter, which takes ten seconds a step: it sees accesses beyond the ring's arrays.
TEST_F(SubstepsAhead, AdoptedSmall) {
  Side ahead(heap(5));
  ahead.iterations = 1;
  const auto step = [&](int substepsToFollow) {
    ahead.step(substepsToFollow);
    countLaunches(ahead.results.launches);
  };
  step(0);  // new bodies: nothing runs ahead of them
  step(1);
  EXPECT_FALSE(ahead.results.prefetched);
  step(0);
  EXPECT_TRUE(ahead.results.prefetched);
  EXPECT_EQ(ahead.results.counters.overflow, 0u);
  EXPECT_GT(ahead.results.counters.contactPoints, 0u);
}
TEST_F(SubstepsAhead, Adopted) { runBatches(heap(300), 12); }

// Where the room runs out, in the first substep of a batch, in an adopted one, in the last one.
void overflowIn(uint bodies, float when, int substeps) {
  Side ahead(implosion(bodies, when)), single(implosion(bodies, when));
  int redone = 0, taken = 0;
  ahead.step(0);
  single.step(0);
  ASSERT_GT(single.results.counters.contactPoints, 0u);
  for (int k = 0; k < substeps; ++k) {
    ahead.step(substeps - 1 - k);
    single.step(0);
    const std::string what = std::to_string(when) + ", substep " + std::to_string(k);
    expectSame(ahead, single, what);
    EXPECT_EQ(ahead.results.redos > 0, single.results.redos > 0) << what;
    if (k > 0 && !ahead.results.prefetched) ++taken;
    if (ahead.results.redos > 0) ++redone;
  }
  EXPECT_GE(redone, 1) << when;
  // What was taken back was not prefetched the next time; behind the last substep there is nothing to be taken back.
  if (when < float(substeps)) { EXPECT_GE(taken, 1) << when; }
}

TEST_F(SubstepsAhead, TakenBackAfterAnOverflow) {
  for (const float when : {1.5f, 2.5f, 3.5f, 4.5f}) overflowIn(80, when, 4);
}

TEST_F(SubstepsAhead, TakenBackAfterAQuarantine) {
  for (const float velocity : {1.0e38f, 1.5e38f, 3.0e38f}) {
    WorldInput world = heap(8);
    Side ahead(world), single(world);
    ahead.step(0);
    single.step(0);
    for (Side* side : {&ahead, &single}) {
      side->input.forces.values[3].torque = {0, velocity * 4, 0, 0};
      side->input.forces.changed = {3};
    }
    bool quarantined = false;
    for (int k = 0; k < 6; ++k) {
      ahead.step(5 - k);
      single.step(0);
      expectSame(ahead, single, std::to_string(k));
      quarantined = quarantined || !ahead.results.quarantined.empty();
    }
    EXPECT_TRUE(quarantined) << velocity;
  }
}

TEST_F(SubstepsAhead, ThrownAway) {
  const WorldInput world = heap(20);
  const auto change = [](WorldInput& w, int which) {
    switch (which) {
      case 0:
        w.velocities.values[5].linear = {1, 2, 3, 0};
        w.velocities.changed = {5};
        break;
      case 1:
        w.poses.values[7].position = {9, 9, 9, 0};
        w.poses.changed = {7};
        break;
      case 2:
        w.forces.values[2].force = {5, 0, 0, 0};
        w.forces.changed = {2};
        break;
      case 3:
        w.listedPairs = {pairKeyOf(1, 2)};
        break;
      case 4:
        w.infos.values[4].flags = 0;
        w.infos.changed = {4};
        break;
      case 5:
        w.born = {3};
        break;
      case 6:
        w.activations.values[3].state = 4;  // DISABLE_DEACTIVATION
        w.activations.changed = {3};
        break;
      default:
        break;
    }
  };
  for (int which = 0; which < 7; ++which) {
    Side ahead(world), single(world);
    for (Side* side : {&ahead, &single}) {
      side->step(0);
      side->step(side == &ahead ? 3 : 0);
      change(side->input, which);
      side->step(side == &ahead ? 2 : 0);
    }
    EXPECT_FALSE(ahead.results.prefetched) << which;
    expectSame(ahead, single, "change " + std::to_string(which));
    for (const int follow : {1, 0}) {
      ahead.step(follow);
      single.step(0);
      expectSame(ahead, single, "after change " + std::to_string(which));
      EXPECT_EQ(ahead.results.prefetched, follow == 0 || which != 5) << "nothing runs ahead of a new body's first step";
    }
  }
}

// The batch ends sooner than it was said to, or starts anew.
TEST_F(SubstepsAhead, OtherSettingsThanExpected) {
  const WorldInput world = heap(20);
  Side ahead(world), single(world);
  const int follow[] = {0, 5, 0, 3, 3, 2, 0, 1, 1, 0};
  const bool adopted[] = {false, false, false, false, false, true, false, false, false, true};
  for (size_t i = 0; i < std::size(follow); ++i) {
    ahead.step(follow[i]);
    single.step(0);
    expectSame(ahead, single, std::to_string(i));
    EXPECT_EQ(ahead.results.prefetched, adopted[i]) << i;
  }
}

TEST_F(SubstepsAhead, Reset) {
  const WorldInput world = heap(20);
  Side ahead(world), single(world);
  ahead.step(0);
  ahead.step(4);
  ahead.engine.reset();
  std::vector<Manifold> none;
  ahead.engine.readManifolds(none);
  EXPECT_TRUE(none.empty());
  ahead.input = world;
  for (int k = 0; k < 3; ++k) {
    ahead.step(2 - k);
    single.step(0);
    expectSame(ahead, single, std::to_string(k));
  }
}

}  // namespace
}  // namespace btgpu
