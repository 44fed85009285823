// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "kernels/lib/vec.h"

#include <limits>

#include "tests/lib/bullet_values.h"

namespace btgpu {
namespace {

constexpr int kSamples = 5000;

DoubleMatrix toDouble(const Matrix3& m) {
  return {{btgpu::toDouble(m.row0), btgpu::toDouble(m.row1), btgpu::toDouble(m.row2)}};
}
using btgpu::toDouble;

Double3 absolute(Double3 v) { return {std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}; }

void expectNear(const Matrix3& actual, const DoubleMatrix& expected, double tolerance) {
  btgpu::expectNear(actual.row0, expected.row[0], tolerance);
  btgpu::expectNear(actual.row1, expected.row[1], tolerance);
  btgpu::expectNear(actual.row2, expected.row[2], tolerance);
}
using btgpu::expectNear;

TEST(Vec, SelectsComponents) {
  const float4 v = F4(1, 2, 3, 4);
  EXPECT_EQ(component(v, 0), 1);
  EXPECT_EQ(component(v, 1), 2);
  EXPECT_EQ(component(v, 2), 3);
  EXPECT_EQ(xyz(v).w, 0);
  EXPECT_EQ(xyz(v).z, 3);
  EXPECT_EQ(withW(v, 9).w, 9);
  EXPECT_EQ(withW(v, 9).x, 1);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) EXPECT_EQ(component(unitVector(i), k), i == k ? 1 : 0);
  }
  expectNear(abs3(F4(-1, 2, -3, -4)), Double3{1, 2, 3}, 0);
  expectNear(scale3(F4(-1, 2, -3, -4), F4(5, 6, 7, 8)), Double3{-5, 12, -21}, 0);
}

// w is ignored, whatever it holds.
TEST(Vec, IgnoresW) {
  const float infinity = std::numeric_limits<float>::infinity();
  const float4 a = F4(1, 2, 3, infinity), b = F4(4, 5, 6, -infinity);
  EXPECT_EQ(dot3(a, b), 32);
  EXPECT_EQ(lengthSqr3(a), 14);
  expectNear(cross3(a, b), Double3{-3, 6, -3}, 0);
  EXPECT_EQ(cross3(a, b).w, 0);
  EXPECT_EQ(abs3(a).w, 0);
  EXPECT_EQ(scale3(a, b).w, 0);
  EXPECT_EQ(normalize3(a).w, 0);
  Matrix3 m;
  m.row0 = m.row1 = m.row2 = F4(1, 1, 1, infinity);
  expectNear(mulMatrix(m, a), Double3{6, 6, 6}, 0);
  expectNear(mulTransposed(m, a), Double3{6, 6, 6}, 0);
  EXPECT_EQ(mulTransposed(m, a).w, 0);
}

TEST(Vec, TellsFiniteFromNot) {
  const float bad[] = {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
                       std::numeric_limits<float>::quiet_NaN()};
  const float huge = std::numeric_limits<float>::max();
  EXPECT_TRUE(isFinite3(F4(huge, -huge, 0, 0)));
  EXPECT_TRUE(isFinite4(F4(huge, -huge, 0, huge)));
  for (const float x : bad) {
    EXPECT_FALSE(isFinite3(F4(x, 0, 0, 0)));
    EXPECT_FALSE(isFinite3(F4(0, x, 0, 0)));
    EXPECT_FALSE(isFinite3(F4(0, 0, x, 0)));
    EXPECT_TRUE(isFinite3(F4(0, 0, 0, x)));
    EXPECT_FALSE(isFinite4(F4(0, 0, 0, x)));
  }
}

// A sum of three products: each product is rounded once and goes through at most two sums: 3 roundings, of
// terms no larger than the sum of absolute products (and one more for second order terms).
TEST(Vec, DotAndCross) {
  Random random(1);
  for (int n = 0; n < kSamples; ++n) {
    const float4 a = random.vector(random.magnitude(-3, 3)), b = random.vector(random.magnitude(-3, 3));
    const Double3 da = toDouble(a), db = toDouble(b);
    EXPECT_NEAR(dot3(a, b), dot(da, db), 4 * kRounding * dot(absolute(da), absolute(db)));
    // Each component: two products and one difference.
    const double size = length(da) * length(db);
    expectNear(cross3(a, b), cross(da, db), 3 * kRounding * size);
    // Square root halves the relative error of the sum (3 roundings, all terms positive) and adds its own.
    EXPECT_NEAR(length3(a), length(da), 3 * kRounding * length(da));
    // ... and the division adds another.
    expectNear(normalize3(a), da * (1 / length(da)), 4 * kRounding);
  }
}

// An element is 1 or 0 plus two products of three factors with a common, rounded scale: sizes are at most 2,
// and at most 10 roundings meet in one element. The scale makes up for a quaternion that is not quite a unit.
TEST(Vec, MatrixFromQuaternion) {
  Random random(2);
  for (int n = 0; n < kSamples; ++n) {
    const float4 q = random.rotation() * random.uniform(0.9f, 1.1f);
    const Matrix3 m = matrixFromQuaternion(q);
    expectNear(m, rotationOf(q), 10 * kRounding * 2);
    const btMatrix3x3 stock(btQuaternion(q.x, q.y, q.z, q.w));
    expectNear(m, toDouble(stock), 0);  // same operations in the same order as btMatrix3x3::setRotation
    EXPECT_EQ(m.row0.w, 0);
  }
}

