// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "progress.h"

#include <unistd.h>

#include <cstdio>

namespace btgpu::tool {

ProgressBar::ProgressBar(std::string label, int total)
    : m_label(std::move(label)), m_total(total > 0 ? total : 1), m_terminal(isatty(STDERR_FILENO) != 0) {}

ProgressBar::~ProgressBar() {
  if (m_terminal && m_shown >= 0) std::fputs("\r\033[K", stderr);
}

void ProgressBar::show(int done) {
  constexpr int kWidth = 40;
  const int percent = static_cast<int>(100L * done / m_total);
  if (!m_terminal || percent == m_shown) return;
  m_shown = percent;
  const int filled = kWidth * percent / 100;
  std::fprintf(stderr, "\r%s [%s%s] %3d %%", m_label.c_str(), std::string(static_cast<size_t>(filled), '#').c_str(),
               std::string(static_cast<size_t>(kWidth - filled), ' ').c_str(), percent);
  std::fflush(stderr);
}

}  // namespace btgpu::tool
