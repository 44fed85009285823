// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// How equal the device and a stage's reference must be, asked value by value: each reference's header says by how much
// a value may be off, and this notes the first one that is off by more. Used by the tests of the stages and, while an
// application runs, by HostStages.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "../../kernels/shared/types.h"
#include "../step_results.h"

namespace btgpu {

class Contract {
 public:
  explicit Contract(std::string stage) : m_stage(std::move(stage)) {}

  // Where the values compared from here on are found: "body 17".
  template <typename... Args>
  void at(fmt::format_string<Args...> where, Args&&... args) {
    m_where.clear();
    fmt::format_to(std::back_inserter(m_where), where, std::forward<Args>(args)...);
  }

  // |device - reference| <= limit; what is no number must be none on either side.
  void near(const char* what, double device, double reference, double limit) {
    if (std::isnan(device) && std::isnan(reference)) return;
    if (device == reference || std::fabs(device - reference) <= limit) return;
    note(what, device, reference, limit);
  }
  // Of vectors, w apart: the length of the difference.
  void near(const char* what, float4 device, float4 reference, double limit) {
    const double x = double(device.x) - reference.x, y = double(device.y) - reference.y,
                 z = double(device.z) - reference.z;
    const double off = std::sqrt(x * x + y * y + z * z);
    if (off <= limit || same3(device, reference)) return;
    // The component that is off most tells most.
    const double ax = std::fabs(x), ay = std::fabs(y), az = std::fabs(z);
    if (!(ax < ay) && !(ax < az)) return note(what, device.x, reference.x, limit);
    if (!(ay < az)) return note(what, device.y, reference.y, limit);
    note(what, device.z, reference.z, limit);
  }
  void same(const char* what, double device, double reference) { near(what, device, reference, 0); }
  void require(bool holds, const char* what) {
    if (!holds) note(what, 0, 1, 0);
  }
  // Bit for bit, element by element; of a struct, the first word that differs is told as a number.
  template <typename T>
  void sameArray(const char* what, const std::vector<T>& device, const std::vector<T>& reference) {
    at("{}", what);
    same("count", static_cast<double>(device.size()), static_cast<double>(reference.size()));
    for (size_t i = 0; ok() && i < reference.size(); ++i) {
      if (std::memcmp(&device[i], &reference[i], sizeof(T)) != 0) noteElement(what, i, device[i], reference[i]);
    }
    at("");
  }
  // A value that must be one of several, and lies this far from the nearest.
  void within(const char* what, double off, double limit) {
    if (!(off <= limit)) note(what, off, 0, limit);
  }

  bool ok() const { return !m_first; }
  const std::optional<StageDifference>& first() const { return m_first; }
  std::string text() const { return m_first ? textOf(*m_first) : std::string(); }

 private:
  template <typename T>
  void noteElement(const char* what, size_t i, const T& device, const T& reference) {
    if constexpr (std::is_arithmetic_v<T>) {
      at("{}", what);
      note(fmt::format("{}", i).c_str(), static_cast<double>(device), static_cast<double>(reference), 0);
    } else {
      constexpr size_t kWords = sizeof(T) / sizeof(uint);
      uint a[kWords], b[kWords];
      std::memcpy(a, &device, sizeof a);
      std::memcpy(b, &reference, sizeof b);
      size_t k = 0;
      while (k + 1 < kWords && a[k] == b[k]) ++k;
      at("{} {}", what, i);
      note(fmt::format("word {}", k).c_str(), a[k], b[k], 0);
    }
  }
  static bool same1(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }
  static bool same3(float4 a, float4 b) { return same1(a.x, b.x) && same1(a.y, b.y) && same1(a.z, b.z); }
  void note(const char* what, double device, double reference, double limit) {
    if (m_first) return;
    m_first = StageDifference{m_stage, m_where.empty() ? what : m_where + ": " + what, device, reference, limit};
  }

  std::string m_stage, m_where;
  std::optional<StageDifference> m_first;
};

}  // namespace btgpu
