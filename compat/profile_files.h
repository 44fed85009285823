// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>
#include <string>

#include "profile.h"

namespace btgpu {

// The profile that goes to a file: one for all worlds that name the same file, for as long as the process runs. `%p` in
// the name is the process's number; a name that ends in .csv makes a table, any other a trace. The file is there from
// now on, empty but valid; it is written whenever the last of its worlds goes (the last reference to what is returned),
// and at exit. Null if it can't be written, which is said on stderr, and for an empty name.
std::shared_ptr<Profile> openProfileFile(const std::string& name);

}  // namespace btgpu
