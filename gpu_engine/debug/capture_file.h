// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>

#include "capture.h"

namespace btgpu {

// The bytes of a capture file, and back. decodeCapture checks everything before it believes it; what it returns is
// consistent: indices and ranges lie in their arrays, grids are whole. It throws CaptureError.
Bytes encodeCapture(const Capture& capture);
Bytes encodeCommands(const Capture& capture);  // that part of it
Capture decodeCapture(const Bytes& bytes);

// The same with a file. Both throw CaptureError.
void writeCapture(const std::string& path, const Capture& capture);
Capture readCapture(const std::string& path);

}  // namespace btgpu
