// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "leaf_blocks.h"

#include <algorithm>
#include <limits>
#include <type_traits>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "parallel.h"

BTGPU_TRANSLATION_BEGIN
namespace {

constexpr std::size_t kGrain = 64;  // blocks
constexpr std::size_t kLevels = 24, kStack = kLevels * LeafBlocks::kWidth;
constexpr unsigned kAll = (1u << LeafBlocks::kWidth) - 1;

std::size_t blocksOf(std::size_t boxes) { return (boxes + LeafBlocks::kWidth - 1) / LeafBlocks::kWidth; }

std::size_t lowestBit(unsigned mask) { return static_cast<std::size_t>(__builtin_ctz(mask)); }

void add(btDbvtProxy& a, btDbvtProxy& b, LeafPairs& found) {
  const bool low = a.m_uniqueId < b.m_uniqueId;
  found.proxies.emplace_back(low ? &a : &b, low ? &b : &a);
}

#ifdef __SSE2__
// Of four at once.
__m128 below(const float* a, __m128 b) { return _mm_cmple_ps(_mm_loadu_ps(a), b); }
__m128 above(const float* a, __m128 b) { return _mm_cmpge_ps(_mm_loadu_ps(a), b); }
#endif

}  // namespace

void LeafBlocks::Block::set(std::size_t k, const Box& from) {
  for (int axis = 0; axis < 3; ++axis) {
    lower[axis][k] = from.lower[axis];
    upper[axis][k] = from.upper[axis];
  }
}

LeafBlocks::Box LeafBlocks::Block::box(std::size_t k) const {
  return {{lower[0][k], lower[1][k], lower[2][k]}, {upper[0][k], upper[1][k], upper[2][k]}};
}

LeafBlocks::Box LeafBlocks::Block::bounds() const {
  Box all = box(0);
  for (std::size_t k = 1; k < kWidth; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      all.lower[axis] = std::min(all.lower[axis], lower[axis][k]);
      all.upper[axis] = std::max(all.upper[axis], upper[axis][k]);
    }
  }
  return all;
}

unsigned LeafBlocks::Block::overlaps(const Box& other) const {
#ifdef __SSE2__
  if constexpr (std::is_same_v<btScalar, float>) {
    unsigned mask = 0;
    for (std::size_t k = 0; k < kWidth; k += 4) {
      __m128 hit = _mm_and_ps(below(reinterpret_cast<const float*>(&lower[0][k]), _mm_set1_ps(float(other.upper[0]))),
                              above(reinterpret_cast<const float*>(&upper[0][k]), _mm_set1_ps(float(other.lower[0]))));
      for (int axis = 1; axis < 3; ++axis) {
        const __m128 to = _mm_set1_ps(float(other.upper[axis])), from = _mm_set1_ps(float(other.lower[axis]));
        hit = _mm_and_ps(hit, below(reinterpret_cast<const float*>(&lower[axis][k]), to));
        hit = _mm_and_ps(hit, above(reinterpret_cast<const float*>(&upper[axis][k]), from));
      }
      mask |= static_cast<unsigned>(_mm_movemask_ps(hit)) << k;
    }
    return mask;
  }
#endif
  unsigned mask = 0;
  for (std::size_t k = 0; k < kWidth; ++k) {
    unsigned hit = 1;
    for (int axis = 0; axis < 3; ++axis) {
      hit &= static_cast<unsigned>(lower[axis][k] <= other.upper[axis]);
      hit &= static_cast<unsigned>(upper[axis][k] >= other.lower[axis]);
    }
    mask |= hit << k;
  }
  return mask;
}

LeafBlocks::Box LeafBlocks::boxOf(const btDbvtAabbMm& volume) {
  const btVector3 &lower = volume.Mins(), &upper = volume.Maxs();
  return {{lower.x(), lower.y(), lower.z()}, {upper.x(), upper.y(), upper.z()}};
}

void LeafBlocks::build(const std::vector<LeafList>& lists, const std::vector<bool>& isMoved) {
  m_leaves.clear();
  for (const LeafList& list : lists) m_leaves.insert(m_leaves.end(), list.begin(), list.end());
  layLevels();
  if (m_leaves.empty()) return;
  fill(isMoved);
  fillParents();
}

void LeafBlocks::layLevels() {
  m_proxies.resize(m_leaves.size());
  m_moved.resize(blocksOf(m_leaves.size()));
  std::size_t level = 0;
  for (std::size_t blocks = m_moved.size(); blocks > 0; blocks = blocks == 1 ? 0 : blocksOf(blocks), ++level) {
    if (level == m_levels.size()) m_levels.emplace_back();
    m_levels[level].resize(blocks);
  }
  m_levels.resize(level);
}

