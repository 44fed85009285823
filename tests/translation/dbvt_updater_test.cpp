// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btDbvtBroadphase updated for many bodies at once, against the same updates by setAabb.
#include "translation/dbvt_updater.h"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <utility>

#include "tests/translation/reader_world.h"

namespace btgpu::test {
namespace {

using Pairs = std::set<std::pair<int, int>>;

Pairs pairsOf(const btDbvtBroadphase& broadphase) {
  Pairs pairs;
  const btBroadphasePairArray& array = broadphase.m_paircache->getOverlappingPairArray();
  for (int i = 0; i < array.size(); ++i) {
    pairs.emplace(array[i].m_pProxy0->m_uniqueId, array[i].m_pProxy1->m_uniqueId);
  }
  EXPECT_EQ(pairs.size(), static_cast<size_t>(array.size())) << "a pair is twice in the cache";
  return pairs;
}

void expectSound(const btDbvtNode* node, const btDbvtNode* parent, int& leaves) {
  if (!node) return;
  ASSERT_EQ(node->parent, parent);
  if (node->isleaf()) {
    ++leaves;
    return;
  }
  for (const btDbvtNode* child : node->childs) {
    ASSERT_TRUE(node->volume.Contain(child->volume));
    expectSound(child, node, leaves);
  }
}

// Boxes in a cube, of which a share moves about: by a little, by more than the margin, or far.
struct Crowd {
  btDbvtBroadphase broadphase;
  std::vector<btBroadphaseProxy*> proxies;

  explicit Crowd(int count, int groups = 1) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(0, 1);
    const double edge = 2 * std::cbrt(count);
    for (int i = 0; i < count; ++i) {
      const double x = uniform(random), y = uniform(random), z = uniform(random);
      const btVector3 at(s(x * edge), s(y * edge), s(z * edge)), half(s(0.8), s(0.8), s(0.8));
      proxies.push_back(broadphase.createProxy(at - half, at + half, BOX_SHAPE_PROXYTYPE, this, 1 << (i % groups),
                                               groups > 1 ? ~(1 << (i % groups)) : -1, nullptr));
    }
    broadphase.calculateOverlappingPairs(nullptr);
  }
  ~Crowd() {
    for (btBroadphaseProxy* proxy : proxies) broadphase.destroyProxy(proxy, nullptr);
  }

