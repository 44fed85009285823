// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// One stage of one step, complete: what its kernels were given and what they made of it (docs/capture.md).
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

namespace btgpu {

using Bytes = std::vector<unsigned char>;

// A piece of device memory that the stage touched, all of it. `after` is empty if the stage left it as it was.
struct CapturedArray {
  std::string name, type;  // type: of the elements, as kernels spell it; empty if no kernel ever got the array
  std::uint32_t elementBytes = 1;
  Bytes before, after;

  const Bytes& expected() const { return after.empty() ? before : after; }
};

// What one argument was. value: index of an array, or the bits of a uint or float.
struct CapturedArgument {
  enum class Kind : std::uint8_t { Array = 0, Null = 1, Uint = 2, Float = 3 };
  Kind kind = Kind::Null;
  std::uint32_t value = 0;
  std::string type;  // of a null pointer
};

struct CapturedLaunch {
  std::string file, name, options;
  std::uint64_t global = 1, local = 1;
  std::vector<CapturedArgument> arguments;
};

struct CapturedWrite {
  std::uint32_t array = 0;
  std::uint64_t offset = 0;
  Bytes data;
};

struct CapturedCopy {
  std::uint32_t from = 0, to = 0;
  std::uint64_t fromOffset = 0, toOffset = 0, bytes = 0;
};

// Where an array of the world lay as the stage began, and as it ended: indices of arrays.
struct CapturedView {
  static constexpr std::uint32_t kNone = 0xffffffff;
  std::string array;
  std::uint32_t before = kNone, after = kNone;    // kNone: not captured
  std::uint64_t bytesBefore = 0, bytesAfter = 0;  // in use; 0 for an array that is not there
};

using CapturedCommand = std::variant<CapturedLaunch, CapturedWrite, CapturedCopy>;

struct Capture {
  std::string stage;
  std::uint64_t step = 0;
  std::string version;         // of btgpu
  std::string device, driver;  // as OpenCL names them
  bool cpuShape = false;       // of the kernels
  std::string buildOptions;    // BTGPU_BUILD_OPTIONS at the time
  std::vector<CapturedArray> arrays;
  std::vector<CapturedCommand> commands;
  // For the stage's reference; both empty where a stage was captured outside of a step.
  std::vector<CapturedView> views;
  std::vector<std::uint64_t> numbers;  // stageNumbers()
};

// A file that is no capture, damaged, or of another version: one line that begins with the file's name.
class CaptureError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace btgpu
