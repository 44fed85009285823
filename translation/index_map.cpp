// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "index_map.h"

#include <algorithm>
#include <functional>

namespace btgpu {

std::uint32_t IndexMap::place(const void* object) {
  std::uint32_t slot = slotCount();
  if (m_free.empty()) {
    m_slots.push_back(object);
  } else {
    std::pop_heap(m_free.begin(), m_free.end(), std::greater<>());
    slot = m_free.back();
    m_free.pop_back();
    m_slots[slot] = object;
  }
  return slot;
}

std::uint32_t IndexMap::insert(const void* object) {
  const std::uint32_t slot = place(object);
  m_index.emplace(object, slot);
  return slot;
}

std::uint32_t IndexMap::take() { return place(this); }

std::uint32_t IndexMap::find(const void* object) const {
  const auto it = m_index.find(object);
  return it == m_index.end() ? kNoSlot : it->second;
}

void IndexMap::erase(std::uint32_t slot) {
  m_index.erase(m_slots[slot]);
  m_slots[slot] = nullptr;
  m_free.push_back(slot);
  std::push_heap(m_free.begin(), m_free.end(), std::greater<>());
}

void IndexMap::clear() { *this = IndexMap(); }

}  // namespace btgpu