  void expectSound() {
    for (const btDbvt& tree : broadphase.m_sets) {
      int leaves = 0;
      test::expectSound(tree.m_root, nullptr, leaves);
      ASSERT_EQ(leaves, tree.m_leaves);
    }
    int listed[3] = {};
    for (int stage = 0; stage < 3; ++stage) {
      const btDbvtProxy* before = nullptr;
      for (btDbvtProxy* p = broadphase.m_stageRoots[stage]; p; before = p, p = p->links[1], ++listed[stage]) {
        ASSERT_EQ(p->stage, stage);
        ASSERT_EQ(p->links[0], before);
      }
    }
    ASSERT_EQ(listed[0] + listed[1], broadphase.m_sets[0].m_leaves);
    ASSERT_EQ(listed[2], broadphase.m_sets[1].m_leaves);
    for (btBroadphaseProxy* proxy : proxies) {
      const auto& p = *static_cast<btDbvtProxy*>(proxy);
      ASSERT_EQ(p.leaf->data, proxy);
      ASSERT_TRUE(p.leaf->volume.Contain(btDbvtAabbMm::FromMM(p.m_aabbMin, p.m_aabbMax)));
    }
  }
  // Of the leaves, by brute force, if the filters allow them.
  Pairs overlaps() const {
    Pairs pairs;
    for (size_t i = 0; i < proxies.size(); ++i) {
      for (size_t k = i + 1; k < proxies.size(); ++k) {
        const auto &a = *static_cast<btDbvtProxy*>(proxies[i]), &b = *static_cast<btDbvtProxy*>(proxies[k]);
        const bool allowed = (a.m_collisionFilterGroup & b.m_collisionFilterMask) &&
                             (b.m_collisionFilterGroup & a.m_collisionFilterMask);
        if (allowed && Intersect(a.leaf->volume, b.leaf->volume)) pairs.emplace(a.m_uniqueId, b.m_uniqueId);
      }
    }
    return pairs;
  }
};

// How far the proxy moves in a round: most by less than the margin, some by more, few far away, the rest not at all.
struct Motion {
  double small = 0.3, large = 0.3, far = 0.01;
};

std::vector<DbvtUpdater::Bounds> movesOf(const Crowd& crowd, const Motion& motion, unsigned round) {
  std::mt19937 random(round);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<DbvtUpdater::Bounds> moves;
  for (btBroadphaseProxy* proxy : crowd.proxies) {
    const double choice = uniform(random), x = uniform(random) - 0.5, y = uniform(random) - 0.5;
    const double reach = choice < motion.small                               ? 0.05
                         : choice < motion.small + motion.large              ? 0.5
                         : choice < motion.small + motion.large + motion.far ? 20
                                                                             : 0;
    const btVector3 by(s(reach * x), s(reach * y), s(reach * x * y));
    moves.push_back({proxy->m_aabbMin + by, proxy->m_aabbMax + by, reach > 0 ? proxy : nullptr});
  }
  return moves;
}

bool covers(const Pairs& outer, const Pairs& inner) {
  return std::includes(outer.begin(), outer.end(), inner.begin(), inner.end());
}

void expectAsStock(const Motion& motion, int count, int groups = 1, unsigned rounds = 12) {
  Crowd ours(count, groups), stock(count, groups);
  DbvtUpdater updater;
  for (unsigned round = 0; round < rounds; ++round) {
    const auto moves = movesOf(ours, motion, round);
    updater.update(ours.broadphase, moves, nullptr);
    for (size_t i = 0; i < moves.size(); ++i) {
      if (!moves[i].proxy) continue;
      stock.broadphase.setAabb(stock.proxies[i], moves[i].lower, moves[i].upper, nullptr);
    }
    ASSERT_NO_FATAL_FAILURE(ours.expectSound()) << round;
    const Pairs wanted = ours.overlaps(), known = pairsOf(ours.broadphase);
    EXPECT_TRUE(covers(known, wanted)) << round << ": " << wanted.size() << " overlap, " << known.size() << " known";
    ours.broadphase.calculateOverlappingPairs(nullptr);
    stock.broadphase.calculateOverlappingPairs(nullptr);
    ASSERT_NO_FATAL_FAILURE(ours.expectSound()) << round;
    for (size_t i = 0; i < moves.size(); ++i) {
      const auto &a = *static_cast<btDbvtProxy*>(ours.proxies[i]), &b = *static_cast<btDbvtProxy*>(stock.proxies[i]);
      ASSERT_EQ(a.m_aabbMin, b.m_aabbMin) << i;
      ASSERT_EQ(a.m_aabbMax, b.m_aabbMax) << i;
      ASSERT_FALSE(NotEqual(a.leaf->volume, b.leaf->volume)) << round << ": " << i;
      ASSERT_EQ(a.stage, b.stage) << round << ": " << i;
    }
    // Leaves that stand still have lost their margin. Stock also keeps pairs that came and went within the round, until
    // its clean-up comes to them.
    const Pairs left = ours.overlaps();
    EXPECT_TRUE(covers(pairsOf(ours.broadphase), left)) << round;
    EXPECT_TRUE(covers(pairsOf(stock.broadphase), left)) << round;
  }
  if (rounds == 12) { EXPECT_GE(pairsOf(ours.broadphase).size(), static_cast<size_t>(count / 2)); }
}

TEST(DbvtUpdater, ManyMove) { expectAsStock({}, 1500); }
TEST(DbvtUpdater, FewMove) { expectAsStock({0.02, 0.005, 0.005}, 1500); }
TEST(DbvtUpdater, AllMove) { expectAsStock({0, 1, 0}, 1500); }
TEST(DbvtUpdater, AllFallFar) { expectAsStock({0, 0, 1}, 300); }
TEST(DbvtUpdater, FiltersHold) { expectAsStock({}, 900, 3); }
// Long enough for the tree to be built anew.
TEST(DbvtUpdater, AllMoveForLong) {
  for (const int count : {2, 3, 5, 400}) expectAsStock({0, 1, 0}, count, 1, 70);
}
TEST(DbvtUpdater, One) { expectAsStock({0, 1, 0}, 1); }

// Nodes that a query of each leaf looks at.
double visits(const Crowd& crowd) {
  long all = 0;
  const btDbvt& tree = crowd.broadphase.m_sets[0];
  for (btBroadphaseProxy* proxy : crowd.proxies) {
    const btDbvtAabbMm box = static_cast<btDbvtProxy*>(proxy)->leaf->volume;
    std::vector<const btDbvtNode*> left = {tree.m_root};
    while (!left.empty()) {
      const btDbvtNode* node = left.back();
      left.pop_back();
      ++all;
      if (!Intersect(node->volume, box) || node->isleaf()) continue;
      left.insert(left.end(), {node->childs[0], node->childs[1]});
    }
  }
  return static_cast<double>(all);
}

// All of them have moved for long: the tree answers as if it had been built for where they are now.
TEST(DbvtUpdater, TheTreeFollows) {
  Crowd ours(3000), stock(3000);
  DbvtUpdater updater;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  std::vector<btVector3> ways;
  for (size_t i = 0; i < ours.proxies.size(); ++i) {
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    ways.emplace_back(s(x), s(y), s(z));
  }
  for (int round = 0; round < 100; ++round) {
    std::vector<DbvtUpdater::Bounds> moves;
    for (size_t i = 0; i < ours.proxies.size(); ++i) {
      btBroadphaseProxy* p = ours.proxies[i];
      moves.push_back({p->m_aabbMin + ways[i], p->m_aabbMax + ways[i], p});
      stock.broadphase.setAabb(stock.proxies[i], moves[i].lower, moves[i].upper, nullptr);
    }
    updater.update(ours.broadphase, moves, nullptr);
    ours.broadphase.calculateOverlappingPairs(nullptr);
    stock.broadphase.calculateOverlappingPairs(nullptr);
  }
  // Bullet puts each leaf in place in every round, we all of them in one of 32: here up to 8 units of way.
  EXPECT_LT(visits(ours), 3 * visits(stock));
}

int depthOf(const btDbvtNode* node) {
  return node->isleaf() ? 1 : 1 + std::max(depthOf(node->childs[0]), depthOf(node->childs[1]));
}

// What is larger than the rest, or can't be compared, does not spoil the tree for the others.
TEST(DbvtBuilder, LargeAndBrokenLeaves) {
  Crowd plain(2000), mixed(2000);
  DbvtBuilder builder;
  builder.build(plain.broadphase.m_sets[0]);
  const double wanted = visits(plain);
  constexpr int kLarge = 4;
  for (int i = 0; i < kLarge; ++i) {
    btDbvtNode* leaf = static_cast<btDbvtProxy*>(mixed.proxies[static_cast<size_t>(i) * 17])->leaf;
    const btScalar reach = s(20 << i);
    leaf->volume = btDbvtAabbMm::FromCR(btVector3(0, 0, 0), reach);
  }
  builder.build(mixed.broadphase.m_sets[0]);
  // Each looks at the large ones, and those at all.
  EXPECT_LT(visits(mixed), wanted + 2 * kLarge * (4000 + 2000));
  EXPECT_LE(depthOf(mixed.broadphase.m_sets[0].m_root), 2 * 11 + 2);
  const btScalar nan = std::numeric_limits<btScalar>::quiet_NaN();
  for (size_t i = 1; i < mixed.proxies.size(); i += 3) {
    static_cast<btDbvtProxy*>(mixed.proxies[i])->leaf->volume =
        btDbvtAabbMm::FromMM(btVector3(nan, nan, nan), btVector3(nan, 1, SIMD_INFINITY));
  }
  builder.build(mixed.broadphase.m_sets[0]);
  EXPECT_LE(depthOf(mixed.broadphase.m_sets[0].m_root), 2 * 11 + 2);
}

class Listener : public btGhostPairCallback {};

TEST(DbvtUpdater, OnlyWhereNobodyNeedsStocksOrder) {
  ReaderWorld w;
  EXPECT_EQ(DbvtUpdater::updatable(w.world), w.world.getBroadphase());
  btGhostPairCallback ghosts;
  w.world.getPairCache()->setInternalGhostPairCallback(&ghosts);
  EXPECT_NE(DbvtUpdater::updatable(w.world), nullptr);
  Listener listener;
  w.world.getPairCache()->setInternalGhostPairCallback(&listener);
  EXPECT_EQ(DbvtUpdater::updatable(w.world), nullptr);
  w.world.getPairCache()->setInternalGhostPairCallback(nullptr);
  static_cast<btDbvtBroadphase*>(w.world.getBroadphase())->m_deferedcollide = true;
  EXPECT_EQ(DbvtUpdater::updatable(w.world), nullptr);
}

}  // namespace
}  // namespace btgpu::test
