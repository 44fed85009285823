// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the fuzzer of .bullet files and bullet_files_test.cpp feed with bytes of all kinds: our side of the way from a
// file to the arrays of the device. Bullet's own parser runs in a child process (tools/btgpu/bullet_file.h).
#pragma once

#include <cmath>

#include "tests/fuzz/readers.h"
#include "tests/support/subprocess.h"
#include "tools/btgpu/bullet_file.h"
#include "translation/read_world.h"

namespace btgpu::fuzz {

inline void requireFinite(float4 v) { require(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z)); }

inline void requireInRange(const WorldInput& input) {
  for (const BodyPose& pose : input.poses.values) {
    requireFinite(pose.position);
    require(std::isfinite(pose.orientation.w));
    requireFinite(pose.orientation);
  }
  for (const BodyVelocity& velocity : input.velocities.values) {
    requireFinite(velocity.linear);
    requireFinite(velocity.angular);
  }
  for (const BodyInfo& info : input.infos.values) {
    require(!(info.flags & BODY_QUARANTINED));
    require(info.shapeIndex >= 0 && static_cast<size_t>(info.shapeIndex) < input.shapes.values.size());
  }
  for (const Shape& shape : input.shapes.values) requireFinite(shape.extents);
}

// A file that is taken gives a world in which each body is within range, before and after the translation. Aborts
// where it does not; returns whether the file was taken.
inline bool tryBulletFile(const Bytes& bytes, const std::string& path) {
  test::writeFile(path, {bytes.begin(), bytes.end()});
  try {
    tool::TestWorld<btDiscreteDynamicsWorld> test(tool::builderOfFile(path));
    require(test.world().getNumCollisionObjects() > 0);
    WorldReader reader;
    FallbackList missing, notes;
    reader.read(test.world(), missing, notes);
    require(reader.input().bodyCount >= static_cast<size_t>(test.world().getNumCollisionObjects()));
    requireInRange(reader.input());
    return true;
  } catch (const tool::InputError& e) {
    const std::string message = e.what();
    require(message.rfind(path, 0) == 0 && message.find('\n') == std::string::npos);
    return false;
  }
}

}  // namespace btgpu::fuzz
