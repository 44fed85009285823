// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>

namespace btgpu::tool {

// A progress bar on stderr; nothing at all where stderr is no terminal.
class ProgressBar {
 public:
  ProgressBar(std::string label, int total);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void show(int done);

 private:
  std::string m_label;
  int m_total, m_shown = -1;
  bool m_terminal;
};

}  // namespace btgpu::tool
