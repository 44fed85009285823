// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>
#include <vector>

namespace btgpu {

struct LogPoint {
  double x, y;
};
struct LogLine {
  std::string name;
  std::vector<LogPoint> points;  // those that are not positive have no place on the plot
};

// An SVG file: both axes logarithmic, the lines' names at their ends. On a ground of its own, so that it can be read on
// light and dark pages.
std::string logPlot(const std::string& title, const std::string& xName, const std::string& yName,
                    const std::vector<LogLine>& lines);

}  // namespace btgpu
