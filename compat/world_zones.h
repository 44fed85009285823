// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "bullet_profiler.h"

namespace btgpu {

// Where the zones of one world go: to its profile, if it has one, and to the application's profiler, if Bullet has
// been told of one.
class WorldZones final : public ZoneSink {
 public:
  WorldZones() { useFile({}); }
  WorldZones(const WorldZones&) = delete;
  WorldZones& operator=(const WorldZones&) = delete;

  // An empty name: the one in the environment variable BTGPU_PROFILE, if that is set.
  void useFile(const std::string& name);
  // timesDevice: with the launches, which needs another kind of queue; for an engine that is not made yet.
  void use(std::shared_ptr<Profile> profile, bool timesDevice = true);
  const std::shared_ptr<Profile>& profile() const { return m_profile; }
  bool timesDevice() const { return m_profile && m_timesDevice; }
  void nameDevice(const std::string& name) noexcept {
    if (m_profile) m_profile->nameDevice(m_device, name);
  }

  // Null if nobody listens at present.
  ZoneSink* wanted() { return m_profile || hasBulletProfiler() ? this : nullptr; }

  void enter(const char* name) noexcept override;
  void leave() noexcept override;
  void add(const DeviceSlices& slices) noexcept override;

 private:
  std::string m_file;
  std::optional<BulletListening> m_listening;
  std::shared_ptr<Profile> m_profile;
  bool m_timesDevice = false;
  int m_device = 0;  // the profile's number of this world's queue
};

// This thread is in a call of the world's. What is opened inside and left open, is closed at its end.
class WorldScope {
 public:
  explicit WorldScope(WorldZones& zones);
  ~WorldScope();
  WorldScope(const WorldScope&) = delete;
  WorldScope& operator=(const WorldScope&) = delete;

 private:
  ZoneSinkScope m_sink;
  std::shared_ptr<Profile> m_profile;
  BulletZonesScope m_bullets;
  std::size_t m_depth = 0;
};

}  // namespace btgpu
