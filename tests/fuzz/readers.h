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

inline void requireRange(const Capture& capture, std::uint32_t array, std::uint64_t offset, std::uint64_t bytes) {
  require(array < capture.arrays.size());
  const std::uint64_t size = capture.arrays[array].before.size();
  require(bytes <= size && offset <= size - bytes);
}

inline void requireWhole(const Capture& capture, const CapturedCommand& command) {
  if (const auto* launch = std::get_if<CapturedLaunch>(&command)) {
    require(launch->local > 0 && launch->global % launch->local == 0);
    for (const CapturedArgument& a : launch->arguments) {
      if (a.kind == CapturedArgument::Kind::Array) requireRange(capture, a.value, 0, 1);
    }
  } else if (const auto* write = std::get_if<CapturedWrite>(&command)) {
    requireRange(capture, write->array, write->offset, write->data.size());
  } else {
    const auto& copy = std::get<CapturedCopy>(command);
    require(copy.from != copy.to);
    requireRange(capture, copy.from, copy.fromOffset, copy.bytes);
    requireRange(capture, copy.to, copy.toOffset, copy.bytes);
  }
}

// A capture that is read is the one that the file tells of, whole, and its arrays can be compared.
inline bool tryCapture(const Bytes& bytes) {
  Capture capture;
  try {
    capture = decodeCapture(bytes);
  } catch (const CaptureError&) { return false; }
  require(encodeCapture(capture) == bytes);
  for (const CapturedCommand& command : capture.commands) requireWhole(capture, command);
  for (const CapturedView& view : capture.views) {
    if (view.before != CapturedView::kNone) requireRange(capture, view.before, 0, view.bytesBefore);
    if (view.after != CapturedView::kNone) requireRange(capture, view.after, 0, view.bytesAfter);
  }
  for (const CapturedArray& array : capture.arrays) {
    require(array.after.empty() || array.after.size() == array.before.size());
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
  overwrite<std::uint64_t>(bytes, 8, bytes[8] == 2 ? 2 : 1);
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
