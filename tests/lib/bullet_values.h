// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Values of the device's maths as Bullet's, for tests with stock Bullet as the oracle.
#pragma once

#include <btBulletDynamicsCommon.h>

#include "tests/lib/double3.h"
#include "tests/support/bullet_convert.h"

namespace btgpu {

inline Double3 toDouble(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline DoubleMatrix toDouble(const btMatrix3x3& m) { return {{toDouble(m[0]), toDouble(m[1]), toDouble(m[2])}}; }
inline void expectNear(float4 actual, const btVector3& expected, double tolerance) {
  expectNear(toDouble(actual), toDouble(expected), tolerance);
}

}  // namespace btgpu
