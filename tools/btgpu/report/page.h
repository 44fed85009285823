// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A comparison as one HTML page that needs nothing else: styles, plots (SVG) and pictures (PNG) are inside; no script.
#pragma once

#include <string>

namespace btgpu::tool {

struct CompareResult;

std::string reportPage(const CompareResult& result, const std::string& version);

}  // namespace btgpu::tool
