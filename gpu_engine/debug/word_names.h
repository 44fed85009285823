// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>

namespace btgpu {

// What four bytes of an array's element are.
struct WordName {
  std::string field;  // "points[1].localPointA[3]"; empty in an element that has no fields
  bool isFloat = false;
};

// The word at `offset` bytes of an element of this type, as kernels/shared has it; without a name if it is not known.
WordName nameOfWord(const std::string& type, size_t elementBytes, size_t offset);

}  // namespace btgpu
