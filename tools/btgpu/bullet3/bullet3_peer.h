// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bullet3's OpenCL pipeline, as Debian's libbullet-dev ships it, behind the interface of the benchmark. No header of
// Bullet is used here: Bullet3's own do not compile with the flags of this project (tools/CMakeLists.txt).
//
// What its code fixes whatever the scene says: friction 0.7, restitution 0, damping, the solver's time step of 1/60,
// inertia from a box about four times as wide; nothing sleeps; a contact array that is too small loses contacts.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "../bench_world.h"

namespace btgpu::tool {

struct Bullet3Shape {
  float radius;          // of a sphere, or 0
  float halfExtents[3];  // of a box
};

struct Bullet3Body {
  int shape;   // index
  float mass;  // 0: static
  float position[3], orientation[4];
  float linearVelocity[3], angularVelocity[3];
};

struct Bullet3Scene {
  std::vector<Bullet3Shape> shapes;
  std::vector<Bullet3Body> bodies;  // static ones first
  float gravity[3];
};

// A world on the OpenCL device of this platform and name. Throws std::runtime_error if it can't be made, InputError if
// the tool was built without Bullet3.
std::unique_ptr<BenchWorld> makeBullet3World(const Bullet3Scene& scene, const std::string& platform,
                                             const std::string& device);

}  // namespace btgpu::tool
