// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The narrowphase's stages on the host: each says nothing of what the device or the host itself leaves, and finds what
// was changed after that.
#include <fmt/format.h>

#include <functional>

#include "gpu_engine/host_stage.h"
#include "gpu_engine/stages/10_apply_forces.h"
#include "gpu_engine/stages/20_update_aabbs.h"
#include "gpu_engine/stages/30_find_pairs.h"
#include "gpu_engine/stages/35_group_pairs.h"
#include "gpu_engine/stages/42_collide_primitives.h"
#include "gpu_engine/stages/44_find_closest_features.h"
#include "gpu_engine/stages/44_find_separating_axis.h"
#include "gpu_engine/stages/46_clip_convex_faces.h"
#include "gpu_engine/stages/46_clip_faces.h"
#include "gpu_engine/stages/48_reduce_and_match_contacts.h"
#include "gpu_engine/stages/55_build_islands.h"
#include "gpu_engine/stages/60_colour_constraints.h"
#include "gpu_engine/stages/65_prepare_contacts.h"
#include "gpu_engine/stages/70_solve_velocities.h"
#include "gpu_engine/stages/80_integrate_poses.h"
#include "gpu_engine/stages/90_update_activation.h"
#include "tests/support/convex_pairs.h"
#include "tests/support/device_test.h"

