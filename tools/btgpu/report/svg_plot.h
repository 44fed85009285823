// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>
#include <vector>

namespace btgpu::tool {

struct PlotLine {
  std::string name;      // as the legend has it
  std::string cssClass;  // gives its colour
  const std::vector<double>* values;
};

// One quantity over the steps of a run.
struct Plot {
  std::string id, title, unit, note;  // note: one sentence on what it is
  std::vector<PlotLine> lines;        // the first is drawn first
  bool fromZero = true;               // the axis starts at 0; else at the least value
  bool cutPeaks = false;              // single peaks may leave the plot, the first value does
};

// An HTML figure: title, legend with the values at the end, inline SVG. `timeStep` in seconds.
std::string plotFigure(const Plot& plot, double timeStep);

std::string escapeHtml(const std::string& text);
// Four digits, powers of ten written out; "not finite" where it isn't.
std::string htmlNumber(double value);

}  // namespace btgpu::tool
