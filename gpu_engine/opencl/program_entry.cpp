// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "program_entry.h"

#include <xxhash.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace btgpu {
namespace {

struct FileHeader {
  char magic[8];
  std::uint64_t keySize, binarySize, binaryChecksum;
};
constexpr char kMagic[8] = {'b', 't', 'g', 'p', 'u', 'p', 'c', '1'};

}  // namespace

std::vector<unsigned char> encodeProgramEntry(const std::string& key, const std::vector<unsigned char>& binary) {
  FileHeader header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.keySize = key.size();
  header.binarySize = binary.size();
  header.binaryChecksum = XXH3_64bits(binary.data(), binary.size());
  std::vector<unsigned char> file(sizeof header + key.size() + binary.size());
  std::memcpy(file.data(), &header, sizeof header);
  std::copy(binary.begin(), binary.end(), std::copy(key.begin(), key.end(), file.begin() + sizeof header));
  return file;
}

std::optional<std::vector<unsigned char>> decodeProgramEntry(const std::vector<unsigned char>& file,
                                                             const std::string& key) {
  FileHeader header;
  const size_t start = sizeof header + key.size();
  if (file.size() < start) return std::nullopt;
  std::memcpy(&header, file.data(), sizeof header);
  if (std::memcmp(header.magic, kMagic, sizeof kMagic) != 0 || header.keySize != key.size()) return std::nullopt;
  if (std::memcmp(file.data() + sizeof header, key.data(), key.size()) != 0) return std::nullopt;
  if (header.binarySize != file.size() - start) return std::nullopt;
  if (XXH3_64bits(file.data() + start, file.size() - start) != header.binaryChecksum) return std::nullopt;
  return std::vector<unsigned char>(file.begin() + static_cast<std::ptrdiff_t>(start), file.end());
}

}  // namespace btgpu
