// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "kernel_sources.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <vector>

#include "error.h"

namespace btgpu {
namespace {

std::string readSource(const std::string& path) {
  if (const char* root = std::getenv("BTGPU_KERNEL_DIR"); root && *root) {
    std::ifstream file(std::filesystem::path(root) / path);
    if (file) return {std::istreambuf_iterator<char>(file), {}};
  } else if (const auto it = embeddedKernels().find(path); it != embeddedKernels().end()) {
    return it->second;
  }
  throw OpenClError(OpenClError::Kind::Build, fmt::format("kernel source {} not found", path));
}

// "../lib/vec.h" in  #include "../lib/vec.h", or empty for any other line.
std::string includedFile(const std::string& line) {
  constexpr const char* kStart = "#include \"";
  if (line.rfind(kStart, 0) != 0) return {};
  const size_t first = std::char_traits<char>::length(kStart), last = line.find('"', first);
  return last == std::string::npos ? std::string() : line.substr(first, last - first);
}

void expand(const std::string& path, std::set<std::string>& seen, std::ostringstream& out) {
  std::istringstream in(readSource(path));
  std::string line;
  out << "#line 1 \"" << path << "\"\n";
  for (int number = 1; std::getline(in, line); ++number) {
    const std::string included = includedFile(line);
    if (included.empty()) {
      out << line << '\n';
      continue;
    }
    const auto target = (std::filesystem::path(path).parent_path() / included).lexically_normal().string();
    // A header's own guard would drop a second copy; leaving it out keeps sources short. Host headers are never
    // needed on the device.
    if (target == "kernels/shared/host_types.h" || !seen.insert(target).second) {
      out << '\n';
      continue;
    }
    expand(target, seen, out);
    out << "#line " << number + 1 << " \"" << path << "\"\n";
  }
}

// "kernels/lib/vec.h:12" of each line of an expanded source; directives get the name of what follows.
std::vector<std::string> namesOfLines(const std::string& expandedSource) {
  std::vector<std::string> names;
  std::istringstream in(expandedSource);
  std::string file;
  int number = 1;
  for (std::string line; std::getline(in, line);) {
    static const std::regex directive("#line ([0-9]+) \"([^\"]*)\"");
    std::smatch match;
    const bool isDirective = std::regex_match(line, match, directive);
    if (isDirective) {
      number = std::stoi(match[1]);
      file = match[2];
    }
    names.push_back(fmt::format("{}:{}", file, number));
    if (!isDirective) ++number;
  }
  return names;
}

}  // namespace

std::string nameLines(const std::string& log, const std::string& expandedSource) {
  const auto names = namesOfLines(expandedSource);
  static const std::regex place("<kernel>:([0-9]+)");
  std::string named;
  auto end = log.cbegin();
  for (std::sregex_iterator it(log.begin(), log.end(), place), last; it != last; ++it) {
    const size_t line = std::stoul((*it)[1]);
    named.append(end, (*it)[0].first);
    named += line >= 1 && line <= names.size() ? names[line - 1] : it->str();
    end = (*it)[0].second;
  }
  return named.append(end, log.cend());
}

std::string expandKernelSource(const std::string& name) {
  std::ostringstream out;
  std::set<std::string> seen;
  expand("kernels/" + name, seen, out);
  return out.str();
}

}  // namespace btgpu
