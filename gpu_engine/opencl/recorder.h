// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "../../kernels/shared/types.h"
#include "cl.h"
#include "compute_device.h"

namespace btgpu {

class Queue;

// A kernel's argument without its C++ type: as recorders see it, and as what they recorded is launched again.
struct Argument {
  enum class Kind { Array, Null, Uint, Float };
  Kind kind = Kind::Null;
  std::string type;  // as kernels spell it: of the value, or of an array's element
  uint bits = 0;     // of a value
  // Of an array; all of its memory, not only what is in use.
  cl::Buffer buffer;
  std::string name;
  size_t elementBytes = 0, bytes = 0;
};

// An array by its name, and how much of its memory it uses.
struct ArrayInUse {
  cl::Buffer buffer;
  std::string name;
  size_t bytes = 0;
};

// What a stage's reference needs to run on its own: all arrays of the world, which of them it reads beside those that
// the stage's kernels get, and stageNumbers().
struct StageInputs {
  std::vector<ArrayInUse> arrays;
  std::vector<std::string> alsoRead;
  std::vector<std::uint64_t> numbers;
};

struct Launch {
  std::string file, name, options;  // what the kernel was made of (Kernel's constructor)
  Grid grid;
  std::vector<Argument> arguments;
  std::vector<std::string> parameters;  // their names in the kernel's source; only of debug builds that can tell
};

// What assertions of the kernels and guard zones of arrays found wrong.
struct Failures {
  unsigned long count = 0;
  std::string first;  // in one line
};

// Told of all that a queue is given, before or after it is. For debugging (gpu_engine/debug): normally there is none.
class Recorder {
 public:
  virtual ~Recorder() = default;
  // step: counts from 0. A step that is repeated, or thrown away and launched anew, is entered again.
  virtual void enterStep(Queue&, long /*step*/) {}
  virtual void leaveStep(Queue&) {}
  virtual void enterStage(Queue&, const char* /*stage*/) {}
  // Around a stage of the pipeline, which enters itself in between if it runs on the device. What is offered takes time
  // to make.
  virtual void beforeStage(Queue&, const char* /*stage*/, const std::function<StageInputs()>&) {}
  virtual void afterStage(Queue&, const std::function<std::vector<ArrayInUse>()>&) {}
  // A new array's memory, which nothing has been written to.
  virtual void afterAllocation(Queue&, const cl::Buffer&, size_t /*bytes*/, const std::string& /*array*/) {}
  virtual void beforeLaunch(Queue&, const Launch&) {}
  virtual void afterLaunch(Queue&) {}
  virtual void beforeWrite(Queue&, const cl::Buffer& /*to*/, size_t /*offset*/, size_t /*bytes*/,
                           const void* /*from*/) {}
  virtual void beforeCopy(Queue&, const cl::Buffer& /*from*/, const cl::Buffer& /*to*/, size_t /*fromOffset*/,
                          size_t /*toOffset*/, size_t /*bytes*/) {}
  // The DebugRecord of a launch, for kernels of a debug build; null without one.
  virtual const cl::Buffer* checks() const { return nullptr; }
  // Failures since the last call.
  virtual Failures takeFailures(Queue&) { return {}; }
};

}  // namespace btgpu
