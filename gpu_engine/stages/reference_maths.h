// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Vectors and matrices in double for the host references. Apart from kernels/lib on purpose: a mistake there
// must not be repeated here.
#pragma once

#include <cmath>

#include "../../kernels/shared/body.h"

namespace btgpu::reference {

struct Vec {
  double x = 0, y = 0, z = 0;
  double& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  double operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};

inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator-(Vec a) { return {-a.x, -a.y, -a.z}; }
inline Vec operator*(Vec a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vec operator/(Vec a, double s) { return {a.x / s, a.y / s, a.z / s}; }
inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline double length(Vec a) { return std::sqrt(dot(a, a)); }

inline Vec toVec(float4 v) { return {v.x, v.y, v.z}; }
inline float4 toFloat4(Vec v, double w = 0) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), static_cast<float>(w)};
}

struct Matrix {
  Vec row[3];
  double operator()(int i, int j) const { return row[i][j]; }
  Vec column(int j) const { return {row[0][j], row[1][j], row[2][j]}; }
};

inline Vec operator*(const Matrix& m, Vec v) { return {dot(m.row[0], v), dot(m.row[1], v), dot(m.row[2], v)}; }
inline Matrix transposed(const Matrix& m) { return {{m.column(0), m.column(1), m.column(2)}}; }
inline Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m.row[i][j] = dot(a.row[i], b.column(j));
  }
  return m;
}
inline Matrix operator+(const Matrix& a, const Matrix& b) {
  return {{a.row[0] + b.row[0], a.row[1] + b.row[1], a.row[2] + b.row[2]}};
}
inline Matrix operator*(const Matrix& m, double s) { return {{m.row[0] * s, m.row[1] * s, m.row[2] * s}}; }
inline Matrix diagonalMatrix(Vec d) { return {{{d.x, 0, 0}, {0, d.y, 0}, {0, 0, d.z}}}; }
// v x as a matrix.
inline Matrix crossMatrix(Vec v) { return {{{0, -v.z, v.y}, {v.z, 0, -v.x}, {-v.y, v.x, 0}}}; }
inline double determinant(const Matrix& m) { return dot(m.column(0), cross(m.column(1), m.column(2))); }

// Body to world; the quaternion need not be of unit length.
inline Matrix rotationOf(float4 q) {
  const double x = q.x, y = q.y, z = q.z, w = q.w, s = 2 / (x * x + y * y + z * z + w * w);
  return {{{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
           {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
           {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}}};
}

}  // namespace btgpu::reference
