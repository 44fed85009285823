// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "program_cache.h"

#include <fmt/format.h>
#include <unistd.h>
#include <xxhash.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>

#include "btgpu_version.h"
#include "compute_device.h"
#include "error.h"
#include "kernel_sources.h"
#include "program_entry.h"

namespace btgpu {
namespace {

std::filesystem::path entryPath(const std::string& key) {
  return ProgramCache::directory() / fmt::format("{:016x}.bin", XXH3_64bits(key.data(), key.size()));
}

std::optional<std::vector<unsigned char>> readEntry(const std::filesystem::path& path, const std::string& key) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  if (error || !file) return std::nullopt;
  std::vector<unsigned char> bytes(size);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size))) return std::nullopt;
  return decodeProgramEntry(bytes, key);
}

// Best effort: a cache that can't be written only costs time.
void writeEntry(const std::filesystem::path& path, const std::vector<unsigned char>& entry) {
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  const auto temporary = path.parent_path() / fmt::format("{}.{}.tmp", path.filename().string(), ::getpid());
  {
    std::ofstream file(temporary, std::ios::binary);
    file.write(reinterpret_cast<const char*>(entry.data()), static_cast<std::streamsize>(entry.size()));
    if (!file.flush()) {
      std::filesystem::remove(temporary, error);
      return;
    }
  }
  std::filesystem::rename(temporary, path, error);
  if (error) std::filesystem::remove(temporary, error);
}

std::string commonOptions(const ComputeDevice& device) {
  std::string options = "-cl-std=CL1.2 -Werror";
  options += device.shape() == KernelShape::Cpu ? " -DBTGPU_SHAPE_CPU" : " -DBTGPU_SHAPE_GPU";
  // Parity mode: no fast-math, and IEEE division and square root where the device offers them.
  if (device.correctlyRounded()) options += " -cl-fp32-correctly-rounded-divide-sqrt";
  options += " -cl-kernel-arg-info";
  if (device.debugKernels()) options += " -DBTGPU_DEBUG";
  // DEBUG_PRINT in kernels/lib/kernel.h.
  if (const char* print = std::getenv("BTGPU_PRINTF"); print && std::string(print) == "1") options += " -DBTGPU_PRINTF";
  // Development: for example -cl-opt-disable for a debugger, or -DBTGPU_... to try something.
  if (const char* extra = std::getenv("BTGPU_BUILD_OPTIONS"); extra && *extra) options += std::string(" ") + extra;
  return options;
}

}  // namespace

ProgramCache::ProgramCache(ComputeDevice& device) : m_device(device) {}

std::filesystem::path ProgramCache::directory() {
  const auto get = [](const char* name) -> std::filesystem::path {
    const char* value = std::getenv(name);
    return value ? value : "";
  };
  if (auto path = get("BTGPU_CACHE_DIR"); !path.empty()) return path;
  if (auto path = get("XDG_CACHE_HOME"); path.is_absolute()) return path / "btgpu";
  if (auto path = get("HOME"); !path.empty()) return path / ".cache" / "btgpu";
  return {};
}

std::string ProgramCache::makeKey(const std::string& source, const std::string& options) const {
  const auto& d = m_device.description();
  return fmt::format("btgpu {}\ndevice {}\nplatform {}\nversion {}\ndriver {}\noptions {}\n{}", BTGPU_VERSION, d.name,
                     d.platform, d.version, d.driver, options, source);
}

cl::Program ProgramCache::get(const std::string& file, const std::string& options) {
  const std::string source = expandKernelSource(file);
  const std::string allOptions = commonOptions(m_device) + (options.empty() ? "" : " " + options);
  const std::string key = makeKey(source, allOptions);
  const std::lock_guard<std::mutex> lock(m_mutex);
  if (const auto it = m_programs.find(key); it != m_programs.end()) return it->second;

  const auto start = std::chrono::steady_clock::now();
  cl::Program program;
  // A debug build needs the names of the kernels' parameters, which drivers may lose in a binary.
  const bool kept = !m_device.debugKernels();
  if (!kept || !load(key, program)) {
    program = build(file, source, allOptions);
    if (kept) m_unsaved.push_back({key, program});
    ++m_statistics.built;
  }
  m_statistics.buildSeconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  m_programs.emplace(key, program);
  return program;
}

bool ProgramCache::load(const std::string& key, cl::Program& program) {
  if (directory().empty()) return false;
  const auto path = entryPath(key);
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return false;
  if (const auto binary = readEntry(path, key)) {
    try {
      program = cl::Program(m_device.context(), {m_device.device()}, {*binary});
      program.build({m_device.device()});
      ++m_statistics.loaded;
      return true;
    } catch (const cl::Error&) {
      // The driver does not take its own binary any more: build anew.
    }
  }
  if (m_statistics.rejected++ == 0) {
    std::fprintf(stderr, "btgpu: a damaged entry in the kernel cache %s is built anew\n", directory().c_str());
  }
  return false;
}

cl::Program ProgramCache::build(const std::string& file, const std::string& source, const std::string& options) const {
  cl::Program program(m_device.context(), source);
  try {
    program.build({m_device.device()}, options.c_str());
  } catch (const cl::Error& e) {
    const auto log = nameLines(program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(m_device.device()), source);
    throw OpenClError(OpenClError::Kind::Build, fmt::format("kernels/{} does not build on {} ({}): {}", file,
                                                            m_device.description().name, errorName(e.err()), log));
  }
  return program;
}

bool ProgramCache::saveNext() {
  const std::lock_guard<std::mutex> lock(m_mutex);
  if (m_unsaved.empty()) return false;
  const Unsaved next = std::move(m_unsaved.front());
  m_unsaved.pop_front();
  if (directory().empty()) return true;
  try {
    const auto binaries = next.program.getInfo<CL_PROGRAM_BINARIES>();
    if (!binaries.empty() && !binaries.front().empty()) {
      writeEntry(entryPath(next.key), encodeProgramEntry(next.key, binaries.front()));
    }
  } catch (const cl::Error&) {
    // A driver without binaries: nothing to keep.
  }
  return true;
}

ProgramCache::Statistics ProgramCache::statistics() const {
  const std::lock_guard<std::mutex> lock(m_mutex);
  return m_statistics;
}

}  // namespace btgpu
