// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>
#include <optional>

#include "../engine.h"
#include "../opencl/compute_device.h"
#include "../step_results.h"
#include "capture.h"

namespace btgpu {

// Runs a capture's commands on arrays as they were before it, and returns the contents of all arrays afterwards.
// Kernels are built in the shape that was captured, whatever the device. Throws OpenClError, also where the kernels of
// this btgpu do not take the captured arguments.
std::vector<Bytes> runCapture(const Capture& capture, const std::shared_ptr<ComputeDevice>& device);

// What the capture is of, in whole lines.
std::string introduction(const Capture& capture);

// Runs the stage's reference on what was captured before the stage, and holds what was captured after it against that;
// returns the first value that is off by more than the stage's contract allows. Throws CaptureError where the stage has
// no reference, or the capture not all that it reads.
std::optional<StageDifference> checkOnHost(const Capture& capture);

// The whole of `btgpu replay --host`; needs no device. differentArrays: 1 where the capture breaks the contract.
ReplayReport replayOnHost(const std::string& file);

// The whole of `btgpu replay`. Throws CaptureError and OpenClError.
ReplayReport replayFile(const std::string& file, const ReplayOptions& options);

}  // namespace btgpu
