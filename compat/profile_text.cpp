// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "profile_text.h"

#include <fmt/format.h>

#include <algorithm>

namespace btgpu {
namespace {

constexpr int kHost = 1, kDevice = 2;  // processes of the trace: Perfetto shows each as a group of rows

// Names come from the application too.
std::string quoted(const std::string& text) {
  std::string json = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') json += '\\';
    if (byte < 0x20) {
      json += fmt::format("\\u{:04x}", byte);
    } else {
      json += byte < 0x7f ? c : '?';  // what is no ASCII may be no UTF-8 either
    }
  }
  return json + "\"";
}

std::string csvField(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? std::string("\"\"") : std::string(1, c);
  return field + "\"";
}

double microseconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-3; }
double milliseconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }
double shareOf(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

void writeName(std::FILE* file, const char* what, int process, int thread, const std::string& name) {
  fmt::print(file, "{{\"ph\":\"M\",\"name\":\"{}\",\"pid\":{},\"tid\":{},\"args\":{{\"name\":{}}}}},\n", what, process,
             thread, quoted(name));
}

void writeRows(std::FILE* file, const ProfileData& data) {
  writeName(file, "process_name", kHost, 0, "host");
  for (int t = 0; t < data.threads; ++t) writeName(file, "thread_name", kHost, t, fmt::format("thread {}", t + 1));
  if (data.devices.empty()) return;
  writeName(file, "process_name", kDevice, 0, "device");
  for (std::size_t d = 0; d < data.devices.size(); ++d) {
    const std::string& name = data.devices[d].name;
    writeName(file, "thread_name", kDevice, static_cast<int>(d),
              fmt::format("world {}: {}", d + 1, name.empty() ? "no device" : name));
  }
}

// Path of names from the outermost zone.
std::string pathOf(const ProfileData& data, int node) {
  const ProfileData::Node& n = data.nodes[static_cast<std::size_t>(node)];
  return (n.parent < 0 ? std::string() : pathOf(data, n.parent) + "/") + data.name(n.name);
}

}  // namespace

void writeTrace(std::FILE* file, const ProfileData& data) {
  std::int64_t accuracy = 0;
  for (const auto& device : data.devices) accuracy = std::max(accuracy, device.accuracy);
  fmt::print(file,
             "{{\"displayTimeUnit\":\"ms\",\n\"otherData\":{{\"steps\":{},\"deviceClockAccuracyUs\":{:.3f},"
             "\"lostZones\":{},\"lostLaunches\":{}}},\n\"traceEvents\":[\n",
             data.steps, microseconds(accuracy), data.lostEvents, data.lostSlices);
  writeRows(file, data);
  for (const auto& e : data.events) {
    fmt::print(file,
               "{{\"ph\":\"X\",\"cat\":\"host\",\"name\":{},\"pid\":{},\"tid\":{},\"ts\":{:.3f},\"dur\":{:.3f}}},\n",
               quoted(data.name(data.nodes[static_cast<std::size_t>(e.node)].name)), kHost, e.thread,
               microseconds(e.start), microseconds(e.duration));
  }
  for (const auto& s : data.slices) {
    const std::string stage = data.name(s.stage), kernel = data.name(s.kernel);
    fmt::print(file,
               "{{\"ph\":\"X\",\"cat\":\"device\",\"name\":{},\"pid\":{},\"tid\":{},\"ts\":{:.3f},\"dur\":{:.3f},"
               "\"args\":{{\"stage\":{},\"kernel\":{},\"queuedUs\":{:.3f},\"submittedUs\":{:.3f}}}}},\n",
               quoted(fmt::format("{} {}", stage, kernel)), kDevice, s.device, microseconds(s.started),
               microseconds(s.ended - s.started), quoted(stage), quoted(kernel), microseconds(s.queued),
               microseconds(s.submitted));
  }
  // The one without a comma.
  fmt::print(file, "{{\"ph\":\"M\",\"name\":\"trace_end\",\"pid\":{},\"tid\":0,\"args\":{{}}}}\n]}}\n", kHost);
}

std::string toCsv(const ProfileData& data) {
  const auto perStep = [&](double ms) { return data.steps > 0 ? ms / static_cast<double>(data.steps) : 0.0; };
  std::string text = "row,path,name,depth,calls,totalMs,msPerStep,selfMs,share\n";
  const std::int64_t host = hostTime(data), device = deviceTime(data);
  for (const int i : treeOrder(data)) {
    const auto& n = data.nodes[static_cast<std::size_t>(i)];
    text += fmt::format("host,{},{},{},{},{:.6f},{:.6f},{:.6f},{:.6f}\n", csvField(pathOf(data, i)),
                        csvField(data.name(n.name)), n.depth, n.calls, milliseconds(n.total),
                        perStep(milliseconds(n.total)), milliseconds(n.total - n.inChildren), shareOf(n.total, host));
  }
  for (const auto& l : data.launches) {
    const std::string stage = data.name(l.stage), kernel = data.name(l.kernel);
    text += fmt::format("device,{},{},1,{},{:.6f},{:.6f},{:.6f},{:.6f}\n",
                        csvField(fmt::format("{}/{}", stage, kernel)), csvField(kernel), l.count, milliseconds(l.total),
                        perStep(milliseconds(l.total)), milliseconds(l.total), shareOf(l.total, device));
  }
  return text;
}

std::vector<int> treeOrder(const ProfileData& data) {
  std::vector<std::vector<int>> children(data.nodes.size() + 1);
  for (std::size_t i = 0; i < data.nodes.size(); ++i) {
    const int parent = data.nodes[i].parent;
    children[static_cast<std::size_t>(parent) + 1].push_back(static_cast<int>(i));
  }
  std::vector<int> order, open(children[0].rbegin(), children[0].rend());
  while (!open.empty()) {
    const int node = open.back();
    open.pop_back();
    order.push_back(node);
    const auto& inside = children[static_cast<std::size_t>(node) + 1];
    open.insert(open.end(), inside.rbegin(), inside.rend());
  }
  return order;
}

std::int64_t hostTime(const ProfileData& data) {
  std::int64_t sum = 0;
  for (const auto& n : data.nodes) sum += n.parent < 0 ? n.total : 0;
  return sum;
}

std::int64_t deviceTime(const ProfileData& data) {
  std::int64_t sum = 0;
  for (const auto& l : data.launches) sum += l.total;
  return sum;
}

}  // namespace btgpu
