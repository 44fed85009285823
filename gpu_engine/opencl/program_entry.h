// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace btgpu {

// The bytes of a file in the program cache: a header, the key's text, the program's binary.
std::vector<unsigned char> encodeProgramEntry(const std::string& key, const std::vector<unsigned char>& binary);

// The binary of the program with this key; nothing if the file is damaged or of another key.
std::optional<std::vector<unsigned char>> decodeProgramEntry(const std::vector<unsigned char>& file,
                                                             const std::string& key);

}  // namespace btgpu
