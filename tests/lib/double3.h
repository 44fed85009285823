// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Vectors and matrices in double precision, as the exact result that the device's float maths is measured by,
// and random values for it.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "gpu_engine/stages/reference_maths.h"
#include "kernels/shared/body.h"

namespace btgpu {

// Largest relative error of one correctly rounded float operation. Tolerances are small multiples of it.
constexpr double kRounding = 5.9604645e-8;  // 2^-24

using Double3 = reference::Vec;
using DoubleMatrix = reference::Matrix;

inline Double3 times(Double3 a, Double3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline Double3 toDouble(float4 v) { return {v.x, v.y, v.z}; }

// v turned by the quaternion q (normalised here): v + 2 w (q x v) + 2 q x (q x v).
inline Double3 turned(float4 q, Double3 v) {
  const double n = std::sqrt(double(q.x) * q.x + double(q.y) * q.y + double(q.z) * q.z + double(q.w) * q.w);
  const Double3 u = toDouble(q) * (1 / n);
  const Double3 t = cross(u, v) * 2;
  return v + t * (q.w / n) + cross(u, t);
}
inline DoubleMatrix rotationOf(float4 q) {
  return transposed(DoubleMatrix{{turned(q, {1, 0, 0}), turned(q, {0, 1, 0}), turned(q, {0, 0, 1})}});
}

inline void expectNear(Double3 actual, Double3 expected, double tolerance) {
  EXPECT_NEAR(actual.x, expected.x, tolerance);
  EXPECT_NEAR(actual.y, expected.y, tolerance);
  EXPECT_NEAR(actual.z, expected.z, tolerance);
}
inline void expectNear(float4 actual, Double3 expected, double tolerance) {
  expectNear(toDouble(actual), expected, tolerance);
}

class Random {
 public:
  explicit Random(unsigned seed) : m_generator(seed) {}

  float uniform(float lower, float upper) { return std::uniform_real_distribution<float>(lower, upper)(m_generator); }
  // 10^lower to 10^upper, evenly in the exponent.
  float magnitude(float lower, float upper) { return std::pow(10.0f, uniform(lower, upper)); }
  int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(m_generator); }
  bool coin() { return below(2) == 1; }
  float4 vector(float range) {
    const float x = uniform(-range, range), y = uniform(-range, range), z = uniform(-range, range);
    return {x, y, z, 0};
  }
  float4 direction() {
    const float4 v = gaussian();
    const float s = 1.0f / std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
    return {v.x * s, v.y * s, v.z * s, 0};
  }
  // A unit quaternion; all rotations are equally likely.
  float4 rotation() {
    const float4 v = gaussian();
    const float s = 1.0f / std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z + v.w * v.w);
    return v * s;
  }
  BodyPose pose(float range) {
    const float4 position = vector(range);
    return {position, rotation()};
  }

 private:
  float4 gaussian() {
    std::normal_distribution<float> d;
    const float x = d(m_generator), y = d(m_generator), z = d(m_generator), w = d(m_generator);
    return {x, y, z, w};
  }

  std::mt19937 m_generator;
};

}  // namespace btgpu
