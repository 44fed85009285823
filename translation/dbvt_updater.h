// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <utility>
#include <vector>

#include "bullet.h"
#include "dbvt_builder.h"
#include "leaf_blocks.h"

BTGPU_TRANSLATION_BEGIN

// btDbvtBroadphase::setAabb for many bodies at once, on several threads. What can be asked of the broadphase afterwards
// is as after as many calls: every proxy has its new AABB and a leaf that holds it, with Bullet's margin around what
// moved out of its old one; every two leaves that overlap, of which one moved, are a pair in the cache if the filters
// allow it. The tree's shape and the order of pairs may differ.
//
// Where many leaves moved, most keep their place in the tree and the nodes above are fitted anew. So that the tree
// follows what moves far, moving leaves are put where they belong in one of kPlaceEvery updates: each in its turn, or
// all at once by building the tree anew.
class DbvtUpdater {
 public:
  using ProxyPair = std::pair<btDbvtProxy*, btDbvtProxy*>;
  struct Bounds {
    btVector3 lower, upper;
    btBroadphaseProxy* proxy;  // null: to be left out
  };

  // The broadphase if it is one that can be updated so; else null, and setAabb has to be called. Who listens to pairs
  // that come (btOverlappingPairCallback), but for ghost objects, hears of them in stock's order and needs that, too.
  static btDbvtBroadphase* updatable(btDiscreteDynamicsWorld& world);

  void update(btDbvtBroadphase& broadphase, const std::vector<Bounds>& bounds, btDispatcher* dispatcher);

 private:
  enum class Change : unsigned char { None, Inside, Moved, Teleported, Fixed };
  void classify(btDbvtBroadphase& broadphase, const std::vector<Bounds>& bounds);
  void markUpdated(btDbvtBroadphase& broadphase, const std::vector<Bounds>& bounds);
  void placeLeaves(btDbvtBroadphase& broadphase);
  void refit(btDbvt& tree);
  void findPairs(btDbvtBroadphase& broadphase);
  void markMoved(bool moved);
  void findPairsOfLeaves(const btDbvtBroadphase& broadphase);
  void findPairsOfBlocks(const btDbvtBroadphase& broadphase);

  static constexpr unsigned kPlaceEvery = 32;
  unsigned m_updates = 0, m_built = 0;       // so many updates, and at which of them the tree was built
  std::vector<Change> m_changes;             // by element of bounds
  std::vector<btDbvtAabbMm> m_volumes;       // the new ones, likewise
  std::vector<std::uint32_t> m_moved;        // elements whose leaf gets a new volume
  std::vector<btDbvtProxy*> m_movedProxies;  // those elements' proxies
  DbvtCut m_cut;                             // of the tree that is fitted
  DbvtBuilder m_builder;
  std::vector<LeafList> m_leaves;  // of the tree that was fitted or built, from left to right
  struct Found : LeafPairs {
    std::vector<int> places;
    void clear();
  };
  std::vector<bool> m_isMoved;  // by id of the proxy
  LeafBlocks m_blocks;
  std::vector<Found> m_found;  // by chunk
};

BTGPU_TRANSLATION_END