// What a block has no leaf for overlaps nothing.
static constexpr btScalar kNowhere = std::numeric_limits<btScalar>::infinity();

void LeafBlocks::fill(const std::vector<bool>& isMoved) {
  parallelFor(m_moved.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t b = first; b < last; ++b) {
      unsigned moved = 0;
      for (std::size_t k = 0; k < kWidth; ++k) {
        const std::size_t i = b * kWidth + k;
        if (i >= m_leaves.size()) {
          m_levels[0][b].set(k, {{kNowhere, kNowhere, kNowhere}, {-kNowhere, -kNowhere, -kNowhere}});
          continue;
        }
        m_levels[0][b].set(k, boxOf(m_leaves[i]->volume));
        m_proxies[i] = static_cast<btDbvtProxy*>(m_leaves[i]->data);
        const auto id = static_cast<std::size_t>(m_proxies[i]->m_uniqueId);
        if (id < isMoved.size() && isMoved[id]) moved |= 1u << k;
      }
      m_moved[b] = moved;
    }
  });
}

void LeafBlocks::fillParents() {
  for (std::size_t level = 1; level < m_levels.size(); ++level) {
    const std::vector<Block>& below = m_levels[level - 1];
    for (std::size_t i = 0; i < m_levels[level].size() * kWidth; ++i) {
      const Box none = {{kNowhere, kNowhere, kNowhere}, {-kNowhere, -kNowhere, -kNowhere}};
      m_levels[level][i / kWidth].set(i % kWidth, i < below.size() ? below[i].bounds() : none);
    }
  }
}

void LeafBlocks::findPairs(std::size_t block, const btDbvtNode* other, LeafPairs& found) const {
  struct Place {
    std::size_t level, block;
  };
  Place stack[kStack];
  std::size_t depth = 0;
  const Box bounds = m_levels[0][block].bounds();
  stack[depth++] = {m_levels.size() - 1, 0};
  while (depth > 0) {
    const Place at = stack[--depth];
    if (at.level == 0) {
      meetBlock(block, at.block, found);
      continue;
    }
    // Of the blocks below, those from this one on.
    std::size_t from = block;
    for (std::size_t level = 1; level < at.level; ++level) from /= kWidth;
    unsigned mask = m_levels[at.level][at.block].overlaps(bounds);
    if (from > at.block * kWidth) mask &= kAll << std::min(kWidth, from - at.block * kWidth);
    for (; mask; mask &= mask - 1) stack[depth++] = {at.level - 1, at.block * kWidth + lowestBit(mask)};
  }
  if (m_moved[block] && other) meetTree(block, other, found);
}

void LeafBlocks::meetBlock(std::size_t block, std::size_t other, LeafPairs& found) const {
  const unsigned moved = m_moved[block], movedOthers = m_moved[other];
  if (!(moved | movedOthers)) return;
  const Block &own = m_levels[0][block], &others = m_levels[0][other];
  unsigned near = kAll;
  if (m_levels.size() > 1) near = own.overlaps(m_levels[1][other / kWidth].box(other % kWidth));
  if (!movedOthers) near &= moved;
  for (; near; near &= near - 1) {
    const std::size_t k = lowestBit(near);
    const bool isMoved = (moved >> k & 1u) != 0;
    unsigned hits = others.overlaps(own.box(k));
    if (!isMoved) hits &= movedOthers;
    if (block == other) hits &= ~((2u << k) - 1u);
    for (; hits; hits &= hits - 1) {
      const std::size_t o = lowestBit(hits);
      found.overlaps += static_cast<int>(isMoved) + static_cast<int>(movedOthers >> o & 1u);
      add(*m_proxies[block * kWidth + k], *m_proxies[other * kWidth + o], found);
    }
  }
}

// Without recursion: a tree may be as deep as it has leaves.
void LeafBlocks::meetTree(std::size_t block, const btDbvtNode* root, LeafPairs& found) const {
  const Block& own = m_levels[0][block];
  const unsigned moved = m_moved[block];
  thread_local std::vector<const btDbvtNode*> stack;
  stack.assign(1, root);
  while (!stack.empty()) {
    const btDbvtNode* node = stack.back();
    stack.pop_back();
    unsigned hits = own.overlaps(boxOf(node->volume)) & moved;
    if (!hits) continue;
    if (node->isinternal()) {
      stack.insert(stack.end(), {node->childs[0], node->childs[1]});
      continue;
    }
    auto* fixed = static_cast<btDbvtProxy*>(node->data);
    for (; hits; hits &= hits - 1) {
      ++found.overlaps;
      add(*m_proxies[block * kWidth + lowestBit(hits)], *fixed, found);
    }
  }
}

BTGPU_TRANSLATION_END
