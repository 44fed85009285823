// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <typeinfo>

namespace btgpu {

// True if the object is exactly of one of these classes. One derived from them may override anything.
template <typename... Classes, typename T>
bool isExactly(const T& object) {
  return ((typeid(object) == typeid(Classes)) || ...);
}

}  // namespace btgpu
