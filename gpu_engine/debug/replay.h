// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>

#include "../engine.h"
#include "../opencl/compute_device.h"
#include "capture.h"

namespace btgpu {

// Runs a capture's commands on arrays as they were before it, and returns the contents of all arrays afterwards.
// Kernels are built in the shape that was captured, whatever the device. Throws OpenClError, also where the kernels of
// this btgpu do not take the captured arguments.
std::vector<Bytes> runCapture(const Capture& capture, const std::shared_ptr<ComputeDevice>& device);

// The whole of `btgpu replay`. Throws CaptureError and OpenClError.
ReplayReport replayFile(const std::string& file, const std::string& device);

}  // namespace btgpu
