// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "dbvt_builder.h"

#include <algorithm>
#include <cmath>

#include "parallel.h"

BTGPU_TRANSLATION_BEGIN
namespace {

constexpr std::size_t kPieces = 256;   // in which nodes are collected
constexpr std::size_t kGrain = 2048;   // leaves of a subtree that is worth a task of its own
constexpr std::size_t kFewLeaves = 4;  // less are never told apart by their size

void fit(btDbvtNode& node) { Merge(node.childs[0]->volume, node.childs[1]->volume, node.volume); }

btDbvtNode* firstLeaf(btDbvtNode* node) {
  while (node->isinternal()) node = node->childs[0];
  return node;
}

// Calls leaf(node) and inner(node), children before their parent. Without a stack: a tree may be as deep as it has
// leaves.
template <typename Leaf, typename Inner>
void walkBelow(btDbvtNode* root, const Leaf& leaf, const Inner& inner) {
  btDbvtNode* node = firstLeaf(root);
  leaf(node);
  while (node != root) {
    btDbvtNode* parent = node->parent;
    if (node == parent->childs[0]) {
      node = firstLeaf(parent->childs[1]);
      leaf(node);
    } else {
      inner(parent);
      node = parent;
    }
  }
}

btVector3 edgesOf(const btDbvtAabbMm& box) { return box.Maxs() - box.Mins(); }
btScalar sumOf(const btVector3& v) { return v.x() + v.y() + v.z(); }

}  // namespace

void DbvtCut::make(btDbvtNode* root, std::size_t wanted) {
  above.clear();
  pieces.clear();
  if (root) pieces.push_back(root);
  for (bool cut = true; cut && pieces.size() < wanted;) {
    std::vector<btDbvtNode*> below;
    for (btDbvtNode* node : pieces) {
      if (node->isleaf()) {
        below.push_back(node);
      } else {
        above.push_back(node);
        below.insert(below.end(), {node->childs[0], node->childs[1]});
      }
    }
    cut = below.size() > pieces.size();
    pieces = std::move(below);
  }
}

void fitBelow(btDbvtNode* root, LeafList& leaves) {
  leaves.clear();
  walkBelow(
      root, [&leaves](btDbvtNode* leaf) { leaves.push_back(leaf); }, [](btDbvtNode* node) { fit(*node); });
}

void DbvtBuilder::collect(btDbvtNode* root) {
  m_cut.make(root, kPieces);
  m_below.resize(m_cut.pieces.size());
  parallelFor(m_below.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      Nodes& nodes = m_below[i];
      nodes.leaves.clear();
      nodes.inner.clear();
      walkBelow(
          m_cut.pieces[i], [&](btDbvtNode* leaf) { nodes.leaves.push_back(leaf); },
          [&](btDbvtNode* node) { nodes.inner.push_back(node); });
    }
  });
  m_items.clear();
  m_inner = m_cut.above;
  for (const Nodes& nodes : m_below) {
    for (btDbvtNode* leaf : nodes.leaves) m_items.push_back({btVector3(), leaf});
    m_inner.insert(m_inner.end(), nodes.inner.begin(), nodes.inner.end());
  }
  parallelFor(m_items.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const btDbvtAabbMm& box = m_items[i].leaf->volume;
      m_items[i].centre = box.Mins() + box.Maxs();
      // What can't be compared would lead the partitions below out of their arrays.
      for (int axis = 0; axis < 3; ++axis) {
        if (std::isnan(m_items[i].centre[axis])) m_items[i].centre[axis] = 0;
      }
      m_items[i].centre[3] = sumOf(edgesOf(box));
    }
  });
}

// A tree over the items first ... first + count - 1. Leaves larger than the region in which all of them have their
// centres go into a subtree of their own (`mayPeel`), so that they do not make the nodes of all others large.
btDbvtNode* DbvtBuilder::build(std::size_t first, std::size_t count, bool mayPeel) {
  const auto begin = m_items.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  if (count == 1) return begin->leaf;
  btVector3 lower = begin->centre, upper = begin->centre;
  for (auto item = begin; item != end; ++item) {
    lower.setMin(item->centre);
    upper.setMax(item->centre);
  }
  const btVector3 edges = (upper - lower) / 2;
  std::size_t left = 0;
  if (mayPeel && count > kFewLeaves) {
    const btScalar region = sumOf(edges);
    const auto rest = std::partition(begin, end, [&](const Item& item) { return item.centre[3] > region; });
    left = static_cast<std::size_t>(rest - begin);
  }
  const bool peeled = left > 0 && left < count;
  if (!peeled) {
    left = count / 2;
    const int axis = edges.maxAxis();
    std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(left), end,
                     [axis](const Item& a, const Item& b) { return a.centre[axis] < b.centre[axis]; });
  }
  // A subtree of n leaves has n - 1 inner nodes: those of the left one, this node, those of the right one.
  btDbvtNode& node = *m_inner[first + left - 1];
  const std::size_t firsts[2] = {first, first + left}, counts[2] = {left, count - left};
  parallelFor(2, count > kGrain ? 1 : 2, [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) {
      node.childs[k] = build(firsts[k], counts[k], !peeled);
      node.childs[k]->parent = &node;
    }
  });
  fit(node);
  return &node;
}

void DbvtBuilder::build(btDbvt& tree) {
  m_items.clear();
  if (!tree.m_root) return;
  collect(tree.m_root);
  tree.m_root = build(0, m_items.size(), true);
  tree.m_root->parent = nullptr;
}

void DbvtBuilder::listLeaves(LeafList& leaves) const {
  leaves.clear();
  for (const Item& item : m_items) leaves.push_back(item.leaf);
}

BTGPU_TRANSLATION_END
