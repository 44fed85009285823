// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "profile.h"

#include <chrono>
#include <new>

namespace btgpu {
namespace {

// Beyond these the application makes names up as it goes; see enter().
constexpr std::size_t kNames = 4096, kNodes = 16384, kLanes = 4096, kDepth = 256, kDevices = 4096;

std::int64_t now() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

Profile::Profile(std::size_t eventLimit) : m_start(now()), m_events(eventLimit), m_slices(eventLimit) {}

// -1: there are too many.
int Profile::intern(const char* name) {
  const auto it = m_nameIndices.find(name);
  if (it != m_nameIndices.end()) return it->second;
  if (m_data.names.size() >= kNames) return -1;
  m_data.names.emplace_back(name);
  const int index = static_cast<int>(m_data.names.size()) - 1;
  m_nameIndices.emplace(name, index);
  return index;
}

int Profile::childOf(int parent, const char* name) {
  const int index = intern(name);
  if (index < 0) return -1;
  const auto it = m_children.find({parent, index});
  if (it != m_children.end()) return it->second;
  if (m_data.nodes.size() >= kNodes) return -1;
  const int depth = parent < 0 ? 0 : m_data.nodes[static_cast<std::size_t>(parent)].depth + 1;
  m_data.nodes.push_back({index, parent, depth, 0, 0, 0});
  const int node = static_cast<int>(m_data.nodes.size()) - 1;
  m_children.emplace(std::pair(parent, index), node);
  return node;
}

// A zone for which there is no room counts as lost, and what is inside it as its parent's.
void Profile::enter(const char* name) noexcept {
  const std::lock_guard<std::mutex> lock(m_mutex);
  ++m_version;
  try {
    auto it = m_lanes.find(std::this_thread::get_id());
    if (it == m_lanes.end()) {
      if (m_lanes.size() >= kLanes) return;
      it = m_lanes.emplace(std::this_thread::get_id(), Lane{static_cast<int>(m_lanes.size()), {}}).first;
      it->second.open.reserve(kDepth);
      m_data.threads = static_cast<int>(m_lanes.size());
    }
    std::vector<Open>& open = it->second.open;
    int parent = -1;
    for (auto o = open.rbegin(); o != open.rend() && parent < 0; ++o) parent = o->node;
    int node = -1;
    try {
      if (open.size() < kDepth) node = childOf(parent, name);
    } catch (const std::bad_alloc&) {  // open all the same, so that leave() finds it
    }
    if (node < 0) ++m_data.lostEvents;
    open.push_back({node, now()});
  } catch (const std::bad_alloc&) { ++m_data.lostEvents; }
}

void Profile::close(Lane& lane, std::int64_t time) {
  const Open open = lane.open.back();
  lane.open.pop_back();
  if (open.node < 0) return;
  auto& node = m_data.nodes[static_cast<std::size_t>(open.node)];
  const std::int64_t duration = time - open.start;
  ++node.calls;
  node.total += duration;
  if (node.parent >= 0) m_data.nodes[static_cast<std::size_t>(node.parent)].inChildren += duration;
  m_events.push({open.node, lane.thread, open.start - m_start, duration});
}

void Profile::leave() noexcept {
  const std::int64_t time = now();
  const std::lock_guard<std::mutex> lock(m_mutex);
  ++m_version;
  const auto it = m_lanes.find(std::this_thread::get_id());
  if (it == m_lanes.end() || it->second.open.empty()) return;
  try {
    close(it->second, time);
  } catch (const std::bad_alloc&) { ++m_data.lostEvents; }
}

std::size_t Profile::depth() const noexcept {
  const std::lock_guard<std::mutex> lock(m_mutex);
  const auto it = m_lanes.find(std::this_thread::get_id());
  return it == m_lanes.end() ? 0 : it->second.open.size();
}

void Profile::closeTo(std::size_t depth) noexcept {
  while (this->depth() > depth) leave();
}

int Profile::addDevice() {
  const std::lock_guard<std::mutex> lock(m_mutex);
  if (m_data.devices.size() < kDevices) m_data.devices.emplace_back();
  return static_cast<int>(m_data.devices.size()) - 1;
}

void Profile::nameDevice(int device, const std::string& name) noexcept {
  const std::lock_guard<std::mutex> lock(m_mutex);
  try {
    m_data.devices[static_cast<std::size_t>(device)].name = name;
  } catch (const std::bad_alloc&) {  // it stays without
  }
}

void Profile::add(int device, const DeviceSlices& slices) noexcept {
  const std::lock_guard<std::mutex> lock(m_mutex);
  ++m_version;
  m_data.lostSlices += slices.lost;
  auto& accuracy = m_data.devices[static_cast<std::size_t>(device)].accuracy;
  if (slices.accuracy > accuracy) accuracy = slices.accuracy;
  std::size_t i = 0;
  try {
    for (; i < slices.count; ++i) {
      const DeviceSlice& s = slices.slices[i];
      const int stage = intern(s.stage), kernel = intern(s.kernel);
      const auto [it, isNew] = m_launchSums.emplace(std::pair(stage, kernel), static_cast<int>(m_data.launches.size()));
      if (isNew) m_data.launches.push_back({stage, kernel, 0, 0});
      auto& sum = m_data.launches[static_cast<std::size_t>(it->second)];
      ++sum.count;
      sum.total += s.ended - s.started;
      m_slices.push(
          {device, stage, kernel, s.queued - m_start, s.submitted - m_start, s.started - m_start, s.ended - m_start});
    }
  } catch (const std::bad_alloc&) { m_data.lostSlices += slices.count - i; }
}

void Profile::countStep() noexcept {
  const std::lock_guard<std::mutex> lock(m_mutex);
  ++m_data.steps;
}

void Profile::clear() {
  const std::lock_guard<std::mutex> lock(m_mutex);
  ++m_version;
  for (auto& node : m_data.nodes) node.calls = 0, node.total = 0, node.inChildren = 0;
  for (auto& sum : m_data.launches) sum.count = 0, sum.total = 0;
  m_events.clear();
  m_slices.clear();
  m_data.steps = m_data.lostEvents = m_data.lostSlices = 0;
}

ProfileData Profile::data() const {
  const std::lock_guard<std::mutex> lock(m_mutex);
  ProfileData data = m_data;
  data.events = m_events.inOrder();
  data.slices = m_slices.inOrder();
  data.lostEvents += m_events.lost();
  data.lostSlices += m_slices.lost();
  return data;
}

std::uint64_t Profile::version() const {
  const std::lock_guard<std::mutex> lock(m_mutex);
  return m_version;
}

}  // namespace btgpu
