// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <cstddef>
#include <utility>
#include <vector>

#include "bullet.h"
#include "dbvt_builder.h"

BTGPU_TRANSLATION_BEGIN

// Pairs of leaves that overlap and of which at least one has moved.
struct LeafPairs {
  std::vector<std::pair<btDbvtProxy*, btDbvtProxy*>> proxies;  // the lower id first
  int overlaps = 0;                                            // each pair of two that moved counts twice, as in stock
};

// The leaves of one of Bullet's trees in blocks of kWidth, and above them an implicit tree of that width: box k of a
// level bounds block k of the level below. Boxes of a block lie side by side, so that one meets all of them at once,
// and the leaves of a block go through the tree together. Which pairs overlap does not depend on the order of the
// leaves; how fast they are found does: leaves that are near each other should come one after the other.
class LeafBlocks {
 public:
  static constexpr std::size_t kWidth = 8;

  // `lists`: the leaves, list after list. `isMoved`: by id of the proxy; ids beyond its end have not.
  void build(const std::vector<LeafList>& lists, const std::vector<bool>& isMoved);
  std::size_t blockCount() const { return m_moved.size(); }

  // Appends the pairs of the leaves of `block` with each other, with those of later blocks, and with those below
  // `other`, a tree in which nothing has moved, or null.
  void findPairs(std::size_t block, const btDbvtNode* other, LeafPairs& found) const;

 private:
  struct Box {
    btScalar lower[3], upper[3];
  };
  struct Block {
    btScalar lower[3][kWidth], upper[3][kWidth];
    void set(std::size_t k, const Box& box);
    Box box(std::size_t k) const;
    Box bounds() const;
    unsigned overlaps(const Box& other) const;  // bit k: box k does
  };
  static Box boxOf(const btDbvtAabbMm& volume);
  void layLevels();
  void fill(const std::vector<bool>& isMoved);
  void fillParents();
  void meetBlock(std::size_t block, std::size_t other, LeafPairs& found) const;
  void meetTree(std::size_t block, const btDbvtNode* other, LeafPairs& found) const;

  LeafList m_leaves;
  std::vector<btDbvtProxy*> m_proxies;
  std::vector<unsigned> m_moved;             // by block: bit k for its leaf k
  std::vector<std::vector<Block>> m_levels;  // from the leaves up to a single block
};

BTGPU_TRANSLATION_END
