// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "array_difference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "word_names.h"

namespace btgpu {
namespace {

float floatOf(std::uint32_t bits) {
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

// Floats in their order, as whole numbers; -0 and +0 are the same.
std::int64_t rankOf(std::uint32_t bits) {
  const auto magnitude = static_cast<std::int64_t>(bits & 0x7fffffffu);
  return bits >> 31 ? -magnitude : magnitude;
}

struct Distance {
  std::uint64_t ulps;
  double absolute;
};

Distance distance(std::uint32_t a, std::uint32_t b) {
  const float x = floatOf(a), y = floatOf(b);
  if (std::isnan(x) != std::isnan(y)) {
    return {std::numeric_limits<std::uint64_t>::max(), std::numeric_limits<double>::infinity()};
  }
  if (std::isnan(x) || x == y) return {0, 0};
  return {static_cast<std::uint64_t>(std::abs(rankOf(a) - rankOf(b))), std::abs(double(x) - double(y))};
}

std::string valueText(std::uint32_t bits, bool isFloat) {
  return isFloat ? fmt::format("{:.9g} (0x{:08x})", floatOf(bits), bits) : fmt::format("{} (0x{:08x})", bits, bits);
}

std::string hexText(const unsigned char* bytes, size_t count) {
  std::string text = "0x";
  for (size_t i = count; i > 0; --i) text += fmt::format("{:02x}", bytes[i - 1]);
  return text;
}

// One element after the other. An element of whole words is compared by words, one of another size as a whole.
class Comparison {
 public:
  Comparison(const CapturedArray& captured, const Bytes& found)
      : m_captured(captured), m_found(found), m_step(captured.elementBytes) {
    m_result.elements = found.size() / m_step;
    for (size_t i = 0; i < m_result.elements; ++i) addElement(i);
  }
  const ArrayDifference& result() const { return m_result; }

 private:
  void addElement(size_t index) {
    const unsigned char* expected = m_captured.expected().data() + index * m_step;
    const unsigned char* found = m_found.data() + index * m_step;
    if (std::memcmp(expected, found, m_step) == 0) return;
    const bool first = m_result.different++ == 0;
    if (first) m_result.firstElement = index;
    if (m_step % sizeof(std::uint32_t) == 0 && m_captured.type != "ulong") {
      addWords(expected, found, first);
    } else if (first) {
      m_result.firstExpected = hexText(expected, std::min<size_t>(m_step, 8));
      m_result.firstFound = hexText(found, std::min<size_t>(m_step, 8));
    }
  }

  void addWords(const unsigned char* expected, const unsigned char* found, bool first) {
    for (size_t at = 0; at < m_step; at += sizeof(std::uint32_t)) {
      std::uint32_t a, b;
      std::memcpy(&a, expected + at, sizeof a);
      std::memcpy(&b, found + at, sizeof b);
      if (a == b) continue;
      const WordName word = nameOfWord(m_captured.type, m_step, at);
      if (first) {
        first = false;
        m_result.firstField = word.field;
        m_result.firstExpected = valueText(a, word.isFloat);
        m_result.firstFound = valueText(b, word.isFloat);
      }
      if (word.isFloat) addFloat(a, b);
    }
  }

  void addFloat(std::uint32_t expected, std::uint32_t found) {
    const Distance d = distance(expected, found);
    m_result.anyFloat = true;
    m_result.mostUlps = std::max(m_result.mostUlps, d.ulps);
    m_result.mostAbsolute = std::max(m_result.mostAbsolute, d.absolute);
  }

  const CapturedArray& m_captured;
  const Bytes& m_found;
  const size_t m_step;
  ArrayDifference m_result;
};

}  // namespace

ArrayDifference compareArray(const CapturedArray& captured, const Bytes& found) {
  return Comparison(captured, found).result();
}

std::string describe(const CapturedArray& captured, const ArrayDifference& d) {
  std::string text = fmt::format("{}: {} of {} elements differ", captured.name.empty() ? "(no name)" : captured.name,
                                 d.different, d.elements);
  if (d.anyFloat && std::isinf(d.mostAbsolute)) {
    text += ", by NaN or infinity";
  } else if (d.anyFloat) {
    text += fmt::format(", by up to {} ulps ({:.3g})", d.mostUlps, d.mostAbsolute);
  }
  const char* dot = d.firstField.empty() || d.firstField[0] == '[' ? "" : ".";
  return text + fmt::format("; first: [{}]{}{} is {} and was {}", d.firstElement, dot, d.firstField, d.firstFound,
                            d.firstExpected);
}

}  // namespace btgpu
