// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "hang_watch.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>

#include "../opencl/error.h"
#include "../opencl/queue.h"

namespace btgpu {
namespace {

constexpr double kDefaultLimit = 10, kMostLimit = 1e6;  // seconds

std::string timeOfDay() {
  const auto now = std::chrono::system_clock::now();
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count() % 1000;
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03d}Z", fmt::gmtime(std::chrono::system_clock::to_time_t(now)), ms);
}

double milliseconds(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

void finish(Queue& queue, const std::string& what) {
  try {
    queue.raw().finish();  // past the queue's own counter of waits
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), what); }
}

double parseLimit(const std::string& text) {
  char* end = nullptr;
  const double seconds = text == "1" ? kDefaultLimit : std::strtod(text.c_str(), &end);
  if ((end && *end != '\0') || !(seconds > 0 && seconds <= kMostLimit)) {
    throw OpenClError(OpenClError::Kind::General,
                      fmt::format("BTGPU_WATCH is '{}': give 1, or the seconds that a kernel may take", text));
  }
  return seconds;
}

}  // namespace

HangWatch::HangWatch(double limitSeconds, const std::string& path, const std::string& device)
    : m_limit(limitSeconds), m_file(::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
  if (m_file < 0) {
    throw OpenClError(OpenClError::Kind::General, fmt::format("the watch's file {} can't be written", path));
  }
  writeLine(fmt::format("watching {}, limit {} s", device, m_limit));
  m_thread = std::thread([this] { watch(); });
}

HangWatch::~HangWatch() {
  {
    const std::lock_guard<std::mutex> lock(m_mutex);
    m_ending = true;
  }
  m_changed.notify_all();
  m_thread.join();
  ::close(m_file);
}

void HangWatch::writeLine(const std::string& text) const {
  const std::string line = timeOfDay() + " " + text + "\n";
  if (::write(m_file, line.data(), line.size()) < 0) return;  // a full disk must not end the simulation
}

void HangWatch::enterStep(Queue&, long step) { m_step = step; }

void HangWatch::enterStage(Queue&, const char* stage) { m_stage = stage; }

void HangWatch::setRunning(bool running) {
  {
    const std::lock_guard<std::mutex> lock(m_mutex);
    m_running = running;
    m_start = Clock::now();
  }
  m_changed.notify_all();
}

void HangWatch::beforeLaunch(Queue& queue, const Launch& launch) {
  finish(queue, "before kernel " + launch.name);
  {
    const std::lock_guard<std::mutex> lock(m_mutex);
    m_what = fmt::format("step {} {} {} of {}, {} x {}", m_step, m_stage, launch.name, launch.file,
                         launch.grid.groups(), launch.grid.local);
  }
  writeLine(m_what + " begins");
  setRunning(true);
}

void HangWatch::afterLaunch(Queue& queue) {
  try {
    finish(queue, "kernel " + m_what);
  } catch (const OpenClError& e) {
    setRunning(false);
    writeLine(m_what + " failed: " + e.what());
    throw;
  }
  const double time = milliseconds(Clock::now() - m_start);
  setRunning(false);
  writeLine(fmt::format("{} ends, {:.3f} ms", m_what, time));
}

// Says so once a launch.
void HangWatch::watch() {
  const auto limit = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(m_limit));
  std::unique_lock<std::mutex> lock(m_mutex);
  while (!m_ending) {
    m_changed.wait(lock, [&] { return m_running || m_ending; });
    const auto start = m_start;
    const auto over = [&] { return !m_running || m_ending || m_start != start; };
    if (m_changed.wait_until(lock, start + limit, over)) continue;
    const std::string text = fmt::format("{} has been running for {} s and seems to hang", m_what, m_limit);
    writeLine(text);
    fmt::print(stderr, "btgpu: {}\n", text);
    m_changed.wait(lock, over);
  }
}

std::unique_ptr<Recorder> makeHangWatch(const std::string& limit, const std::string& path,
                                        const ComputeDevice& device) {
  return std::make_unique<HangWatch>(parseLimit(limit), path.empty() ? "btgpu-watch.log" : path,
                                     device.description().name);
}

}  // namespace btgpu
