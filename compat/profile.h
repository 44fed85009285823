// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "../gpu_engine/zone.h"

namespace btgpu {

// Keeps the last values, as many as its limit says, and counts those before them.
template <typename T>
class Ring {
 public:
  explicit Ring(std::size_t limit) : m_limit(limit) {}

  void push(const T& value) {
    if (m_values.size() < m_limit) {
      m_values.push_back(value);
    } else {
      ++m_lost;
      if (m_limit == 0) return;
      m_values[m_oldest] = value;
      m_oldest = (m_oldest + 1) % m_limit;
    }
  }
  void clear() {
    m_values.clear();
    m_oldest = m_lost = 0;
  }
  std::size_t lost() const { return m_lost; }
  std::vector<T> inOrder() const {
    std::vector<T> values(m_values.begin() + static_cast<std::ptrdiff_t>(m_oldest), m_values.end());
    values.insert(values.end(), m_values.begin(), m_values.begin() + static_cast<std::ptrdiff_t>(m_oldest));
    return values;
  }

 private:
  std::size_t m_limit, m_oldest = 0, m_lost = 0;
  std::vector<T> m_values;
};

// What a profile holds. All times are nanoseconds; points in time count from the start of the profile.
struct ProfileData {
  // All calls of a zone under the same parents, on whatever thread.
  struct Node {
    int name, parent;  // parent -1: none
    int depth;
    std::uint64_t calls;
    std::int64_t total, inChildren;
  };
  // One call of a zone.
  struct Event {
    int node, thread;
    std::int64_t start, duration;
  };
  struct Slice {
    int device, stage, kernel;
    std::int64_t queued, submitted, started, ended;
  };
  struct Launches {
    int stage, kernel;
    std::uint64_t count;
    std::int64_t total;
  };
  struct Device {
    std::string name;
    std::int64_t accuracy = 0;  // of the slices' place on the host's axis, the worst there was
  };

  // index -1: there were too many different ones.
  const char* name(int index) const { return index < 0 ? "(other)" : names[static_cast<std::size_t>(index)].c_str(); }

  std::vector<std::string> names;
  std::vector<Node> nodes;  // parents before their children
  std::vector<Launches> launches;
  std::vector<Event> events;  // in the order in which they ended
  std::vector<Slice> slices;
  std::vector<Device> devices;
  std::uint64_t steps = 0;
  int threads = 0;
  // Left out of events and slices, for want of room or since their times could not be had; the sums have the former.
  std::uint64_t lostEvents = 0, lostSlices = 0;
};

// Records zones and launches of any number of worlds and threads. Its memory is bounded: of the single events it keeps
// the last, of the sums a number of different zones that no application comes near.
class Profile {
 public:
  static constexpr std::size_t kEventLimit = 500'000;  // zones, and as many launches: about 40 MB, if both are used up

  explicit Profile(std::size_t eventLimit = kEventLimit);
  Profile(const Profile&) = delete;
  Profile& operator=(const Profile&) = delete;

  void enter(const char* name) noexcept;
  void leave() noexcept;
  // Zones that are open on this thread; and closes those beyond `depth`.
  std::size_t depth() const noexcept;
  void closeTo(std::size_t depth) noexcept;

  int addDevice();  // a queue, one row of the trace
  void nameDevice(int device, const std::string& name) noexcept;
  void add(int device, const DeviceSlices& slices) noexcept;
  void countStep() noexcept;

  // Forgets all that has been recorded; zones that are open go on.
  void clear();
  ProfileData data() const;
  // Changes with whatever is recorded.
  std::uint64_t version() const;

 private:
  struct Open {
    int node;  // -1: not recorded
    std::int64_t start;
  };
  struct Lane {
    int thread;
    std::vector<Open> open;
  };

  int intern(const char* name);
  int childOf(int parent, const char* name);
  void close(Lane& lane, std::int64_t now);

  mutable std::mutex m_mutex;
  std::int64_t m_start;  // of std::chrono::steady_clock
  std::unordered_map<std::string, int> m_nameIndices;
  std::map<std::pair<int, int>, int> m_children;    // parent and name to node
  std::map<std::pair<int, int>, int> m_launchSums;  // stage and kernel to its place in launches
  std::unordered_map<std::thread::id, Lane> m_lanes;
  ProfileData m_data;  // all but events and slices
  Ring<ProfileData::Event> m_events;
  Ring<ProfileData::Slice> m_slices;
  std::uint64_t m_version = 0;
};

}  // namespace btgpu
