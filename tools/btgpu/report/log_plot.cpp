// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "log_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace btgpu {
namespace {

constexpr double kWidth = 640, kHeight = 400, kLeft = 70, kRight = 130, kTop = 40, kBottom = 50;
const char* const kColours[] = {"#1f5fbf", "#c2571a", "#2e8540", "#7a3fb0", "#555555", "#a08000"};

const char* colourOf(size_t line) { return kColours[line % (sizeof kColours / sizeof *kColours)]; }

// Whole decades that hold all values.
struct Decades {
  int from = 0, to = 1;
  double place(double value) const { return (std::log10(value) - from) / (to - from); }
};

Decades decadesOf(const std::vector<LogLine>& lines, double LogPoint::*axis) {
  double least = HUGE_VAL, largest = 0;
  for (const LogLine& line : lines) {
    for (const LogPoint& p : line.points) {
      if (!(p.*axis > 0)) continue;
      least = std::min(least, p.*axis);
      largest = std::max(largest, p.*axis);
    }
  }
  if (!(largest > 0)) return {};
  Decades d;
  d.from = static_cast<int>(std::floor(std::log10(least)));
  d.to = std::max(d.from + 1, static_cast<int>(std::ceil(std::log10(largest))));
  return d;
}

std::string label(int exponent) {
  return exponent >= 0 ? fmt::format("{:.0f}", std::pow(10, exponent)) : fmt::format("{:g}", std::pow(10, exponent));
}

double xAt(double place) { return kLeft + (kWidth - kLeft - kRight) * place; }
double yAt(double place) { return kHeight - kBottom - (kHeight - kTop - kBottom) * place; }

std::string text(double x, double y, const char* anchor, const std::string& what) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor, what);
}

std::string grid(const Decades& x, const Decades& y) {
  std::string svg;
  const auto line = [&svg](double x1, double y1, double x2, double y2) {
    svg += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#d0d0d0\"/>\n", x1, y1,
                       x2, y2);
  };
  for (int e = x.from; e <= x.to; ++e) {
    const double at = xAt(x.place(std::pow(10, e)));
    line(at, yAt(0), at, yAt(1));
    svg += text(at, yAt(0) + 18, "middle", label(e));
  }
  for (int e = y.from; e <= y.to; ++e) {
    const double at = yAt(y.place(std::pow(10, e)));
    line(xAt(0), at, xAt(1), at);
    svg += text(xAt(0) - 8, at + 4, "end", label(e));
  }
  return svg;
}

struct Place {
  double x = 0, y = 0;
};

// Where the line ends.
Place endOf(const LogLine& line, const Decades& x, const Decades& y) {
  Place end;
  for (const LogPoint& p : line.points) {
    if (p.x > 0 && p.y > 0) end = {xAt(x.place(p.x)), yAt(y.place(p.y))};
  }
  return end;
}

std::string drawn(const LogLine& line, const char* colour, const Decades& x, const Decades& y) {
  std::string svg, path;
  for (const LogPoint& p : line.points) {
    if (!(p.x > 0) || !(p.y > 0)) continue;
    const double atX = xAt(x.place(p.x)), atY = yAt(y.place(p.y));
    path += fmt::format("{:.1f},{:.1f} ", atX, atY);
    svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", atX, atY, colour);
  }
  if (path.empty()) return svg;
  return svg + fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>\n", path, colour);
}

// Names at the lines' ends, one below the other where these lie close together.
std::string names(const std::vector<LogLine>& lines, const Decades& x, const Decades& y) {
  constexpr double kLineHeight = 15;
  std::vector<size_t> order;
  for (size_t i = 0; i < lines.size(); ++i) {
    if (endOf(lines[i], x, y).x > 0) order.push_back(i);
  }
  std::sort(order.begin(), order.end(),
            [&](size_t a, size_t b) { return endOf(lines[a], x, y).y < endOf(lines[b], x, y).y; });
  std::string svg;
  double free = 0;
  for (const size_t i : order) {
    const Place end = endOf(lines[i], x, y);
    const double at = std::max(end.y + 4, free);
    free = at + kLineHeight;
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"{}\">{}</text>\n", end.x + 8, at, colourOf(i),
                       lines[i].name);
  }
  return svg;
}

}  // namespace

std::string logPlot(const std::string& title, const std::string& xName, const std::string& yName,
                    const std::vector<LogLine>& lines) {
  const Decades x = decadesOf(lines, &LogPoint::x), y = decadesOf(lines, &LogPoint::y);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
      kWidth, kHeight);
  svg += text(kLeft, 24, "start", title) + grid(x, y);
  svg += text(xAt(0.5), kHeight - 12, "middle", xName) + text(8, kTop - 8 + 4, "start", yName);
  for (size_t i = 0; i < lines.size(); ++i) svg += drawn(lines[i], colourOf(i), x, y);
  return svg + names(lines, x, y) + "</svg>\n";
}

}  // namespace btgpu
