// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>
#include <vector>

#include "device_array.h"
#include "queue.h"
#include "type_names.h"

namespace btgpu {

// A pointer argument that may be null.
template <typename T>
struct Optional {
  const DeviceArray<T>* array;
};

// A kernel with checked argument binding: the number of arguments always, their types (as the kernel's source
// spells them) wherever the driver can tell, which PoCL does, so that tests catch a wrong binding.
class Kernel {
 public:
  Kernel() = default;  // an empty one, to be built when it is first needed
  // The kernel `name` of kernels/<file>. Throws OpenClError.
  Kernel(ComputeDevice& device, const std::string& file, const std::string& name, const std::string& options = {});

  bool isBuilt() const { return !m_name.empty(); }

  // Binds all arguments in order and launches. Arguments: DeviceArray<T> (or Optional<T>) for a pointer to T, uint
  // or float by value.
  template <typename... Args>
  void launch(Queue& queue, Grid grid, const Args&... args) {
    checkCount(sizeof...(args));
    m_next = 0;
    (bind(args), ...);
    queue.launch(m_kernel, m_name, grid);
  }

 private:
  void checkCount(size_t given) const;
  void checkType(const char* typeName, bool pointer) const;

  template <typename T>
  void bind(const DeviceArray<T>& array) {
    checkType(TypeName<T>::value, true);
    set(sizeof(cl_mem), array.capacity() ? static_cast<const void*>(&array.buffer()()) : nullptr);
  }
  void bind(uint value) {
    checkType("uint", false);
    set(sizeof value, &value);
  }
  void bind(float value) {
    checkType("float", false);
    set(sizeof value, &value);
  }
  template <typename T>
  void bind(const Optional<T>& optional) {
    if (optional.array) {
      bind(*optional.array);
    } else {
      checkType(TypeName<T>::value, true);
      set(sizeof(cl_mem), nullptr);
    }
  }
  void set(size_t size, const void* value);

  std::string m_name;
  cl::Kernel m_kernel;
  std::vector<std::string> m_argumentTypes;  // empty if the driver does not tell
  unsigned m_argumentCount = 0, m_next = 0;
};

}  // namespace btgpu
