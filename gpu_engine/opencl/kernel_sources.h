// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <map>
#include <string>

namespace btgpu {

// Text of every file under kernels/, by its path from the repository's root. Generated at build time.
const std::map<std::string, const char*>& embeddedKernels();

// Source of kernels/<name> with all its includes put in place and #line directives, so that a build error names
// the real file. With BTGPU_KERNEL_DIR set, files come from that checkout instead (development).
// Throws OpenClError if a file is missing.
std::string expandKernelSource(const std::string& name);

// A build log in which lines of the expanded source ("<kernel>:148:", as NVIDIA's compiler counts, which does not
// heed #line) are named by file and line.
std::string nameLines(const std::string& log, const std::string& expandedSource);

}  // namespace btgpu
