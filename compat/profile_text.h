// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A profile as files (docs/profile.md).
#pragma once

#include <cstdio>
#include <string>

#include "profile.h"

namespace btgpu {

// In Chrome's trace event format, which Perfetto reads.
void writeTrace(std::FILE* file, const ProfileData& data);
// One line a zone and one a kernel.
std::string toCsv(const ProfileData& data);

// Indices of the zones, each followed by those inside it, in the order in which they were first entered.
std::vector<int> treeOrder(const ProfileData& data);
// Time in zones that are inside no other, respectively in all kernels; nanoseconds.
std::int64_t hostTime(const ProfileData& data);
std::int64_t deviceTime(const ProfileData& data);

}  // namespace btgpu
