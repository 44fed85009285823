// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <type_traits>
#include <vector>

#include "error.h"
#include "queue.h"

namespace btgpu {

// Host memory that the device writes into while the host does something else: allocated by OpenCL and mapped for as
// long as it lives, since a copy into ordinary memory makes NVIDIA's driver wait for the queue. Ordinary memory does
// where OpenCL has none of that kind left. Contents are lost when it grows. The queue must be done with it when it
// grows and when it goes.
template <typename T>
class HostArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  HostArray() = default;
  ~HostArray() { release(); }
  HostArray(const HostArray&) = delete;
  HostArray& operator=(const HostArray&) = delete;

  size_t size() const { return m_size; }
  T* data() { return m_data; }
  const T& operator[](size_t i) const { return m_data[i]; }

  void resize(Queue& queue, size_t size) {
    if (size > m_capacity) {
      release();
      m_capacity = 0;
      const size_t wanted = size + size / 2;
      if (!allocate(queue, wanted)) {
        m_ordinary.resize(wanted);
        m_data = m_ordinary.data();
      }
      m_capacity = wanted;
    }
    m_size = size;
  }

  // The first size() elements of `from`, without waiting. done: set to the event of the copy.
  void readFrom(Queue& queue, const cl::Buffer& from, cl::Event* done = nullptr) {
    queue.read(from, 0, m_size * sizeof(T), m_data, false, done);
  }

  void copyTo(std::vector<T>& destination) const { destination.assign(m_data, m_data + m_size); }

 private:
  bool allocate(Queue& queue, size_t count) {
    try {
      m_buffer = cl::Buffer(queue.device().context(), CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR, count * sizeof(T));
      m_data = static_cast<T*>(
          queue.raw().enqueueMapBuffer(m_buffer, CL_TRUE, CL_MAP_READ | CL_MAP_WRITE, 0, count * sizeof(T)));
      m_queue = queue.raw();
      return true;
    } catch (const cl::Error&) {
      m_buffer = cl::Buffer();
      return false;
    }
  }
  void release() noexcept {
    // Nothing to be done if the device is lost.
    if (m_data && m_ordinary.empty()) clEnqueueUnmapMemObject(m_queue(), m_buffer(), m_data, 0, nullptr, nullptr);
    m_data = nullptr;
    m_buffer = cl::Buffer();
    m_ordinary.clear();
  }

  cl::Buffer m_buffer;
  cl::CommandQueue m_queue;
  std::vector<T> m_ordinary;  // in place of m_buffer
  T* m_data = nullptr;
  size_t m_size = 0, m_capacity = 0;
};

}  // namespace btgpu
