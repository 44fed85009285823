// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Profile zones of the host (docs/profile.md), for compat, translation and engine alike. Each of the two libraries has
// its own current sink: the engine is handed one with Engine::setZoneSink.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace btgpu {

// One launch of a kernel. Times are nanoseconds of std::chrono::steady_clock, as accurate as its batch says.
struct DeviceSlice {
  const char *stage, *kernel;  // live as long as the call that hands the slice over
  std::int64_t queued, submitted, started, ended;
};

struct DeviceSlices {
  const DeviceSlice* slices;
  std::size_t count;
  std::int64_t accuracy;  // all times may be off by this much together, to either side; nanoseconds
  std::size_t lost;       // launches whose times could not be had
};

// Where zones go. Calls of one thread are balanced.
class ZoneSink {
 public:
  virtual void enter(const char* name) noexcept = 0;  // name: a literal
  virtual void leave() noexcept = 0;
  virtual void add(const DeviceSlices& slices) noexcept = 0;

 protected:
  ~ZoneSink() = default;
};

namespace zones {
inline std::atomic<int> g_scopes{0};                // ZoneSinkScopes with a sink, on all threads
inline thread_local ZoneSink* t_current = nullptr;  // the innermost scope's, null if that has none
}  // namespace zones

// The sink of what this thread is doing; null if nobody listens.
inline ZoneSink* currentZoneSink() {
  return zones::g_scopes.load(std::memory_order_relaxed) == 0 ? nullptr : zones::t_current;
}

// A part of the step, for as long as it lives. Nobody listening, it is one load.
class Zone {
 public:
  explicit Zone(const char* name) : m_sink(currentZoneSink()) {
    if (m_sink) m_sink->enter(name);
  }
  ~Zone() {
    if (m_sink) m_sink->leave();
  }
  Zone(const Zone&) = delete;
  Zone& operator=(const Zone&) = delete;

 private:
  ZoneSink* m_sink;
};

// Sends this thread's zones to `sink` (null: nowhere) for as long as it lives.
class ZoneSinkScope {
 public:
  explicit ZoneSinkScope(ZoneSink* sink) : m_counted(sink != nullptr), m_before(currentZoneSink()) {
    if (!m_counted && !m_before) return;
    if (m_counted) zones::g_scopes.fetch_add(1, std::memory_order_relaxed);
    zones::t_current = sink;
  }
  ~ZoneSinkScope() {
    if (!m_counted && !m_before) return;
    zones::t_current = m_before;
    if (m_counted) zones::g_scopes.fetch_sub(1, std::memory_order_relaxed);
  }
  ZoneSinkScope(const ZoneSinkScope&) = delete;
  ZoneSinkScope& operator=(const ZoneSinkScope&) = delete;

 private:
  bool m_counted;
  ZoneSink* m_before;
};

}  // namespace btgpu
