// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "../opencl/recorder.h"

namespace btgpu {

// Logs every launch before and after it runs, one at a time. A thread of its own names the kernel that takes longer
// than the limit, in the log and on stderr. Each line goes to the file at once, by one write: it is there whatever
// becomes of the process.
class HangWatch : public Recorder {
 public:
  // path: appended to. Throws OpenClError if it can't be written.
  HangWatch(double limitSeconds, const std::string& path, const std::string& device);
  ~HangWatch() override;
  HangWatch(const HangWatch&) = delete;
  HangWatch& operator=(const HangWatch&) = delete;

  void enterStep(Queue& queue, long step) override;
  void enterStage(Queue& queue, const char* stage) override;
  void beforeLaunch(Queue& queue, const Launch& launch) override;
  void afterLaunch(Queue& queue) override;

 private:
  using Clock = std::chrono::steady_clock;

  void writeLine(const std::string& text) const;
  void setRunning(bool running);
  void watch();

  const double m_limit;
  int m_file = -1;
  long m_step = -1;
  std::string m_stage;
  // Shared with the thread.
  std::mutex m_mutex;
  std::condition_variable m_changed;
  bool m_running = false, m_ending = false;
  Clock::time_point m_start;
  std::string m_what;  // step, stage, kernel and grid
  std::thread m_thread;
};

// limit: "1" for 10 seconds, else seconds. path: empty for btgpu-watch.log. Throws OpenClError.
std::unique_ptr<Recorder> makeHangWatch(const std::string& limit, const std::string& path, const ComputeDevice& device);

}  // namespace btgpu
