// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Virtual functions, as the Itanium C++ ABI lays them out (every compiler on Linux): to see whether a class of the
// application's has made one its own, which would be passed by.
#pragma once

#include <cstdint>
#include <cstring>

namespace btgpu {

// Of an object of a class with virtual functions.
inline const void* virtualTableOf(const void* object) {
  const void* table;
  std::memcpy(&table, object, sizeof table);
  return table;
}

// What a virtual member function is for objects with this table. `member` holds the offset into the table: on x86 plus
// one, on ARM with the mark in its other half.
template <typename Member>
const void* virtualEntry(const void* table, Member member) {
  std::uintptr_t raw[2];
  static_assert(sizeof member == sizeof raw);
  std::memcpy(raw, &member, sizeof raw);
  const void* entry;
  std::memcpy(&entry, static_cast<const char*>(table) + (raw[0] & ~std::uintptr_t{1}), sizeof entry);
  return entry;
}

}  // namespace btgpu
