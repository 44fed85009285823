// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stable indices: an object keeps its own, and freed ones are used again, the lowest first.
#include "translation/index_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <set>

namespace btgpu::test {
namespace {

using Slots = std::vector<std::uint32_t>;

// Addresses to insert; nothing is ever read there.
const void* address(size_t i) {
  static const std::vector<char> memory(1000);
  return &memory.at(i);
}

TEST(IndexMap, EmptyHasNoSlots) {
  const IndexMap map;
  EXPECT_EQ(map.slotCount(), 0u);
  EXPECT_EQ(map.size(), 0u);
  EXPECT_EQ(map.find(address(0)), kNoSlot);
  EXPECT_EQ(map.find(nullptr), kNoSlot);
}

TEST(IndexMap, SlotsFollowTheOrderOfComing) {
  IndexMap map;
  for (std::uint32_t i = 0; i < 10; ++i) EXPECT_EQ(map.insert(address(9 - i)), i);
  for (std::uint32_t i = 0; i < 10; ++i) EXPECT_EQ(map.find(address(9 - i)), i);
  EXPECT_EQ(map.find(address(10)), kNoSlot);
  EXPECT_EQ(map.slotCount(), 10u);
}

// Whatever order four of eight are freed in, the rest stay where they are and the freed slots come back
// lowest first.
TEST(IndexMap, FreedSlotsComeBackLowestFirstInAnyOrder) {
  Slots freed = {1, 3, 4, 6};
  do {
    IndexMap map;
    for (size_t i = 0; i < 8; ++i) map.insert(address(i));
    for (const std::uint32_t slot : freed) map.erase(slot);
    EXPECT_EQ(map.size(), 4u);
    EXPECT_EQ(map.slotCount(), 8u) << "slots of those that left stay";
    for (const std::uint32_t i : {0u, 2u, 5u, 7u}) EXPECT_EQ(map.find(address(i)), i);
    for (const std::uint32_t i : freed) EXPECT_EQ(map.find(address(i)), kNoSlot);
    Slots again;
    for (size_t i = 0; i < 5; ++i) again.push_back(map.insert(address(100 + i)));
    EXPECT_EQ(again, (Slots{1, 3, 4, 6, 8})) << "and then a new one";
    EXPECT_EQ(map.slotCount(), 9u);
  } while (std::next_permutation(freed.begin(), freed.end()));
}

TEST(IndexMap, AnObjectThatComesBackGetsTheLowestFreeSlot) {
  IndexMap map;
  for (size_t i = 0; i < 4; ++i) map.insert(address(i));
  map.erase(3);
  map.erase(1);
  EXPECT_EQ(map.insert(address(3)), 1u);
  EXPECT_EQ(map.insert(address(1)), 3u);
}

TEST(IndexMap, ClearForgetsEverything) {
  IndexMap map;
  for (size_t i = 0; i < 4; ++i) map.insert(address(i));
  map.erase(2);
  map.clear();
  EXPECT_EQ(map.slotCount(), 0u);
  EXPECT_EQ(map.find(address(0)), kNoSlot);
  EXPECT_EQ(map.insert(address(3)), 0u);
  EXPECT_EQ(map.insert(address(0)), 1u);
}

// Against a set of free slots and a map, which is all that it has to be.
TEST(IndexMap, RandomComingAndGoing) {
  std::mt19937 random(7);
  IndexMap map;
  std::map<const void*, std::uint32_t> slots;
  std::set<std::uint32_t> free;
  std::uint32_t slotCount = 0;
  for (int round = 0; round < 5000; ++round) {
    const void* object = address(random() % 200);
    const auto it = slots.find(object);
    if (it != slots.end()) {
      map.erase(it->second);
      free.insert(it->second);
      slots.erase(it);
    } else {
      std::uint32_t expected = slotCount;
      if (free.empty()) {
        ++slotCount;
      } else {
        expected = *free.begin();
        free.erase(free.begin());
      }
      ASSERT_EQ(map.insert(object), expected) << "round " << round;
      slots[object] = expected;
    }
    ASSERT_EQ(map.size(), slots.size());
    ASSERT_EQ(map.slotCount(), slotCount);
    for (size_t i = 0; i < 200; ++i) {
      const auto known = slots.find(address(i));
      ASSERT_EQ(map.find(address(i)), known == slots.end() ? kNoSlot : known->second) << "round " << round;
    }
  }
}

}  // namespace
}  // namespace btgpu::test