namespace btgpu {
namespace {

const std::vector<float4> kCorners = {{-.4f, -.4f, -.4f, 0}, {.4f, -.4f, -.4f, 0}, {-.4f, .4f, -.4f, 0},
                                      {.4f, .4f, -.4f, 0},   {-.4f, -.4f, .4f, 0}, {.4f, -.4f, .4f, 0},
                                      {-.4f, .4f, .4f, 0},   {.4f, .4f, .4f, 0}};

// What stands and lies exactly: stacks of like boxes, of like hulls and of drums, walls, capsules side by side. Ties
// wherever there may be one.
void addAligned(WorldBuilder& b, int height) {
  const int cube = b.box({0.5f, 0.5f, 0.5f, 0}), crate = b.hull(kCorners), drum = b.hull(prismPoints(16, 0.5f, 0.4f));
  const int lying = b.capsule(0, 0.3f, 0.6f), ball = b.sphere(0.4f);
  const float4 eighth = turnAbout({0, 1, 0, 0}, 0.78539816f), onEdge = turnAbout({0, 0, 1, 0}, 0.78539816f);
  for (int k = 0; k < height; ++k) {
    const float y = static_cast<float>(k);
    b.add(cube, {0, 0.49f + 0.98f * y, 0, 0});
    b.add(cube, {2, 0.49f + 0.98f * y, 0, 0}, 1, k % 2 ? eighth : kNoTurn);
    b.add(cube, {4 + 0.99f * static_cast<float>(k % 2), 0.49f + 0.49f * y, 2, 0});
    b.add(crate, {6, 0.43f + 0.87f * y, 0, 0});
    b.add(crate, {8, 0.43f + 0.87f * y, 0, 0}, 1, k % 2 ? eighth : kNoTurn);
    b.add(drum, {10, 0.43f + 0.87f * y, 0, 0});
    b.add(lying, {12, 0.29f + 0.58f * y, 0, 0});
    b.add(k % 2 ? lying : cube, {14, 0.49f + 0.78f * y, 0, 0});
    b.add(k % 2 ? ball : crate, {16, 0.43f + 0.82f * y, 0, 0});
    b.add(k % 2 ? ball : cube, {18, 0.49f + 0.88f * y, 0, 0});
    b.add(ball, {20, 0.39f + 0.78f * y, 0, 0});
  }
  b.add(cube, {22, 0.69f, 0, 0}, 1, onEdge);
  b.add(crate, {24, 0.59f, 0, 0}, 1, onEdge);
  b.add(cube, {24, 1.6f, 0, 0});
}

void addHeap(WorldBuilder& b, std::mt19937& random, int count) {
  for (int k = 0; k < count; ++k) {
    const float4 half = uniform3(random, 0.3f, 0.7f);
    int shape = 0;
    switch (random() % 6) {
      case 0:
        shape = b.sphere(half.x);
        break;
      case 1:
        shape = b.capsule(static_cast<int>(random() % 3), half.x / 2, half.y);
        break;
      case 2:
        shape = b.hull(prismPoints(3 + static_cast<int>(random() % 8), half.x, half.y));
        break;
      case 3:
        shape = b.hull(pointsOnEllipsoid(random, 5 + random() % 12, half));
        break;
      default:
        shape = b.box(half);
    }
    const float side = 0.75f * std::cbrt(static_cast<float>(count));
    float4 position = uniform3(random, -side, side);
    position.y = uniform(random, 0.2f, 0.8f * side);
    position.z -= 8;
    b.add(shape, position, 1, randomTurn(random));
  }
}

WorldInput scene(std::mt19937& random, int height, int heap) {
  WorldBuilder b;
  b.add(b.plane({0, 1, 0, 0}, 0), {}, 0);
  b.add(b.box({4, 0.5f, 4, 0}), {0, -0.3f, -8, 0}, 0);
  addAligned(b, height);
  addHeap(b, random, heap);
  return b.finish();
}

// A stage on the device and on the host.
struct NarrowStage {
  std::function<void(StageBench&)> enqueue;
  std::function<std::unique_ptr<HostStage>()> make;
};

const NarrowStage kStages[] = {
    {[](StageBench& b) { b.run<CollidePrimitives>(~0u); }, hostCollidePrimitives},
    {[](StageBench& b) { b.run<FindSeparatingAxis>(); }, hostFindSeparatingAxis},
    {[](StageBench& b) { b.run<ClipFaces>(); }, hostClipFaces},
    {[](StageBench& b) { b.run<FindClosestFeatures>(); }, hostFindClosestFeatures},
    {[](StageBench& b) { b.run<ClipConvexFaces>(); }, hostClipConvexFaces},
    {[](StageBench& b) { b.run<ReduceAndMatchContacts>(); }, hostReduceAndMatchContacts},
};
enum { kPrimitives, kAxis, kFaces, kClosest, kConvexFaces, kMatch };

class HostNarrowTest : public DeviceTest {
 protected:
  void begin(const WorldInput& in) {
    m_bench = std::make_unique<StageBench>(queue(), in, m_settings);
    m_io = std::make_unique<DeviceStageIo>(queue(), m_bench->world(), m_settings);
    findPairs();
  }
  void findPairs() {
    m_bench->run<ApplyForces>();
    m_bench->run<UpdateAabbs>();
    m_bench->run<FindPairs>();
    m_bench->run<GroupPairs>();
    m_pairs = m_io->read(m_bench->world().pairs, m_io->pairCount());
    ASSERT_EQ(m_bench->counters().overflow, 0u);
  }
  // What 48 left becomes the last step's, with impulses; bodies move.
  void nextStep(std::mt19937& random, float motion) {
    DeviceWorld& w = m_bench->world();
    auto manifolds = m_io->read(w.manifolds, m_pairs.size());
    float impulse = 0;
    for (Manifold& m : manifolds) {
      for (int k = 0; k < m.pointCount; ++k) {
        m.points[k].localPointB.w = impulse += 1;
        m.points[k].normalWorldOnB.w = 0.25f * impulse;
        m.points[k].lateralFrictionDir1.w = -0.125f * impulse;
      }
    }
    m_bench->write(w.manifolds, manifolds);
    w.swapStepResults();
    auto poses = m_io->readBodies(w.poses);
    for (BodyPose& pose : poses) {
      if (pose.position.x == 0 && pose.position.y == 0) continue;  // the plane
      const float4 axis = uniform3(random, -1, 1);
      pose.position += uniform3(random, -motion, motion);
      if (motion > 0) pose.orientation = turnProduct(turnAbout(axis, motion), pose.orientation);
    }
    m_bench->write(w.poses, poses);
    m_bench->write(w.born, std::vector<uint>(w.bodyCount, 0));
    m_bench->setCounters({});
    findPairs();
  }

  // The rest of the step, and the pairs of the next one.
  void solve() {
    m_bench->run<BuildIslands>();
    m_bench->run<ColourConstraints>();
    m_bench->run<PrepareContacts>();
    m_bench->run<SolveVelocities>(m_settings, false);
    m_bench->run<IntegratePoses>();
    m_bench->run<UpdateActivation>();
    m_bench->world().swapStepResults();
    m_bench->write(m_bench->world().born, std::vector<uint>(m_bench->world().bodyCount, 0));
    m_bench->setCounters({});
    findPairs();
  }

