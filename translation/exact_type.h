// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <typeinfo>

namespace btgpu {

// True if the object is exactly of one of these classes. One derived from them may override anything.
template <typename... Classes, typename T>
bool isExactly(const T& object) {
  const std::type_info& type = typeid(object);
  // Mostly there is one type_info a class. Where libraries have their own the names are compared, which takes longer.
  return ((&type == &typeid(Classes)) || ...) || ((type == typeid(Classes)) || ...);
}

}  // namespace btgpu
