// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "dbvt_updater.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <algorithm>

#include "../gpu_engine/zone.h"
#include "exact_type.h"
#include "parallel.h"
#include "private_access.h"
#include "support_check.h"

BTGPU_TRANSLATION_BEGIN
namespace {

constexpr std::size_t kGrain = 512;                     // bodies
constexpr std::size_t kSubtrees = 256, kFitGrain = 16;  // that are fitted side by side
constexpr std::size_t kFewMoved = 32;   // less than this share of the tree moved: each leaf is put in place by itself
constexpr std::size_t kPlaceCost = 16;  // putting a leaf in place costs as much as building a tree over as many
constexpr std::size_t kMostMoved = 4;   // at least this share moved: all leaves meet all others, in blocks

btDbvtProxy* dbvtProxy(btBroadphaseProxy* proxy) { return static_cast<btDbvtProxy*>(proxy); }

// Bullet's lists of proxies by stage.
void unlink(btDbvtProxy* proxy, btDbvtProxy*& list) {
  if (proxy->links[0]) {
    proxy->links[0]->links[1] = proxy->links[1];
  } else {
    list = proxy->links[1];
  }
  if (proxy->links[1]) proxy->links[1]->links[0] = proxy->links[0];
}
void link(btDbvtProxy* proxy, btDbvtProxy*& list) {
  proxy->links[0] = nullptr;
  proxy->links[1] = list;
  if (list) list->links[0] = proxy;
  list = proxy;
}

// What the leaf gets that has moved out of its old volume, as btDbvtBroadphase::setAabb and btDbvt::update have it.
btDbvtAabbMm withMargin(const btDbvtBroadphase& broadphase, const btDbvtProxy& proxy,
                        const DbvtUpdater::Bounds& bounds) {
  btDbvtAabbMm volume = btDbvtAabbMm::FromMM(bounds.lower, bounds.upper);
  const btVector3 moved = bounds.lower - proxy.m_aabbMin;
  btVector3 ahead = (proxy.m_aabbMax - proxy.m_aabbMin) / 2 * broadphase.m_prediction;
  for (int axis = 0; axis < 3; ++axis) {
    if (moved[axis] < 0) ahead[axis] = -ahead[axis];
  }
  volume.Expand(btVector3(gDbvtMargin, gDbvtMargin, gDbvtMargin));
  volume.SignedExpand(ahead);
  return volume;
}

// btHashedOverlappingPairCache::findPair from many threads at once; Bullet's own counts its calls.
class PairTable {
 public:
  explicit PairTable(btHashedOverlappingPairCache& cache)
      : m_cache(cache),
        m_pairs(cache.getOverlappingPairArray()),
        m_first(cache.*memberPointer(PairHashTable())),
        m_next(cache.*memberPointer(PairNext())) {}

  // Leaves those that are not in the cache, in their order; the lower id first, as the cache has it. What is looked at
  // lies anywhere in memory: all of it is asked for before. `places` is there to be used again.
  void keepMissing(std::vector<DbvtUpdater::ProxyPair>& pairs, std::vector<int>& places) const {
    places.clear();
    for (const auto& [low, high] : pairs) {
      const auto hash =
          static_cast<int>((m_cache.*memberPointer(PairHashFunction()))(static_cast<unsigned>(low->m_uniqueId),
                                                                        static_cast<unsigned>(high->m_uniqueId)) &
                           static_cast<unsigned>(m_pairs.capacity() - 1));
      places.push_back(hash < m_first.size() ? hash : BT_NULL_PAIR);
      if (places.back() != BT_NULL_PAIR) __builtin_prefetch(&m_first[hash]);
    }
    for (int& place : places) {
      if (place != BT_NULL_PAIR) place = m_first[place];
      if (place != BT_NULL_PAIR) __builtin_prefetch(&m_pairs[place]);
    }
    std::size_t count = 0;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      int i = places[k];
      while (i != BT_NULL_PAIR &&
             !(m_pairs[i].m_pProxy0 == pairs[k].first && m_pairs[i].m_pProxy1 == pairs[k].second)) {
        i = m_next[i];
      }
      if (i == BT_NULL_PAIR) pairs[count++] = pairs[k];
    }
    pairs.resize(count);
  }

 private:
  btHashedOverlappingPairCache& m_cache;
  const btBroadphasePairArray& m_pairs;
  const btAlignedObjectArray<int>&m_first, &m_next;
};

}  // namespace

btDbvtBroadphase* DbvtUpdater::updatable(btDiscreteDynamicsWorld& world) {
  btBroadphaseInterface& broadphase = *world.getBroadphase();
  if (!isExactly<btDbvtBroadphase>(broadphase) || hasPairCallback(world)) return nullptr;
  auto& dbvt = static_cast<btDbvtBroadphase&>(broadphase);
  return !dbvt.m_deferedcollide && isExactly<btHashedOverlappingPairCache>(*dbvt.m_paircache) ? &dbvt : nullptr;
}

