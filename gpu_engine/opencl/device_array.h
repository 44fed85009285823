// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "error.h"
#include "queue.h"

namespace btgpu {

// Tells one piece of device memory from all others that the process ever had; a freed one's handle may come again.
inline unsigned long newGeneration() {
  static std::atomic<unsigned long> last{0};
  return ++last;
}

// Behind every array of a debug build lie at least so many bytes that nobody may write.
constexpr size_t kGuardBytes = 256;

// A typed array on the device, as the paper has it: resizable like std::vector, with copies from and to the
// host that wait only if asked. Growth is geometric. The host memory of a copy without wait must stay as it
// is until the queue is finished.
template <typename T>
class DeviceArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  DeviceArray() = default;
  explicit DeviceArray(std::string name) : m_name(std::move(name)) {}

  size_t size() const { return m_size; }
  size_t capacity() const { return m_capacity; }
  size_t sizeBytes() const { return m_size * sizeof(T); }
  size_t capacityBytes() const { return m_capacity * sizeof(T); }
  bool empty() const { return m_size == 0; }
  const cl::Buffer& buffer() const { return m_buffer; }
  unsigned long generation() const { return m_generation; }  // of the memory; 0: none
  const std::string& name() const { return m_name; }

  // Makes room for `wanted` elements; keeps the first size() ones. Throws OpenClError (out of memory).
  void reserve(Queue& queue, size_t wanted) {
    if (wanted <= m_capacity) return;
    const size_t most = queue.device().description().largestAllocation / sizeof(T);
    size_t grown = std::max({wanted, std::min(m_capacity + m_capacity / 2, most), size_t{16}}), guard = 0;
    if (queue.device().debugKernels()) {
      grown = wanted;
      guard = (kGuardBytes + sizeof(T) - 1) / sizeof(T);
    }
    const cl::Buffer larger = allocate(queue.device(), grown + guard);
    if (queue.recorder()) queue.recorder()->afterAllocation(queue, larger, grown * sizeof(T), m_name);
    queue.copy(m_buffer, larger, 0, 0, m_size * sizeof(T));
    m_buffer = larger;
    m_generation = newGeneration();
    m_capacity = grown;
  }

  // New elements are undefined until written.
  void resize(Queue& queue, size_t size) {
    reserve(queue, size);
    m_size = size;
  }

  void push_back(Queue& queue, const T& value, bool wait = true) {
    resize(queue, m_size + 1);
    queue.write(m_buffer, (m_size - 1) * sizeof(T), sizeof(T), &value, wait);
  }

  void copyFromHost(Queue& queue, const std::vector<T>& source, bool wait = true) {
    resize(queue, source.size());
    queue.write(m_buffer, 0, source.size() * sizeof(T), source.data(), wait);
  }

  // Elements [first, first + count) from source[first ...].
  void copyRangeFromHost(Queue& queue, const std::vector<T>& source, size_t first, size_t count, bool wait = true) {
    assert(first + count <= m_size && first + count <= source.size());
    queue.write(m_buffer, first * sizeof(T), count * sizeof(T), source.data() + first, wait);
  }

  void copyToHost(Queue& queue, std::vector<T>& destination, bool wait = true) const {
    destination.resize(m_size);
    queue.read(m_buffer, 0, m_size * sizeof(T), destination.data(), wait);
  }

  std::vector<T> toVector(Queue& queue) const {
    std::vector<T> host;
    copyToHost(queue, host);
    return host;
  }

  // Memory and contents change hands; names stay.
  friend void swap(DeviceArray& a, DeviceArray& b) {
    std::swap(a.m_buffer, b.m_buffer);
    std::swap(a.m_generation, b.m_generation);
    std::swap(a.m_size, b.m_size);
    std::swap(a.m_capacity, b.m_capacity);
  }

 private:
  cl::Buffer allocate(const ComputeDevice& device, size_t count) const {
    const auto what = [&] { return fmt::format("{}: {} elements, {} bytes", m_name, count, count * sizeof(T)); };
    // NVIDIA's driver grants any size and fails at the first use.
    if (count > device.description().globalMemory / sizeof(T)) {
      throw OpenClError(OpenClError::Kind::OutOfMemory, "more than the device's memory for " + what());
    }
    try {
      return cl::Buffer(device.context(), CL_MEM_READ_WRITE, count * sizeof(T));
    } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), what()); }
  }

  std::string m_name;
  cl::Buffer m_buffer;
  unsigned long m_generation = 0;
  size_t m_size = 0, m_capacity = 0;
};

// What the host sees of an array, in place. While it is mapped no kernel may write the array.
template <typename T>
class HostView {
 public:
  // The first `count` elements; there to be read once the queue is finished. Ends an earlier view.
  void map(Queue& queue, const DeviceArray<T>& array, size_t count) {
    unmap(queue);
    if (count == 0) return;
    m_buffer = array.buffer();
    m_data = static_cast<T*>(queue.map(m_buffer, count * sizeof(T)));
  }
  void unmap(Queue& queue) {
    // Once, whether it works or not.
    T* data = std::exchange(m_data, nullptr);
    const cl::Buffer buffer = std::exchange(m_buffer, cl::Buffer());
    if (data) queue.unmap(buffer, data);
  }
  const T* data() const { return m_data; }

 private:
  cl::Buffer m_buffer;
  T* m_data = nullptr;
};

}  // namespace btgpu
