// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Vectors of the fast mode's references in float or double, and how their contracts hold arrays against each other.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "../../kernels/shared/body.h"
#include "contract.h"

namespace btgpu::substeps {

template <typename Real>
struct Vec3 {
  Real x = 0, y = 0, z = 0;
  Vec3 operator+(Vec3 b) const { return {x + b.x, y + b.y, z + b.z}; }
  Vec3 operator-(Vec3 b) const { return {x - b.x, y - b.y, z - b.z}; }
  Vec3 operator-() const { return {-x, -y, -z}; }
  Vec3 operator*(Real s) const { return {x * s, y * s, z * s}; }
  Vec3 operator/(Real s) const { return {x / s, y / s, z / s}; }
};
template <typename Real>
Real dot(Vec3<Real> a, Vec3<Real> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <typename Real>
Vec3<Real> cross(Vec3<Real> a, Vec3<Real> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <typename Real>
Real length(Vec3<Real> a) {
  return std::sqrt(dot(a, a));
}
template <typename Real>
Vec3<Real> toVec(float4 v) {
  return {Real(v.x), Real(v.y), Real(v.z)};
}
template <typename Real>
float4 toFloat4(Vec3<Real> v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), 0};
}

// A row's Jacobian at one end.
template <typename Real>
struct Line {
  Vec3<Real> linear, angular;
};
template <typename Real>
Line<Real> response(const SolverMass& m, const Line<Real>& row) {
  const Vec3<Real> a = row.angular;
  return {{Real(m.row0.w) * row.linear.x, Real(m.row1.w) * row.linear.y, Real(m.row2.w) * row.linear.z},
          {dot(toVec<Real>(m.row0), a), dot(toVec<Real>(m.row1), a), dot(toVec<Real>(m.row2), a)}};
}
template <typename Real>
Real product(const Line<Real>& a, const Line<Real>& b) {
  return dot(a.linear, b.linear) + dot(a.angular, b.angular);
}

// Values by kind; of each kind the largest difference and the largest value.
class Kinds {
 public:
  void take(const std::string& kind, double value, double other, size_t where) {
    Largest& l = m_kinds[kind];
    double off = std::fabs(value - other);
    if (std::isnan(off)) off = std::isnan(value) && std::isnan(other) ? 0 : std::numeric_limits<double>::infinity();
    if (value == other) off = 0;
    if (off > l.off) l = {off, where, l.size};
    if (std::isfinite(other)) l.size = std::max(l.size, std::fabs(other));
  }
  void take(const std::string& kind, float4 value, float4 other, size_t where) {
    take(kind, value.x, other.x, where);
    take(kind, value.y, other.y, where);
    take(kind, value.z, other.z, where);
  }
  void takeLarger(const Kinds& others) {
    for (const auto& [kind, l] : others.m_kinds) m_kinds[kind].off = std::max(m_kinds[kind].off, l.off);
  }
  // Off by no more than eight times what `noise` is (another float computation of the same), or by a few roundings of
  // the kind's largest value.
  void check(Contract& contract, const Kinds& noise) const {
    constexpr double kRounding = 1.0 / 16777216;
    for (const auto& [kind, l] : m_kinds) {
      contract.at("{} {}", kind, l.where);
      contract.within("error", l.off, 8 * noise.m_kinds.at(kind).off + 8 * kRounding * l.size);
    }
  }

 private:
  struct Largest {
    double off = 0;
    size_t where = 0;
    double size = 0;
  };
  std::map<std::string, Largest> m_kinds;
};

}  // namespace btgpu::substeps
