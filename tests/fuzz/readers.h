// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the fuzzers and readers_test.cpp feed with bytes of all kinds. Each aborts if a file is believed that makes no
// sense, and returns whether it was believed.
#pragma once

#include <cstdlib>
#include <cstring>

#include "gpu_engine/debug/array_difference.h"
#include "gpu_engine/debug/capture_bytes.h"
#include "gpu_engine/debug/capture_file.h"
#include "gpu_engine/opencl/program_entry.h"

namespace btgpu::fuzz {

inline void require(bool holds) {
  if (!holds) std::abort();
}

template <typename T>
void overwrite(Bytes& bytes, size_t at, T value) {
  if (at + sizeof value <= bytes.size()) std::memcpy(bytes.data() + at, &value, sizeof value);
}

// A capture that is read is the one that the file tells of, and its arrays can be compared.
inline bool tryCapture(const Bytes& bytes) {
  Capture capture;
  try {
    capture = decodeCapture(bytes);
  } catch (const CaptureError&) { return false; }
  require(encodeCapture(capture) == bytes);
  for (const CapturedArray& array : capture.arrays) {
    require(compareArray(array, array.expected()).different == 0);
    const ArrayDifference difference = compareArray(array, array.before);
    require(!describe(array, difference).empty());
  }
  return true;
}

// The same with a header that fits, without which hardly any damage gets past the checksum.
inline bool tryMendedCapture(Bytes bytes) {
  constexpr size_t kHeader = 32;
  if (bytes.size() < kHeader) return tryCapture(bytes);
  std::memcpy(bytes.data(), "btgpucap", 8);
  overwrite<std::uint64_t>(bytes, 8, 1);
  overwrite<std::uint64_t>(bytes, 16, bytes.size());
  overwrite<std::uint64_t>(bytes, 24, checksumOf(bytes.data() + kHeader, bytes.size() - kHeader));
  return tryCapture(bytes);
}

inline const std::string kEntryKey = "a key";

inline bool tryProgramEntry(const Bytes& bytes) {
  const auto binary = decodeProgramEntry(bytes, kEntryKey);
  if (binary) require(encodeProgramEntry(kEntryKey, *binary) == bytes);
  return binary.has_value();
}

// With the magic number, the key's size and the binary's checksum as they should be.
inline bool tryMendedProgramEntry(Bytes bytes) {
  const size_t start = 32 + kEntryKey.size();
  if (bytes.size() < start) return tryProgramEntry(bytes);
  std::memcpy(bytes.data(), "btgpupc1", 8);
  overwrite<std::uint64_t>(bytes, 8, kEntryKey.size());
  overwrite<std::uint64_t>(bytes, 24, checksumOf(bytes.data() + start, bytes.size() - start));
  return tryProgramEntry(bytes);
}

}  // namespace btgpu::fuzz
