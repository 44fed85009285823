// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace btgpu::tool {
namespace {

// In units of the SVG, which are pixels where the page is wide.
constexpr double kWidth = 480, kHeight = 240, kLeft = 52, kRight = 12, kTop = 20, kBottom = 34;
constexpr size_t kMostPoints = 2000;  // of a line; with more steps, least and largest value of every few

struct Axis {
  double from = 0, to = 1, spacing = 0.5;
  double place(double value) const { return (value - from) / (to - from); }
};

// Spacing of 1, 2 or 5 times a power of ten for about `count` intervals.
double tickSpacing(double width, int count) {
  const double wanted = width / count;
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  return wanted / power <= 1 ? power : wanted / power <= 2 ? 2 * power : wanted / power <= 5 ? 5 * power : 10 * power;
}

Axis roundAxis(double from, double to) {
  if (!(to - from > 1e-9 * std::max(std::fabs(from), std::fabs(to)))) {
    const double room = std::max(std::fabs(to) * 0.1, 1e-12);
    to += room;
    from = from == 0 ? 0 : from - room;
  }
  Axis axis;
  axis.spacing = tickSpacing(to - from, 4);
  axis.from = axis.spacing * std::floor(from / axis.spacing * (1 + 1e-12));
  axis.to = axis.spacing * std::ceil(to / axis.spacing * (1 - 1e-12));
  return axis;
}

struct Values {
  double least = HUGE_VAL, largest = -HUGE_VAL, usual = -HUGE_VAL;  // usual: 99 of 100 are below
  size_t notFinite = 0;
};

Values surveyOf(const Plot& plot) {
  Values found;
  for (const PlotLine& line : plot.lines) {
    std::vector<double> finite;
    for (size_t i = 0; i < line.values->size(); ++i) {
      const double v = (*line.values)[i];
      if (!std::isfinite(v)) {
        ++found.notFinite;
      } else {
        found.largest = std::max(found.largest, v);
        found.least = std::min(found.least, v);
        if (i > 0 || line.values->size() == 1) finite.push_back(v);
      }
    }
    if (finite.empty()) continue;
    const auto at = finite.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(finite.size() - 1));
    std::nth_element(finite.begin(), at, finite.end());
    found.usual = std::max(found.usual, *at);
  }
  return found;
}

bool cuts(const Plot& plot, const Values& v) { return plot.cutPeaks && v.usual > 0 && v.largest > 2 * v.usual; }

Axis valueAxis(const Plot& plot, const Values& v) {
  if (!(v.least <= v.largest)) return {};
  const double to = cuts(plot, v) ? 1.25 * v.usual : v.largest;
  return plot.fromZero ? roundAxis(std::min(0.0, v.least), std::max(0.0, to)) : roundAxis(v.least, to);
}

std::string number(double value, double spacing) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(spacing) - 1e-9)), 0, 12);
  const std::string text = fmt::format("{:.{}f}", std::fabs(value) < spacing * 1e-6 ? 0.0 : value, decimals);
  return text[0] == '-' ? "\u2212" + text.substr(1) : text;
}

std::string superscript(int exponent) {
  static const char* const kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = exponent < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(exponent))) text += kDigits[digit - '0'];
  return text;
}

// Power of a thousand that the tick labels are divided by.
int exponentOf(const Axis& axis) {
  const double largest = std::max(std::fabs(axis.from), std::fabs(axis.to));
  if (!(largest > 0) || (largest >= 0.01 && largest < 1e5)) return 0;
  return 3 * static_cast<int>(std::floor(std::log10(largest) / 3));
}

double xAt(double place) { return kLeft + (kWidth - kLeft - kRight) * place; }
double yAt(double place) { return kHeight - kBottom - (kHeight - kTop - kBottom) * place; }

std::string valueGrid(const Axis& axis) {
  const int exponent = exponentOf(axis);
  const double scale = std::pow(10, exponent);
  std::string svg;
  for (int k = 0; k <= static_cast<int>(std::lround((axis.to - axis.from) / axis.spacing)); ++k) {
    const double value = axis.from + k * axis.spacing, y = yAt(axis.place(value));
    svg += fmt::format("<line class=\"grid\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>", kLeft, kWidth - kRight,
                       y, y);
    svg += fmt::format("<text class=\"tick\" text-anchor=\"end\" x=\"{}\" y=\"{:.1f}\">{}</text>", kLeft - 7, y + 4,
                       number(value / scale, axis.spacing / scale));
  }
  if (exponent) { svg += fmt::format("<text class=\"tick\" x=\"4\" y=\"11\">×10{}</text>", superscript(exponent)); }
  return svg;
}

std::string timeGrid(const Axis& axis) {
  std::string svg;
  const double y = yAt(0);
  for (int k = 0; axis.spacing * k <= axis.to * (1 + 1e-9); ++k) {
    const double x = xAt(axis.place(axis.spacing * k));
    svg += fmt::format("<line class=\"axis\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{}\" y2=\"{}\"/>", x, x, y, y + 4);
    svg += fmt::format("<text class=\"tick\" text-anchor=\"middle\" x=\"{:.1f}\" y=\"{}\">{}</text>", x, y + 17,
                       number(axis.spacing * k, axis.spacing));
  }
  svg += fmt::format("<line class=\"axis\" x1=\"{}\" x2=\"{}\" y1=\"{}\" y2=\"{}\"/>", kLeft, kWidth - kRight, y, y);
  svg += fmt::format("<text class=\"tick\" text-anchor=\"end\" x=\"{}\" y=\"{}\">time, s</text>", kWidth - kRight,
                     kHeight - 3);
  return svg;
}

