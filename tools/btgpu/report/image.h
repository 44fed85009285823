// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace btgpu::tool {

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;  // rows from the top, alpha not multiplied in
};

std::string encodePng(const Image& image);
std::string base64(const std::string& bytes);

}  // namespace btgpu::tool
