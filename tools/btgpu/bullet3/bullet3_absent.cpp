// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// In place of bullet3_peer.cpp where Bullet3's pipeline was not found.
#include "../bullet_file.h"
#include "bullet3_peer.h"

namespace btgpu::tool {

std::unique_ptr<BenchWorld> makeBullet3World(const Bullet3Scene&, const std::string&, const std::string&) {
  throw InputError(
      "bullet3: this btgpu was built without Bullet3's OpenCL pipeline; install libbullet-dev and build again, or "
      "leave "
      "bullet3 out of --worlds");
}

}  // namespace btgpu::tool