  // The stage on the device; then, if wanted, on the host in its place.
  std::unique_ptr<HostStage> run(const NarrowStage& stage, bool store) {
    auto host = stage.make();
    host->compute(*m_io);
    stage.enqueue(*m_bench);
    expectRight(*host, "the device");
    if (!store) return host;
    host->store(*m_io);
    expectRight(*host, "the host");
    return host;
  }
  void expectRight(HostStage& host, const char* whose) {
    Contract contract(host.name());
    host.check(*m_io, contract);
    EXPECT_TRUE(contract.ok()) << whose << ": " << contract.text();
  }

  // Does `harm` to one element after the other, those for which it returns true, and puts the array back.
  template <typename T>
  void expectFound(HostStage& host, DeviceArray<T>& array, const char* what, size_t count,
                   const std::function<bool(size_t, T&)>& harm) {
    const bool isList = std::is_same_v<T, uint>;  // its elements are positions, of which another may be missed
    constexpr int kEnough = 10;
    const std::vector<T> good = m_io->read(array, count);
    int done = 0;
    for (size_t n = 0; n < count && done < kEnough; ++n) {
      std::vector<T> bad = good;
      if (!harm(n, bad[n])) continue;
      ++done;
      m_io->write(array, bad);
      Contract contract(host.name());
      host.check(*m_io, contract);
      EXPECT_FALSE(contract.ok()) << what << ", element " << n;
      if (contract.ok()) continue;
      EXPECT_EQ(contract.first()->stage, host.name());
      EXPECT_TRUE(isList || contract.text().find(fmt::format(" {}", n)) != std::string::npos) << contract.text();
    }
    m_io->write(array, good);
    EXPECT_GT(done, 3) << what;
  }

  std::vector<uint> pairsOf(uint firstBucket, uint lastBucket) {
    const auto bucketFirst = m_io->read(m_bench->world().bucketFirst, BUCKET_COUNT + 1);
    const auto items = m_io->read(m_bench->world().items, m_pairs.size());
    return {items.begin() + bucketFirst[firstBucket], items.begin() + bucketFirst[lastBucket + 1]};
  }
  std::function<bool(size_t)> isIn(uint firstBucket, uint lastBucket) {
    const std::vector<Pair> pairs = m_pairs;
    return [=](size_t i) { return pairs[i].bucket >= firstBucket && pairs[i].bucket <= lastBucket; };
  }

  // What any stage that finds candidates must notice.
  void expectHarmFound(HostStage& host, const std::function<bool(size_t)>& mine) {
    DeviceArray<RawContacts>& contacts = m_bench->world().contacts;
    const size_t n = m_pairs.size();
    expectFound<RawContacts>(host, contacts, "normal turned round", n, [&](size_t i, RawContacts& raw) {
      raw.normal = raw.normal * -1.0f;
      return mine(i) && raw.count > 0;
    });
    expectFound<RawContacts>(host, contacts, "1 % deeper", n, [&](size_t i, RawContacts& raw) {
      const bool deep = mine(i) && raw.count > 0 && raw.points[raw.count - 1].w < -0.01f;
      if (deep) raw.points[raw.count - 1].w *= 1.01f;
      return deep;
    });
    expectFound<RawContacts>(host, contacts, "point moved", n, [&](size_t i, RawContacts& raw) {
      raw.points[0] += float4{1e-3f, 1e-3f, 1e-3f, 0};
      return mine(i) && raw.count > 0;
    });
    expectFound<RawContacts>(host, contacts, "dropped", n, [&](size_t i, RawContacts& raw) {
      const bool deep = mine(i) && raw.count > 0 && raw.points[raw.count - 1].w < -0.001f;
      raw.count = 0;
      return deep;
    });
    expectFound<RawContacts>(host, contacts, "another's", n, [&](size_t i, RawContacts& raw) {
      raw.axis ^= 1;
      return !mine(i);
    });
  }

