// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "capture_request.h"

#include <fmt/format.h>

#include <regex>
#include <sstream>

#include "../opencl/error.h"

namespace btgpu {

std::vector<CaptureRequest> parseCaptureRequests(const std::string& text) {
  static const std::regex form("(all|[0-9]{2}(?:_[a-z_]+)?)@([0-9]{1,9})");
  std::vector<CaptureRequest> requests;
  std::istringstream list(text);
  for (std::string item; std::getline(list, item, ',');) {
    std::smatch match;
    if (!std::regex_match(item, match, form)) {
      throw OpenClError(
          OpenClError::Kind::General,
          fmt::format("BTGPU_CAPTURE is '{}': name a stage and a step, as in 44@120 or 44_find_separating_"
                      "axis@120, or all@120, several with commas between them",
                      text));
    }
    requests.push_back({match[1], std::stol(match[2])});
  }
  return requests;
}

}  // namespace btgpu
