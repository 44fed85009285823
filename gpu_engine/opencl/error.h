// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <stdexcept>
#include <string>

namespace btgpu {

// What went wrong on the way to or on the device: one line with the symbolic code, the call and the kernel or
// file. Stays inside the engine, which turns it into a Status (engine.h).
class OpenClError : public std::runtime_error {
 public:
  enum class Kind { General, NoDevice, OutOfMemory, Build };

  OpenClError(Kind kind, const std::string& message) : std::runtime_error(message), m_kind(kind) {}
  Kind kind() const { return m_kind; }

 private:
  Kind m_kind;
};

// "CL_OUT_OF_RESOURCES (-5)"
std::string errorName(int code);

// The error for a failed OpenCL call; `where` names the kernel, buffer or file it was about.
OpenClError makeOpenClError(int code, const std::string& call, const std::string& where);

}  // namespace btgpu