  StepSettings m_settings;
  std::unique_ptr<StageBench> m_bench;
  std::unique_ptr<DeviceStageIo> m_io;
  std::vector<Pair> m_pairs;
};

// Steps without motion, with a little, and with much; the next stages work on what the device found, or the host.
TEST_F(HostNarrowTest, NothingIsFoundWhereNothingIsWrong) {
  for (const bool store : {false, true}) {
    SCOPED_TRACE(store);
    std::mt19937 random(1);
    begin(scene(random, 6, 120));
    EXPECT_GT(m_pairs.size(), 250u);
    for (const float motion : {0.0f, 1e-6f, 1e-3f, 1e-2f}) {
      SCOPED_TRACE(motion);
      for (const NarrowStage& stage : kStages) run(stage, store);
      nextStep(random, motion);
    }
  }
}

// A scene that falls and comes to rest.
TEST_F(HostNarrowTest, NothingIsFoundWhileThingsFall) {
  std::mt19937 random(4);
  WorldInput in = scene(random, 4, 60);
  for (size_t i = 0; i < in.bodyCount; ++i) {
    const float inverseMass = in.masses.values[i].inverseInertiaLocal.w;
    if (inverseMass > 0) in.forces.values[i].force = {0, -10 / inverseMass, 0, 0};
  }
  begin(in);
  for (int step = 0; step < 40; ++step) {
    SCOPED_TRACE(step);
    for (const NarrowStage& stage : kStages) {
      if (step % 4) {
        stage.enqueue(*m_bench);
      } else {
        run(stage, false);
      }
    }
    solve();
  }
}

// Few pairs, and none for most stages.
TEST_F(HostNarrowTest, FewPairsSmall) {
  std::mt19937 random(5);
  WorldBuilder b;
  const int cube = b.box({0.5f, 0.5f, 0.5f, 0}), crate = b.hull(kCorners);
  b.add(b.plane({0, 1, 0, 0}, 0), {}, 0);
  b.add(cube, {0, 0.49f, 0, 0});
  b.add(cube, {0.1f, 1.48f, 0, 0});
  b.add(crate, {5, 0.43f, 0, 0});
  b.add(crate, {5, 1.3f, 0, 0});
  begin(b.finish());
  for (const float motion : {0.0f, 1e-3f}) {
    for (const NarrowStage& stage : kStages) run(stage, true);
    nextStep(random, motion);
  }
  WorldBuilder apart;
  apart.add(apart.hull(kCorners), {});
  apart.add(apart.box({1, 1, 1, 0}), {9, 0, 0, 0});
  begin(apart.finish());
  EXPECT_TRUE(m_pairs.empty());
  for (const NarrowStage& stage : kStages) run(stage, true);
}

TEST_F(HostNarrowTest, HarmIsFound) {
  std::mt19937 random(2);
  begin(scene(random, 4, 60));
  DeviceWorld& w = m_bench->world();
  const auto isPrimitive = [this](size_t i) {
    const uint bucket = m_pairs[i].bucket;
    return bucket > BUCKET_CARRY && bucket <= BUCKET_HULL_PLANE && bucket != BUCKET_BOX_BOX;
  };
  auto host = run(kStages[kPrimitives], false);
  expectHarmFound(*host, isPrimitive);

  host = run(kStages[kAxis], false);
  const auto boxes = pairsOf(BUCKET_BOX_BOX, BUCKET_BOX_BOX);
  expectFound<SeparatingAxis>(*host, w.axes, "normal turned round", boxes.size(), [](size_t, SeparatingAxis& s) {
    s.normal = {-s.normal.x, -s.normal.y, -s.normal.z, s.normal.w};
    return s.code >= 0;
  });
  expectFound<SeparatingAxis>(*host, w.axes, "1 % deeper", boxes.size(), [](size_t, SeparatingAxis& s) {
    s.normal.w *= 1.01f;
    return s.code >= 0 && s.code < 6 && s.normal.w > 0.01f;
  });
  expectFound<SeparatingAxis>(*host, w.axes, "separated", boxes.size(), [](size_t, SeparatingAxis& s) {
    const bool was = s.code >= 0 && s.normal.w > 0.01f;
    s.code = -1;
    return was;
  });
  expectFound<SeparatingAxis>(*host, w.axes, "another axis", boxes.size(), [](size_t, SeparatingAxis& s) {
    const bool was = s.code >= 0;
    s.code = (s.code + 1) % 6;
    return was;
  });

  host = run(kStages[kFaces], false);
  expectHarmFound(*host, isIn(BUCKET_BOX_BOX, BUCKET_BOX_BOX));
  expectFound<RawContacts>(*host, w.contacts, "point lost", m_pairs.size(), [&](size_t i, RawContacts& raw) {
    --raw.count;
    return m_pairs[i].bucket == BUCKET_BOX_BOX && raw.count > 0 && raw.count < 5 && raw.points[raw.count].w < -0.001f;
  });

  host = run(kStages[kClosest], false);
  const auto near = m_io->read(w.nearPairs, m_io->read(w.nearCount, 1)[0]);
  const size_t convex = pairsOf(BUCKET_FIRST_CONVEX, BUCKET_LAST_CONVEX).size();
  const auto isNear = [&](size_t n) { return std::count(near.begin(), near.end(), n) > 0; };
  expectFound<ClosestFeatures>(*host, w.closest, "normal turned round", convex, [&](size_t n, ClosestFeatures& f) {
    f.normal = {-f.normal.x, -f.normal.y, -f.normal.z, f.normal.w};
    return isNear(n);
  });
  expectFound<ClosestFeatures>(*host, w.closest, "1 % farther", convex, [&](size_t n, ClosestFeatures& f) {
    f.normal.w *= 1.01f;
    return isNear(n) && std::fabs(f.normal.w) > 0.02f;
  });
  expectFound<ClosestFeatures>(*host, w.closest, "point moved", convex, [&](size_t n, ClosestFeatures& f) {
    f.onB += xyzOf(f.normal) * 0.01f;
    return isNear(n) && f.normal.w > 0;
  });
  expectFound<uint>(*host, w.nearPairs, "listed twice", near.size(), [](size_t n, uint& position) {
    --position;
    return n > 0;
  });

  host = run(kStages[kConvexFaces], false);
  expectHarmFound(*host, isIn(BUCKET_FIRST_CONVEX, BUCKET_LAST_CONVEX));
  expectFound<RawContacts>(*host, w.contacts, "deepest point lost", m_pairs.size(), [&](size_t i, RawContacts& raw) {
    --raw.count;
    if (m_pairs[i].bucket < BUCKET_FIRST_CONVEX || raw.count < 1 || raw.count > 3) return false;
    return raw.points[raw.count].w < raw.points[raw.count - 1].w - 1e-3f;
  });
}

TEST_F(HostNarrowTest, HarmToManifoldsIsFound) {
  std::mt19937 random(3);
  begin(scene(random, 4, 60));
  for (int step = 0; step < 2; ++step) {
    for (const NarrowStage& stage : kStages) run(stage, false);
    if (step == 0) nextStep(random, 1e-3f);
  }
  auto host = kStages[kMatch].make();
  host->compute(*m_io);
  DeviceArray<Manifold>& manifolds = m_bench->world().manifolds;
  const auto expect = [&](const char* what, const std::function<bool(Manifold&)>& harm) {
    expectFound<Manifold>(*host, manifolds, what, m_pairs.size(), [&](size_t, Manifold& m) { return harm(m); });
  };
  expect("impulses of matched points swapped", [](Manifold& m) {
    std::swap(m.points[0].localPointB.w, m.points[1].localPointB.w);
    return m.pointCount > 1 && m.points[0].lifeTime > 1 && m.points[1].lifeTime > 1;
  });
  expect("point lost", [](Manifold& m) {
    m.pointCount -= 1;
    return m.pointCount >= 0;
  });
  expect("1 % deeper", [](Manifold& m) {
    m.points[0].localPointA.w *= 1.01f;
    return m.pointCount > 0 && m.points[0].localPointA.w < -0.01f;
  });
  expect("point twice", [](Manifold& m) {
    m.points[1] = m.points[0];
    return m.pointCount > 1;
  });
  expect("life time", [](Manifold& m) {
    m.points[0].lifeTime += 1;
    return m.pointCount > 0;
  });
  expect("origin", [](Manifold& m) {
    m.points[0].flags ^= 1 << POINT_ORIGIN_SHIFT;
    return m.pointCount > 0;
  });
  expect("normal", [](Manifold& m) {
    m.points[0].normalWorldOnB = m.points[0].normalWorldOnB * -1.0f;
    return m.pointCount > 0;
  });
  expect("friction", [](Manifold& m) {
    m.points[0].combined.x *= 1.01f;
    return m.pointCount > 0;
  });
  expect("threshold", [](Manifold& m) {
    m.breakingThreshold *= 1.01f;
    return true;
  });
}

}  // namespace
}  // namespace btgpu
