// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A headless Chromium, for tests of HTML pages.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace btgpu::test {

enum class Scheme { Light, Dark };

struct Screenshot {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
  std::array<int, 3> at(int x, int y) const;
};

// Path of the browser. Throws std::runtime_error with the cure if there is none.
std::string browserPath();

// The page's document after its scripts have run, in a window of that width.
std::string dumpDom(const std::string& page, int width, Scheme scheme = Scheme::Light);

Screenshot takeScreenshot(const std::string& page, int width, int height, Scheme scheme = Scheme::Light);

}  // namespace btgpu::test
