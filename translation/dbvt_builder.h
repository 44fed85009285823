// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include <cstddef>
#include <vector>

#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

// A tree cut level by level into subtrees that threads can share out.
struct DbvtCut {
  std::vector<btDbvtNode*> above;   // inner nodes, parents before their children
  std::vector<btDbvtNode*> pieces;  // what hangs below them: `wanted` or more, if the tree has as many; leaves too

  void make(btDbvtNode* root, std::size_t wanted);
};

using LeafList = std::vector<const btDbvtNode*>;

// The volumes of all inner nodes below and including `root`, children first. Lists the leaves, from left to right.
void fitBelow(btDbvtNode* root, LeafList& leaves);

// Builds a tree over the leaves that it has anew, from the top, by halves along the longest axis; on several threads.
// Leaves and inner nodes stay the objects they were. The same tree gives the same tree on any number of threads.
class DbvtBuilder {
 public:
  void build(btDbvt& tree);
  // Those of the tree that was built last, from left to right.
  void listLeaves(LeafList& leaves) const;

 private:
  struct Item {
    btVector3 centre;  // twice the centre; w: length of the three edges
    btDbvtNode* leaf;
  };
  void collect(btDbvtNode* root);
  btDbvtNode* build(std::size_t first, std::size_t count, bool mayPeel);

  struct Nodes {
    std::vector<btDbvtNode*> leaves, inner;
  };
  DbvtCut m_cut;
  std::vector<Nodes> m_below;  // by piece
  std::vector<Item> m_items;
  std::vector<btDbvtNode*> m_inner;
};

BTGPU_TRANSLATION_END
