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

// True if the function is seen to return at once, as a compiler that optimizes leaves one with an empty body; false
// where that can't be told.
#if defined(__x86_64__) || (defined(__aarch64__) && defined(__AARCH64EL__))
inline bool returnsAtOnce(const void* function) {
#ifdef __x86_64__
  constexpr unsigned char kMark[] = {0xf3, 0x0f, 0x1e, 0xfa}, kReturn[] = {0xc3};  // endbr64; ret
#else
  constexpr unsigned char kMark[] = {0x5f, 0x24, 0x03, 0xd5}, kReturn[] = {0xc0, 0x03, 0x5f, 0xd6};  // bti c; ret
#endif
  const auto* code = static_cast<const unsigned char*>(function);
  if (std::memcmp(code, kReturn, sizeof kReturn) == 0) return true;
  return std::memcmp(code, kMark, sizeof kMark) == 0 && std::memcmp(code + sizeof kMark, kReturn, sizeof kReturn) == 0;
}
#else
inline bool returnsAtOnce(const void*) { return false; }
#endif

}  // namespace btgpu
