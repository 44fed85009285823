// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace btgpu {

// Something that the device did not do, by name.
struct FallbackEntry {
  std::string what;         // "cylinder shape", "constraint solver"
  std::string reason;       // why, in words
  std::uint64_t count = 0;  // steps in which it sent the world to the stock path (or bodies, for a quarantine)
  bool wholeStep = true;    // false: only this ran on the CPU, inside a step of the device
};

class FallbackList {
 public:
  // What ran on the CPU, or not at all, inside a step of the device.
  void addShare(const std::string& what, const std::string& reason, std::uint64_t count = 1) {
    add(what, reason, count, false);
  }
  void add(const std::string& what, const std::string& reason, std::uint64_t count = 1, bool wholeStep = true) {
    for (auto& entry : m_entries) {
      if (entry.what == what && entry.reason == reason) {
        entry.count += count;
        return;
      }
    }
    m_entries.push_back({what, reason, count, wholeStep});
  }
  void addAll(const FallbackList& other) {
    for (const auto& entry : other.m_entries) add(entry.what, entry.reason, entry.count, entry.wholeStep);
  }
  // Counts each entry of one step's list once.
  void addStep(const FallbackList& step) {
    for (const auto& entry : step.m_entries) add(entry.what, entry.reason, 1, entry.wholeStep);
  }
  const std::vector<FallbackEntry>& entries() const { return m_entries; }
  bool empty() const { return m_entries.empty(); }
  void clear() { m_entries.clear(); }

 private:
  std::vector<FallbackEntry> m_entries;
};

}  // namespace btgpu
