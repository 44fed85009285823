// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace btgpu::test {

// How a program ended, and what it said.
struct Finished {
  int exitCode = -1;  // -1: it did not exit by itself
  int signal = 0;     // that ended it; SIGALRM: it took too long
  std::string out, err;

  std::vector<std::string> outLines() const;
  std::vector<std::string> errLines() const;
};

struct RunOptions {
  std::vector<std::string> environment;  // "NAME=value" sets, "NAME" takes away; the rest is the test's own
  unsigned seconds = 100;                // then it is ended by SIGALRM
  bool terminal = false;                 // stderr is a terminal instead of a file
};

// False where the system gives no pseudo-terminals (a chroot without /dev/pts).
bool hasTerminals();

Finished runProgram(const std::vector<std::string>& command, const RunOptions& options = {});

// A folder of its own for one test, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return m_path; }
  std::string file(const std::string& name) const { return (m_path / name).string(); }

 private:
  std::filesystem::path m_path;
};

std::string readFile(const std::filesystem::path& path);
void writeFile(const std::filesystem::path& path, const std::string& content);

}  // namespace btgpu::test
