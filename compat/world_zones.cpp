// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "world_zones.h"

#include <cstdlib>
#include <utility>

#include "profile_files.h"

namespace btgpu {

void WorldZones::useFile(const std::string& name) {
  const char* fromEnvironment = name.empty() ? std::getenv("BTGPU_PROFILE") : nullptr;
  const std::string file = fromEnvironment ? fromEnvironment : name;
  if (file == m_file) return;
  m_file = file;
  use(openProfileFile(file));
}

void WorldZones::use(std::shared_ptr<Profile> profile, bool timesDevice) {
  m_profile = std::move(profile);
  m_timesDevice = timesDevice;
  m_listening.reset();
  if (!m_profile) return;
  m_device = m_profile->addDevice();
  m_listening.emplace();
}

void WorldZones::enter(const char* name) noexcept {
  if (m_profile) m_profile->enter(name);
  enterBulletZone(name);
}

void WorldZones::leave() noexcept {
  leaveBulletZone();
  if (m_profile) m_profile->leave();
}

void WorldZones::add(const DeviceSlices& slices) noexcept {
  if (m_profile) m_profile->add(m_device, slices);
}

WorldScope::WorldScope(WorldZones& zones)
    : m_sink(currentZoneSink() == &zones ? &zones : zones.wanted()),
      m_profile(zones.profile()),
      m_bullets(m_profile.get()) {
  if (m_profile) m_depth = m_profile->depth();
}

WorldScope::~WorldScope() {
  if (m_profile) m_profile->closeTo(m_depth);
}

}  // namespace btgpu
