// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>
#include <string>

#include "device_world.h"
#include "engine.h"
#include "stages/30_pair_finders.h"

namespace btgpu {

// Stage 30 by itself on a device. Everything here throws OpenClError.
class DevicePairSearch {
 public:
  DevicePairSearch(const std::string& device, PairFinder finder);
  void setBodies(const std::vector<BodyInfo>& infos, const std::vector<Aabb>& aabbs);
  PairSearchTimes find();
  void readKeys(std::vector<ulong>& keys);

 private:
  void makeRoom(size_t pairs);
  double findOnce(StepCounters& counters);

  std::shared_ptr<ComputeDevice> m_device;
  Queue m_queue;
  PairFinder m_finder;
  PairFinders m_finders;
  DeviceWorld m_world;  // of which only the arrays of stage 30 have any length
  uint m_pairCount = 0;
};

}  // namespace btgpu
