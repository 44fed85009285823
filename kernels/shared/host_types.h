// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The C++ side of types.h: float4 with OpenCL's layout and operators, and the built-in functions that
// kernels/lib uses, so that the same maths is unit tested on the host.
#ifndef BTGPU_SHARED_HOST_TYPES_H
#define BTGPU_SHARED_HOST_TYPES_H

#include <cmath>
#include <cstdint>
#include <cstring>

namespace btgpu {

using uint = std::uint32_t;
using ulong = std::uint64_t;

struct alignas(16) float4 {
  float x = 0, y = 0, z = 0, w = 0;
};

inline float4 operator+(float4 a, float4 b) { return {a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w}; }
inline float4 operator-(float4 a, float4 b) { return {a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w}; }
inline float4 operator*(float4 a, float4 b) { return {a.x * b.x, a.y * b.y, a.z * b.z, a.w * b.w}; }
inline float4 operator*(float4 a, float s) { return {a.x * s, a.y * s, a.z * s, a.w * s}; }
inline float4 operator*(float s, float4 a) { return a * s; }
inline float4 operator/(float4 a, float s) { return {a.x / s, a.y / s, a.z / s, a.w / s}; }
inline float4 operator-(float4 a) { return {-a.x, -a.y, -a.z, -a.w}; }
inline float4& operator+=(float4& a, float4 b) { return a = a + b; }
inline float4& operator-=(float4& a, float4 b) { return a = a - b; }
inline float4& operator*=(float4& a, float s) { return a = a * s; }

// OpenCL C built-ins, named as there.
inline float4 fmin(float4 a, float4 b) {
  return {std::fmin(a.x, b.x), std::fmin(a.y, b.y), std::fmin(a.z, b.z), std::fmin(a.w, b.w)};
}
inline float4 fmax(float4 a, float4 b) {
  return {std::fmax(a.x, b.x), std::fmax(a.y, b.y), std::fmax(a.z, b.z), std::fmax(a.w, b.w)};
}
inline float fmin(float a, float b) { return std::fmin(a, b); }
inline float fmax(float a, float b) { return std::fmax(a, b); }
inline float clamp(float v, float lo, float hi) { return std::fmin(std::fmax(v, lo), hi); }
inline float fabs(float v) { return std::fabs(v); }
inline float sqrt(float v) { return std::sqrt(v); }
inline float floor(float v) { return std::floor(v); }
inline float sin(float v) { return std::sin(v); }
inline float cos(float v) { return std::cos(v); }
inline float pow(float a, float b) { return std::pow(a, b); }
inline int isfinite(float v) { return std::isfinite(v) ? 1 : 0; }
inline uint as_uint(float v) {
  uint u;
  std::memcpy(&u, &v, sizeof u);
  return u;
}
inline float as_float(uint u) {
  float v;
  std::memcpy(&v, &u, sizeof v);
  return v;
}

}  // namespace btgpu

#endif