// Indices of the values to draw.
std::vector<size_t> pointsOf(const std::vector<double>& values) {
  std::vector<size_t> points;
  const size_t every = values.size() <= kMostPoints ? 1 : values.size() / (kMostPoints / 2) + 1;
  for (size_t from = 0; from < values.size(); from += every) {
    size_t least = from, largest = from;
    for (size_t i = from; i < std::min(from + every, values.size()); ++i) {
      if (values[i] < values[least] || !std::isfinite(values[i])) least = i;
      if (values[i] > values[largest]) largest = i;
    }
    points.push_back(std::min(least, largest));
    if (least != largest) points.push_back(std::max(least, largest));
  }
  return points;
}

std::string drawLine(const PlotLine& line, const Axis& time, const Axis& axis, double timeStep) {
  std::string svg, piece;
  int count = 0;
  double lastX = 0, lastY = 0;
  const auto finish = [&] {
    if (count > 1) svg += fmt::format("<polyline class=\"line {}\" points=\"{}\"/>", line.cssClass, piece);
    if (count == 1) {
      svg += fmt::format("<circle class=\"dot {}\" cx=\"{:.2f}\" cy=\"{:.2f}\"/>", line.cssClass, lastX, lastY);
    }
    piece.clear();
    count = 0;
  };
  for (const size_t i : pointsOf(*line.values)) {
    const double v = (*line.values)[i];
    if (!std::isfinite(v)) {
      finish();
      continue;
    }
    lastX = xAt(time.place(static_cast<double>(i + 1) * timeStep));
    // Far outside is as good as just outside, and no viewer's coordinates overflow.
    lastY = yAt(std::clamp(axis.place(v), -2.0, 3.0));
    piece += fmt::format("{}{:.2f},{:.2f}", count ? " " : "", lastX, lastY);
    ++count;
  }
  finish();
  return svg;
}

std::string legendOf(const Plot& plot) {
  std::string html = "<p class=\"legend\">";
  for (auto line = plot.lines.rbegin(); line != plot.lines.rend(); ++line) {
    html += fmt::format("<span><i class=\"key {}\"></i>{} <b>{}</b></span>", line->cssClass, line->name,
                        line->values->empty() ? "–" : htmlNumber(line->values->back()));
  }
  return html + "</p>";
}

}  // namespace

std::string escapeHtml(const std::string& text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      default:
        // Control characters have no place in HTML.
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
          html += "\uFFFD";
        } else {
          html += c;
        }
    }
  }
  return html;
}

std::string htmlNumber(double value) {
  if (!std::isfinite(value)) return "not finite";
  const bool integral = value == std::round(value) && std::fabs(value) < 1e7;
  const bool plain = integral || (std::fabs(value) >= 1000 && std::fabs(value) < 1e6);
  std::string text = plain ? fmt::format("{:.0f}", value) : fmt::format("{:.4g}", value);
  if (const size_t e = text.find('e'); e != std::string::npos) {
    const int exponent = std::stoi(text.substr(e + 1));
    text = fmt::format("{}×10<sup>{}{}</sup>", text.substr(0, e), exponent < 0 ? "−" : "", std::abs(exponent));
  }
  return text[0] == '-' ? "−" + text.substr(1) : text;
}

std::string plotFigure(const Plot& plot, double timeStep) {
  size_t steps = 0;
  for (const PlotLine& line : plot.lines) steps = std::max(steps, line.values->size());
  const Values values = surveyOf(plot);
  const Axis axis = valueAxis(plot, values);
  Axis time;
  time.to = std::max<double>(1, static_cast<double>(steps)) * timeStep;
  time.spacing = tickSpacing(time.to, 6);

  std::string html =
      fmt::format("<figure class=\"plot\" id=\"{0}\"><figcaption><h3>{1} <small>{2}</small></h3>{3}</figcaption>",
                  plot.id, plot.title, plot.unit, legendOf(plot));
  html += fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{} over time\" data-steps=\"{}\">", kWidth,
                      kHeight, plot.title, steps);
  html += fmt::format("<clipPath id=\"clip-{}\"><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/></clipPath>",
                      plot.id, kLeft - 4, kTop - 4, kWidth - kLeft - kRight + 8, kHeight - kTop - kBottom + 8);
  html += valueGrid(axis) + timeGrid(time);
  html += fmt::format("<g clip-path=\"url(#clip-{})\">", plot.id);
  for (const PlotLine& line : plot.lines) html += drawLine(line, time, axis, timeStep);
  html += "</g></svg><p class=\"note\">" + plot.note;
  if (cuts(plot, values))
    html += fmt::format(" Peaks, up to {} {}, are cut off.", htmlNumber(values.largest), plot.unit);
  if (values.notFinite)
    html += fmt::format(" <strong>{} values are not finite</strong> and left out.", values.notFinite);
  return html + "</p></figure>\n";
}

}  // namespace btgpu::tool
