// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "capture.h"

namespace btgpu {

// How an array came out, against what was captured.
struct ArrayDifference {
  std::uint64_t elements = 0, different = 0;  // of the array; those of them that differ in any bit
  // Over all floats in elements that differ; a NaN that is none on the other side is farther than any number.
  bool anyFloat = false;
  std::uint64_t mostUlps = 0;
  double mostAbsolute = 0;
  // The first word that differs.
  std::uint64_t firstElement = 0;
  std::string firstField, firstExpected, firstFound;
};

// found: as many bytes as were captured.
ArrayDifference compareArray(const CapturedArray& captured, const Bytes& found);

// One line: "poses: 3 of 9 elements differ, by up to 2 ulps (1.2e-07); first: [4].position[1] is 1 and was 1.0000001".
std::string describe(const CapturedArray& captured, const ArrayDifference& difference);

}  // namespace btgpu
