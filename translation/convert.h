// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bullet's vectors and transforms to the device's and back. Positions go through the region origin in double, so
// that a double world loses nothing far from the world's origin.
#pragma once

#include <cstring>

#include "../kernels/shared/body.h"
#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

// Of structs without padding.
template <typename T>
bool sameBits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

inline float4 toFloat4(const btVector3& v, float w = 0.0f) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), w};
}
inline btVector3 toBullet(const float4& v) { return {btScalar(v.x), btScalar(v.y), btScalar(v.z)}; }

inline float4 toLocal(const btVector3& position, const double (&origin)[3]) {
  return {static_cast<float>(double(position.x()) - origin[0]), static_cast<float>(double(position.y()) - origin[1]),
          static_cast<float>(double(position.z()) - origin[2]), 0.0f};
}
inline btVector3 toWorld(const float4& position, const double (&origin)[3]) {
  return {btScalar(double(position.x) + origin[0]), btScalar(double(position.y) + origin[1]),
          btScalar(double(position.z) + origin[2])};
}

inline BodyPose toPose(const btTransform& transform, const double (&origin)[3]) {
  const btQuaternion q = transform.getRotation();
  return {toLocal(transform.getOrigin(), origin),
          {static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z()), static_cast<float>(q.w())}};
}
inline btTransform toTransform(const BodyPose& pose, const double (&origin)[3]) {
  const float4& q = pose.orientation;
  return btTransform(btQuaternion(btScalar(q.x), btScalar(q.y), btScalar(q.z), btScalar(q.w)),
                     toWorld(pose.position, origin));
}

BTGPU_TRANSLATION_END