void DbvtUpdater::update(btDbvtBroadphase& broadphase, const std::vector<Bounds>& bounds, btDispatcher* dispatcher) {
  ++m_updates;
  classify(broadphase, bounds);
  markUpdated(broadphase, bounds);
  placeLeaves(broadphase);
  findPairs(broadphase);
  // Out of the tree of what stands still, which is rare: a call each.
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    if (m_changes[i] != Change::Fixed) continue;
    broadphase.setAabb(bounds[i].proxy, bounds[i].lower, bounds[i].upper, dispatcher);
  }
}

void DbvtUpdater::classify(btDbvtBroadphase& broadphase, const std::vector<Bounds>& bounds) {
  m_changes.resize(bounds.size());
  m_volumes.resize(bounds.size());
  parallelFor(bounds.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      m_changes[i] = Change::None;
      if (!bounds[i].proxy) continue;
      const btDbvtProxy& proxy = *dbvtProxy(bounds[i].proxy);
      const btDbvtAabbMm &old = proxy.leaf->volume, now = btDbvtAabbMm::FromMM(bounds[i].lower, bounds[i].upper);
      m_volumes[i] = now;
      if (!NotEqual(now, old)) continue;
      if (proxy.stage == btDbvtBroadphase::STAGECOUNT) {
        m_changes[i] = Change::Fixed;
      } else if (old.Contain(now)) {
        m_changes[i] = Change::Inside;
      } else if (Intersect(old, now)) {
        m_changes[i] = Change::Moved;
        m_volumes[i] = withMargin(broadphase, proxy, bounds[i]);
      } else {
        m_changes[i] = Change::Teleported;
      }
    }
  });
}

// New AABBs, and the stage: Bullet puts into the tree of what stands still what has not been updated for two steps.
void DbvtUpdater::markUpdated(btDbvtBroadphase& broadphase, const std::vector<Bounds>& bounds) {
  const int stage = broadphase.m_stageCurrent;
  m_moved.clear();
  int updated = 0;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    const Change change = m_changes[i];
    updated += change == Change::Inside || change == Change::Moved || change == Change::Teleported;
    if (change == Change::Moved || change == Change::Teleported) m_moved.push_back(static_cast<std::uint32_t>(i));
  }
  // All of them, which are all of the other stage: its list as a whole becomes that of this stage.
  btDbvtProxy *&current = broadphase.m_stageRoots[stage], *&other = broadphase.m_stageRoots[1 - stage];
  const bool all = !current && updated == broadphase.m_sets[btDbvtBroadphase::DYNAMIC_SET].m_leaves;
  if (all) std::swap(current, other);
  parallelFor(bounds.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      if (m_changes[i] == Change::None || m_changes[i] == Change::Fixed) continue;
      btDbvtProxy& proxy = *dbvtProxy(bounds[i].proxy);
      proxy.m_aabbMin = bounds[i].lower;
      proxy.m_aabbMax = bounds[i].upper;
      if (all) proxy.stage = stage;
    }
  });
  for (std::size_t i = 0; i < bounds.size() && !all; ++i) {
    if (m_changes[i] == Change::None || m_changes[i] == Change::Fixed) continue;
    btDbvtProxy* proxy = dbvtProxy(bounds[i].proxy);
    if (proxy->stage == stage) continue;
    unlink(proxy, other);
    proxy->stage = stage;
    link(proxy, current);
  }
  broadphase.m_updates_call += static_cast<unsigned>(updated);
  broadphase.m_updates_done += static_cast<unsigned>(m_moved.size());
  m_movedProxies.clear();
  for (const std::uint32_t i : m_moved) m_movedProxies.push_back(dbvtProxy(bounds[i].proxy));
}

// Where few moved, each leaf is put where it belongs. Where many did, most stay where they are in the tree, and the
// nodes above are fitted to them; from time to time they are put in place after all, one by one or by building the
// tree anew, whichever is less.
void DbvtUpdater::placeLeaves(btDbvtBroadphase& broadphase) {
  const Zone zone("placeLeaves");
  btDbvt& tree = broadphase.m_sets[btDbvtBroadphase::DYNAMIC_SET];
  const auto leaves = static_cast<std::size_t>(tree.m_leaves);
  const bool few = m_moved.size() * kFewMoved < leaves;
  std::size_t teleported = 0;
  for (const std::uint32_t i : m_moved) teleported += m_changes[i] == Change::Teleported;
  const bool most = m_moved.size() * kPlaceCost >= leaves;
  const bool build = most && (teleported * kPlaceCost >= leaves || m_updates - m_built >= kPlaceEvery);
  if (!few) {
    parallelFor(m_moved.size(), kGrain, [&](std::size_t first, std::size_t last) {
      for (std::size_t k = first; k < last; ++k) m_movedProxies[k]->leaf->volume = m_volumes[m_moved[k]];
    });
    if (!build) refit(tree);
  }
  if (build) {
    m_built = m_updates;
    m_builder.build(tree);
    m_leaves.resize(1);
    m_builder.listLeaves(m_leaves.front());
    return;
  }
  for (std::size_t k = 0; k < m_moved.size(); ++k) {
    const bool due = !most && (m_moved[k] + m_updates) % kPlaceEvery == 0;
    if (few || due || m_changes[m_moved[k]] == Change::Teleported) {
      tree.update(m_movedProxies[k]->leaf, m_volumes[m_moved[k]]);
    }
  }
}

