// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Numbers, texts and raw bytes in a row, as capture files have them: little-endian, without padding.
#pragma once

#include <xxhash.h>

#include <cstring>
#include <string>

#include "capture.h"

namespace btgpu {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers are written as they lie in memory");

inline std::uint64_t checksumOf(const unsigned char* bytes, size_t count) { return XXH3_64bits(bytes, count); }

class ByteWriter {
 public:
  template <typename T>
  void number(T value) {
    const auto* from = reinterpret_cast<const unsigned char*>(&value);
    m_bytes.insert(m_bytes.end(), from, from + sizeof value);
  }
  void text(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size()));
    m_bytes.insert(m_bytes.end(), text.begin(), text.end());
  }
  void raw(const Bytes& bytes) { m_bytes.insert(m_bytes.end(), bytes.begin(), bytes.end()); }
  const Bytes& bytes() const { return m_bytes; }

 private:
  Bytes m_bytes;
};

// Throws CaptureError where fewer bytes are left than are asked for, before anything is allocated.
class ByteReader {
 public:
  explicit ByteReader(const Bytes& bytes) : m_next(bytes.data()), m_left(bytes.size()) {}

  template <typename T>
  T number() {
    T value;
    std::memcpy(&value, take(sizeof value), sizeof value);
    return value;
  }
  std::string text() {
    const auto size = number<std::uint32_t>();
    return {reinterpret_cast<const char*>(take(size)), size};
  }
  Bytes raw(std::uint64_t size) {
    const unsigned char* from = take(size);
    return {from, from + size};
  }
  // How many things follow, of at least `least` bytes each.
  size_t count(size_t least) {
    const auto count = number<std::uint32_t>();
    if (count > m_left / least) throw CaptureError("ends too early");
    return count;
  }
  bool atEnd() const { return m_left == 0; }

 private:
  const unsigned char* take(std::uint64_t size) {
    if (size > m_left) throw CaptureError("ends too early");
    const unsigned char* from = m_next;
    m_next += size;
    m_left -= size;
    return from;
  }

  const unsigned char* m_next;
  std::uint64_t m_left;
};

}  // namespace btgpu
