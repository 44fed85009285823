// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Values of the device's maths as Bullet's, for tests with stock Bullet as the oracle.
#pragma once

#include <btBulletDynamicsCommon.h>

#include "tests/lib/double3.h"

namespace btgpu {

inline btVector3 toBullet(float4 v) { return {v.x, v.y, v.z}; }
inline btTransform toBullet(const BodyPose& pose) {
  const float4 q = pose.orientation;
  return btTransform(btQuaternion(q.x, q.y, q.z, q.w), toBullet(pose.position));
}
inline Double3 toDouble(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline DoubleMatrix toDouble(const btMatrix3x3& m) { return {{toDouble(m[0]), toDouble(m[1]), toDouble(m[2])}}; }
inline void expectNear(float4 actual, const btVector3& expected, double tolerance) {
  expectNear(toDouble(actual), toDouble(expected), tolerance);
}

}  // namespace btgpu
