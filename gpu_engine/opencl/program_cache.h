// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>

#include "cl.h"

namespace btgpu {

class ComputeDevice;

// Built programs in two levels: in memory for the process, on disk for the next one. A disk entry is trusted only
// if its whole key (expanded source, options, device, driver, library version) and the checksum of its binary
// agree; anything else is rebuilt and written anew. Files appear whole or not at all. Thread-safe.
class ProgramCache {
 public:
  struct Statistics {
    int built = 0;     // from source
    int loaded = 0;    // from disk
    int rejected = 0;  // disk entries found damaged or stale
    double buildSeconds = 0;
  };

  explicit ProgramCache(ComputeDevice& device);

  // The program of kernels/<file> with these options, e.g. "-DBTGPU_KEY64". Throws OpenClError with the log.
  cl::Program get(const std::string& file, const std::string& options = {});

  // Writes one program that was built from source to disk; false if there is none left. To be called after each step:
  // for a binary, PoCL compiles all kernels once more, which all at once would keep the first step waiting for seconds.
  bool saveNext();

  Statistics statistics() const;

  // Where disk entries go: $BTGPU_CACHE_DIR, else $XDG_CACHE_HOME/btgpu, else ~/.cache/btgpu; empty: nowhere.
  static std::filesystem::path directory();

 private:
  struct Unsaved {
    std::string key;
    cl::Program program;
  };

  cl::Program build(const std::string& file, const std::string& source, const std::string& options) const;
  bool load(const std::string& key, cl::Program& program);
  std::string makeKey(const std::string& source, const std::string& options) const;

  ComputeDevice& m_device;
  mutable std::mutex m_mutex;
  std::map<std::string, cl::Program> m_programs;  // by key
  std::deque<Unsaved> m_unsaved;
  Statistics m_statistics;
};

}  // namespace btgpu
