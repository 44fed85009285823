// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstring>
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
  Kernel(Kernel&&) = default;
  Kernel& operator=(Kernel&&) = default;
  // The kernel `name` of kernels/<file>. Throws OpenClError.
  Kernel(ComputeDevice& device, const std::string& file, const std::string& name, const std::string& options = {});

  bool isBuilt() const { return !m_name.empty(); }

  // Binds all arguments in order and launches. Arguments: DeviceArray<T> (or Optional<T>) for a pointer to T, uint
  // or float by value.
  template <typename... Args>
  void launch(Queue& queue, Grid grid, const Args&... args) {
    checkCount(sizeof...(args));
    m_next = m_first;
    (bind(args), ...);
    if (queue.recorder()) {
      launchRecorded(queue, {m_file, m_name, m_options, grid, {argumentOf(args)...}, m_parameters});
    } else {
      queue.launch(m_kernel, m_name, grid);
    }
  }
  // Launches what a recorder saw, with its own arguments.
  void relaunch(Queue& queue, const Launch& launch);

 private:
  void launchRecorded(Queue& queue, const Launch& launch);
  void checkCount(size_t given);
  void checkType(const char* typeName, bool pointer) const;

  template <typename T>
  void bind(const DeviceArray<T>& array) {
    if (isBound(array.generation())) return;
    checkType(TypeName<T>::value, true);
    set(sizeof(cl_mem), array.capacity() ? static_cast<const void*>(&array.buffer()()) : nullptr, array.generation());
  }
  void bind(uint value) {
    const unsigned long identity = kUintMark | value;
    if (isBound(identity)) return;
    checkType("uint", false);
    set(sizeof value, &value, identity);
  }
  void bind(float value) {
    uint bits;
    std::memcpy(&bits, &value, sizeof bits);
    const unsigned long identity = kFloatMark | bits;
    if (isBound(identity)) return;
    checkType("float", false);
    set(sizeof value, &value, identity);
  }
  template <typename T>
  void bind(const Optional<T>& optional) {
    if (optional.array) {
      bind(*optional.array);
    } else {
      checkType(TypeName<T>::value, true);
      set(sizeof(cl_mem), nullptr, 0);
    }
  }
  void bind(const Argument& argument);

  template <typename T>
  static Argument argumentOf(const DeviceArray<T>& array) {
    Argument argument{Argument::Kind::Null, TypeName<T>::value, 0, {}, {}, 0, 0};
    if (array.capacity() == 0) return argument;
    argument.kind = Argument::Kind::Array;
    argument.buffer = array.buffer();
    argument.name = array.name();
    argument.elementBytes = sizeof(T);
    argument.bytes = array.capacity() * sizeof(T);
    return argument;
  }
  template <typename T>
  static Argument argumentOf(const Optional<T>& optional) {
    return optional.array ? argumentOf(*optional.array) : argumentOf(DeviceArray<T>());
  }
  static Argument argumentOf(uint value) { return {Argument::Kind::Uint, "uint", value, {}, {}, 0, 0}; }
  static Argument argumentOf(float value) {
    uint bits;
    std::memcpy(&bits, &value, sizeof bits);
    return {Argument::Kind::Float, "float", bits, {}, {}, 0, 0};
  }

  // What the arguments were bound to last: the generation of an array's memory, or the bits of a value with a mark that
  // no generation has. Binding the same again is left out, since drivers take their time over it.
  static constexpr unsigned long kUintMark = 1ul << 62, kFloatMark = 1ul << 63;
  struct Bound {
    bool known = false;
    unsigned long identity = 0;
  };
  bool isBound(unsigned long identity) {
    const bool bound = m_bound[m_next].known && m_bound[m_next].identity == identity;
    if (bound) ++m_next;
    return bound;
  }
  void set(size_t size, const void* value, unsigned long identity);

  std::string m_file, m_name, m_options;
  cl::Kernel m_kernel;
  std::vector<std::string> m_argumentTypes;  // empty if the driver does not tell
  std::vector<Bound> m_bound;
  std::vector<std::string> m_parameters;  // names of the arguments; only of debug builds
  unsigned m_argumentCount = 0, m_next = 0;
  unsigned m_first = 0;  // 1 if the kernel takes a DebugRecord before its arguments
  bool m_debug = false;  // built so
};

}  // namespace btgpu
