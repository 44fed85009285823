// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Makes OpenCL calls fail when a test wants it. A test executable that links this file's definitions and
// exports its symbols (ENABLE_EXPORTS) comes before libOpenCL when the engine's plugin looks up the
// functions.
#pragma once

#include <string>
#include <vector>

namespace btgpu::test {

// How many calls succeed before one fails; it goes on failing until it is reset. Negative: all succeed.
struct FailingOpenCl {
  static void reset();
  // Of all calls that can fail for reasons of the device: after so many, `count` fail, or all from there on.
  static void failCallsAfter(int calls, int count, int code);
  static void failAllAfter(int calls, int code);
  static void failBuffersAfter(int calls, int code);
  static void failBuffersLargerThan(unsigned long bytes, int code);
  static void failLaunchesAfter(int calls, int code);
  static void failOneLaunchAfter(int calls, int code);  // those after it succeed again
  static const std::vector<std::string>& calls();       // names of all since reset()
  static int buffers();                                 // made or refused since reset()
  static int launches();                                // likewise
  static int failures();
};

}  // namespace btgpu::test