void DbvtUpdater::refit(btDbvt& tree) {
  m_cut.make(tree.m_root, kSubtrees);
  m_leaves.resize(m_cut.pieces.size());
  parallelFor(m_cut.pieces.size(), kFitGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) fitBelow(m_cut.pieces[i], m_leaves[i]);
  });
  for (auto it = m_cut.above.rbegin(); it != m_cut.above.rend(); ++it) {
    Merge((*it)->childs[0]->volume, (*it)->childs[1]->volume, (*it)->volume);
  }
}

void DbvtUpdater::markMoved(bool moved) {
  for (const btDbvtProxy* proxy : m_movedProxies) {
    const auto id = static_cast<std::size_t>(proxy->m_uniqueId);
    if (m_isMoved.size() <= id) m_isMoved.resize(id + 1);
    m_isMoved[id] = moved;
  }
}

// From each leaf that moved through both trees.
void DbvtUpdater::findPairsOfLeaves(const btDbvtBroadphase& broadphase) {
  constexpr std::size_t kChunk = 128;
  m_found.resize(chunkCount(m_moved.size(), kChunk));
  parallelChunks(m_moved.size(), kChunk, [&](std::size_t chunk, std::size_t first, std::size_t last) {
    struct Collector : btDbvt::ICollide {
      void Process(const btDbvtNode* node) override {
        auto* other = static_cast<btDbvtProxy*>(node->data);
        if (other == proxy) return;
        ++found->overlaps;
        const auto id = static_cast<std::size_t>(other->m_uniqueId);
        const bool low = proxy->m_uniqueId < other->m_uniqueId;
        // Two that moved find each other: one of them is enough.
        if (!low && id < isMoved->size() && (*isMoved)[id]) return;
        found->proxies.emplace_back(low ? proxy : other, low ? other : proxy);
      }
      const std::vector<bool>* isMoved;
      btDbvtProxy* proxy;
      Found* found;
    } collector;
    Found& found = m_found[chunk];
    found.clear();
    collector.isMoved = &m_isMoved;
    collector.found = &found;
    btNodeStack stack;
    for (std::size_t k = first; k < last; ++k) {
      collector.proxy = m_movedProxies[k];
      for (const int set : {btDbvtBroadphase::FIXED_SET, btDbvtBroadphase::DYNAMIC_SET}) {
        const btDbvt& tree = broadphase.m_sets[set];
        tree.collideTVNoStackAlloc(tree.m_root, collector.proxy->leaf->volume, stack, collector);
      }
    }
  });
}

// Where most moved: all leaves, listed when the tree was fitted, against all others and against the tree of what stands
// still. The blocks go down to where leaves meet, and not each leaf by itself.
void DbvtUpdater::findPairsOfBlocks(const btDbvtBroadphase& broadphase) {
  constexpr std::size_t kChunk = 16;
  const btDbvtNode* fixed = broadphase.m_sets[btDbvtBroadphase::FIXED_SET].m_root;
  m_blocks.build(m_leaves, m_isMoved);
  m_found.resize(chunkCount(m_blocks.blockCount(), kChunk));
  parallelChunks(m_blocks.blockCount(), kChunk, [&](std::size_t chunk, std::size_t first, std::size_t last) {
    Found& found = m_found[chunk];
    found.clear();
    for (std::size_t block = first; block < last; ++block) m_blocks.findPairs(block, fixed, found);
  });
}

void DbvtUpdater::Found::clear() {
  proxies.clear();
  overlaps = 0;
}

void DbvtUpdater::findPairs(btDbvtBroadphase& broadphase) {
  const Zone zone("findNewPairs");
  if (m_moved.empty()) return;
  auto& cache = static_cast<btHashedOverlappingPairCache&>(*broadphase.m_paircache);
  markMoved(true);
  const auto leaves = static_cast<std::size_t>(broadphase.m_sets[btDbvtBroadphase::DYNAMIC_SET].m_leaves);
  if (m_moved.size() * kMostMoved < leaves) {
    findPairsOfLeaves(broadphase);
  } else {
    findPairsOfBlocks(broadphase);
  }
  markMoved(false);
  const PairTable known(cache);
  parallelFor(m_found.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) known.keepMissing(m_found[i].proxies, m_found[i].places);
  });
  broadphase.m_needcleanup = true;
  for (const Found& found : m_found) {
    broadphase.m_newpairs += found.overlaps;
    for (const auto& [a, b] : found.proxies) cache.addOverlappingPair(a, b);
  }
}

BTGPU_TRANSLATION_END
