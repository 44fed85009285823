// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>

#include "../opencl/recorder.h"

namespace btgpu {

// The recorder of an engine's queue that the environment asks for, or null:
//   BTGPU_DEBUG_KERNELS                 checks kernels; device.debugKernels() says so (docs/debugging.md)
//   BTGPU_CAPTURE, BTGPU_CAPTURE_FILE   captures stages (docs/capture.md)
//   BTGPU_STAGE_HASHES, _STEP           writes a hash of each stage of each step, or of one, to the file that it names
//   BTGPU_WATCH, BTGPU_WATCH_FILE       logs every launch, and names the kernel that hangs
// Throws OpenClError if one of them makes no sense.
std::unique_ptr<Recorder> recorderFromEnvironment(const ComputeDevice& device);

}  // namespace btgpu
