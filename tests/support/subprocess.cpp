// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "subprocess.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>

extern char** environ;

namespace btgpu::test {
namespace {

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string nameOf(const std::string& variable) { return variable.substr(0, variable.find('=')); }

std::vector<std::string> environmentWith(const std::vector<std::string>& changes) {
  std::vector<std::string> result;
  for (char** entry = environ; *entry; ++entry) {
    bool changed = false;
    for (const std::string& change : changes) changed = changed || nameOf(change) == nameOf(*entry);
    if (!changed) result.emplace_back(*entry);
  }
  for (const std::string& change : changes) {
    if (change.find('=') != std::string::npos) result.push_back(change);
  }
  return result;
}

std::vector<char*> pointers(const std::vector<std::string>& strings) {
  std::vector<char*> result;
  for (const std::string& s : strings) result.push_back(const_cast<char*>(s.c_str()));
  result.push_back(nullptr);
  return result;
}

// Terminal that keeps what is written to it.
class Terminal {
 public:
  Terminal() : m_master(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    if (m_master < 0 || grantpt(m_master) != 0 || unlockpt(m_master) != 0) throw std::runtime_error("no terminal");
    m_slave = open(ptsname(m_master), O_RDWR | O_NOCTTY | O_CLOEXEC);
  }
  ~Terminal() {
    close(m_master);
    if (m_slave >= 0) close(m_slave);
  }
  int slave() const { return m_slave; }
  std::string drain() {
    close(m_slave);
    m_slave = -1;
    std::string text;
    char buffer[4096];
    // Once the last writer is gone, reading fails with EIO.
    for (ssize_t n; (n = read(m_master, buffer, sizeof buffer)) > 0;) text.append(buffer, static_cast<size_t>(n));
    return text;
  }

 private:
  int m_master, m_slave = -1;
};

int openForWriting(const std::string& path) {
  return open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
}

}  // namespace

std::vector<std::string> Finished::outLines() const { return linesOf(out); }
std::vector<std::string> Finished::errLines() const { return linesOf(err); }

bool hasTerminals() {
  try {
    const Terminal terminal;
    return true;
  } catch (const std::runtime_error&) { return false; }
}

Finished runProgram(const std::vector<std::string>& command, const RunOptions& options) {
  const TemporaryFolder folder;
  const std::vector<std::string> environment = environmentWith(options.environment);
  const std::vector<char*> argv = pointers(command), envp = pointers(environment);
  const int out = openForWriting(folder.file("out")), err = openForWriting(folder.file("err"));
  std::unique_ptr<Terminal> terminal;
  if (options.terminal) terminal = std::make_unique<Terminal>();
  const int stderrTo = terminal ? terminal->slave() : err;

  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no child process");
  if (child == 0) {
    dup2(out, STDOUT_FILENO);
    dup2(stderrTo, STDERR_FILENO);
    alarm(options.seconds);
    execve(argv[0], argv.data(), envp.data());
    _exit(127);
  }
  close(out);
  close(err);
  int status = 0;
  waitpid(child, &status, 0);
  Finished finished;
  if (WIFEXITED(status)) finished.exitCode = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) finished.signal = WTERMSIG(status);
  finished.out = readFile(folder.file("out"));
  finished.err = terminal ? terminal->drain() : readFile(folder.file("err"));
  return finished;
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "btgpu-test-XXXXXX").string();
  if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
  m_path = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(m_path, ignored);
}

std::string readFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void writeFile(const std::filesystem::path& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  file.write(content.data(), static_cast<std::streamsize>(content.size()));
  if (!file.flush()) throw std::runtime_error(path.string() + " can't be written");
}

}  // namespace btgpu::test
