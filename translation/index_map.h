// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

namespace btgpu {

inline constexpr std::uint32_t kNoSlot = 0xffffffffu;

// Pointer <-> stable index. Slots of objects that left are used again, the lowest first, so that the index of an
// object depends only on the order in which objects came and went.
class IndexMap {
 public:
  // Gives an object that is not in the map a slot.
  std::uint32_t insert(const void* object);
  // A slot for something that has no pointer of its own.
  std::uint32_t take();
  std::uint32_t find(const void* object) const;
  void erase(std::uint32_t slot);

  // Length of arrays indexed by slot: one more than the highest slot ever in use.
  std::uint32_t slotCount() const { return static_cast<std::uint32_t>(m_slots.size()); }
  std::size_t size() const { return m_index.size(); }
  void clear();

 private:
  std::uint32_t place(const void* object);

  std::vector<const void*> m_slots;   // null: free; the map itself: taken
  std::vector<std::uint32_t> m_free;  // min-heap
  std::unordered_map<const void*, std::uint32_t> m_index;
};

}  // namespace btgpu
