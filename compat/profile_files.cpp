// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "profile_files.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "profile_text.h"

namespace btgpu {
namespace {

struct ProfileFile {
  Profile profile;
  int users = 0;
  std::uint64_t written = 0;  // the version that is in the file
};

struct Files {
  std::mutex mutex;
  std::map<std::string, ProfileFile> byPath;
  pid_t process = 0;  // a fork has a copy of everything, but the file is its parent's
};

// Never destroyed: static worlds die after the statics of this library.
Files& files() {
  static Files* f = new Files;
  return *f;
}

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::string pathOf(const std::string& name) {
  const std::size_t mark = name.find("%p");
  return mark == std::string::npos ? name : std::string(name).replace(mark, 2, std::to_string(getpid()));
}

// Under another name first, so that there is a whole file at any time.
bool write(const std::string& path, const ProfileData& data) {
  const std::string part = path + ".part";
  std::FILE* file = std::fopen(part.c_str(), "w");
  bool done = file != nullptr;
  if (file) {
    try {
      if (endsWith(path, ".csv")) {
        std::fputs(toCsv(data).c_str(), file);
      } else {
        writeTrace(file, data);
      }
    } catch (const std::exception&) { done = false; }
    done = std::ferror(file) == 0 && done;
    done = std::fclose(file) == 0 && done;
  }
  done = done && std::rename(part.c_str(), path.c_str()) == 0;
  if (!done) {
    std::fprintf(stderr, "btgpu: no profile: %s can't be written: %s\n", path.c_str(), std::strerror(errno));
    std::remove(part.c_str());
  }
  return done;
}

void save(const std::string& path, ProfileFile& file) {
  if (files().process != getpid() || file.written == file.profile.version()) return;
  file.written = file.profile.version();
  write(path, file.profile.data());
}

void saveAll() {
  Files& f = files();
  const std::lock_guard<std::mutex> lock(f.mutex);
  for (auto& [path, file] : f.byPath) save(path, file);
}

void release(const std::string& path) noexcept {
  Files& f = files();
  const std::lock_guard<std::mutex> lock(f.mutex);
  ProfileFile& file = f.byPath.at(path);
  if (--file.users == 0) save(path, file);
}

}  // namespace

std::shared_ptr<Profile> openProfileFile(const std::string& name) {
  if (name.empty()) return nullptr;
  const std::string path = pathOf(name);
  Files& f = files();
  const std::lock_guard<std::mutex> lock(f.mutex);
  const auto known = f.byPath.find(path);
  if (known == f.byPath.end() && !write(path, {})) return nullptr;
  if (f.byPath.empty()) {
    f.process = getpid();
    std::atexit(saveAll);
  }
  ProfileFile& file = f.byPath[path];
  ++file.users;
  return std::shared_ptr<Profile>(&file.profile, [path](Profile*) { release(path); });
}

}  // namespace btgpu