TEST(Vec, MatrixProducts) {
  Random random(3);
  for (int n = 0; n < kSamples; ++n) {
    Matrix3 m;
    m.row0 = random.vector(2);
    m.row1 = random.vector(2);
    m.row2 = random.vector(2);
    const float4 v = random.vector(5);
    const double tolerance = 4 * kRounding * 3 * 2 * 5;  // as for a dot product of terms up to 2 * 5
    expectNear(mulMatrix(m, v), toDouble(m) * toDouble(v), tolerance);
    expectNear(mulTransposed(m, v), transposed(toDouble(m)) * toDouble(v), tolerance);
    for (int i = 0; i < 3; ++i) expectNear(matrixColumn(m, i), toDouble(m).column(i), 0);
  }
}

TEST(Vec, Quaternions) {
  Random random(4);
  for (int n = 0; n < kSamples; ++n) {
    const float4 p = random.rotation(), q = random.rotation(), v = random.vector(5);
    const float4 pq = quaternionProduct(p, q);
    const btQuaternion stock = btQuaternion(p.x, p.y, p.z, p.w) * btQuaternion(q.x, q.y, q.z, q.w);
    const double tolerance = 5 * kRounding * 2;  // four products and three sums; the absolute products sum to 2 at most
    expectNear(pq, Double3{stock.x(), stock.y(), stock.z()}, tolerance);
    EXPECT_NEAR(pq.w, stock.w(), tolerance);
    // Turning by the product is turning by q, then by p. Errors: the matrix (above) and a product with |v|
    // < 9.
    const double turnTolerance = (20 + 4) * kRounding * std::sqrt(3.0) * 9;
    expectNear(rotate(p, v), turned(p, toDouble(v)), turnTolerance);
    expectNear(rotate(pq, v), turned(p, turned(q, toDouble(v))), turnTolerance);
    expectNear(rotateInverse(p, rotate(p, v)), toDouble(v), 2 * turnTolerance);
  }
}

TEST(Vec, WorldTensor) {
  Random random(5);
  for (int n = 0; n < kSamples; ++n) {
    const float4 q = random.rotation(), d = abs3(random.vector(4));
    const Matrix3 r = matrixFromQuaternion(q);
    DoubleMatrix diagonal = {{{d.x, 0, 0}, {0, d.y, 0}, {0, 0, d.z}}};
    const DoubleMatrix dr = toDouble(r);
    const Matrix3 tensor = worldTensor(r, d);
    expectNear(tensor, dr * diagonal * transposed(dr),
               5 * kRounding * 4);  // a dot product with one more factor
    expectNear(tensor,
               toDouble(btMatrix3x3(btQuaternion(q.x, q.y, q.z, q.w)).scaled(toBullet(d)) *
                        btMatrix3x3(btQuaternion(q.x, q.y, q.z, q.w)).transpose()),
               10 * kRounding * 4);
  }
}

// Residual of Cramer's rule: for a matrix with entries up to s and determinant det, the minors have absolute
// errors up to 3 * 2 s^2 roundings, so x has errors of about 40 roundings of |b| s^2 / |det|, times s in the
// residual.
TEST(Vec, Solve3) {
  Random random(6);
  int solved = 0;
  for (int n = 0; n < kSamples; ++n) {
    Matrix3 m;
    m.row0 = random.vector(2);
    m.row1 = random.vector(2);
    m.row2 = random.vector(2);
    const float4 b = random.vector(3);
    const DoubleMatrix dm = toDouble(m);
    const double det = dot(dm.column(0), cross(dm.column(1), dm.column(2)));
    if (std::fabs(det) < 0.1) continue;
    ++solved;
    const double tolerance = 3 * 40 * kRounding * 3 * 4 * 2 / std::fabs(det);
    expectNear(dm * toDouble(solve3(m, b)), toDouble(b), tolerance);
  }
  EXPECT_GT(solved, kSamples / 2);
}

TEST(Vec, Solve3OfSingularIsZero) {
  Matrix3 m;
  m.row0 = F4(1, 2, 3, 0);
  m.row1 = F4(2, 4, 6, 0);
  m.row2 = F4(1, 0, 1, 0);
  expectNear(solve3(m, F4(1, 2, 3, 0)), Double3{0, 0, 0}, 0);
  m.row0 = m.row1 = m.row2 = F4(0, 0, 0, 0);
  expectNear(solve3(m, F4(1, 2, 3, 0)), Double3{0, 0, 0}, 0);
}

TEST(Vec, PlaneSpace) {
  Random random(7);
  for (int n = 0; n < kSamples; ++n) {
    float4 normal = random.direction();
    if (n < 6) normal = unitVector(n % 3) * (n < 3 ? 1.0f : -1.0f);
    float4 p, q;
    planeSpace(normal, &p, &q);
    btVector3 stockP, stockQ;
    btPlaneSpace1(toBullet(normal), stockP, stockQ);
    // p: square root of a sum of two squares, a division (Bullet: a reciprocal and a product): 5 roundings on
    // each side. q: products of p with n, two of them summed.
    expectNear(p, stockP, 10 * kRounding);
    expectNear(q, stockQ, 20 * kRounding);
    EXPECT_NEAR(length3(p), 1, 5 * kRounding);
    EXPECT_NEAR(length3(q), 1, 12 * kRounding);
    EXPECT_NEAR(dot3(p, normal), 0, 8 * kRounding);
    EXPECT_NEAR(dot3(q, normal), 0, 8 * kRounding);
    EXPECT_NEAR(dot3(p, q), 0, 8 * kRounding);
    EXPECT_NEAR(dot3(cross3(normal, p), q), 1, 12 * kRounding);
  }
}

}  // namespace
}  // namespace btgpu
