// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../opencl/device_array.h"

namespace btgpu {

// Without waiting. A kernel's argument has to be something, even where there is nothing.
template <typename T>
void uploadAll(Queue& queue, const std::vector<T>& from, DeviceArray<T>& to) {
  to.resize(queue, std::max<size_t>(1, from.size()));
  if (!from.empty()) queue.write(to.buffer(), 0, from.size() * sizeof(T), from.data(), false);
}

}  // namespace btgpu
