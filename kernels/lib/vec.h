// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// 3-vectors in float4 (w ignored unless said otherwise), 3x3 matrices by rows, quaternions x, y, z, w.
#ifndef BTGPU_LIB_VEC_H
#define BTGPU_LIB_VEC_H
#include "../shared/types.h"

BTGPU_BEGIN

#define BTGPU_EPSILON 1.1920929e-7f      // Bullet's SIMD_EPSILON in float
#define BTGPU_LARGE 1e18f                // Bullet's BT_LARGE_FLOAT
#define BTGPU_HALF_SQRT2 0.70710678f

STRUCT(Matrix3) { float4 row0, row1, row2; };

LIB float4 vec3(float x, float y, float z) { return F4(x, y, z, 0.0f); }
LIB float4 xyz(float4 v) { return F4(v.x, v.y, v.z, 0.0f); }
LIB float4 withW(float4 v, float w) { return F4(v.x, v.y, v.z, w); }
LIB float dot3(float4 a, float4 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
LIB float lengthSqr3(float4 a) { return dot3(a, a); }
LIB float length3(float4 a) { return sqrt(dot3(a, a)); }
LIB float4 abs3(float4 a) { return vec3(fabs(a.x), fabs(a.y), fabs(a.z)); }
LIB float4 scale3(float4 a, float4 b) { return vec3(a.x * b.x, a.y * b.y, a.z * b.z); }
LIB float4 cross3(float4 a, float4 b) {
  return vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
LIB float4 normalize3(float4 a) { return xyz(a) / length3(a); }
LIB float component(float4 a, int i) { return i == 0 ? a.x : (i == 1 ? a.y : a.z); }
LIB float4 unitVector(int i) { return vec3(i == 0 ? 1.0f : 0.0f, i == 1 ? 1.0f : 0.0f, i == 2 ? 1.0f : 0.0f); }
LIB int isFinite3(float4 a) { return isfinite(a.x) && isfinite(a.y) && isfinite(a.z); }
LIB int isFinite4(float4 a) { return isFinite3(a) && isfinite(a.w); }

LIB float4 mulMatrix(Matrix3 m, float4 v) { return vec3(dot3(m.row0, v), dot3(m.row1, v), dot3(m.row2, v)); }
LIB float4 mulTransposed(Matrix3 m, float4 v) {
  return xyz(m.row0 * v.x + m.row1 * v.y + m.row2 * v.z);
}
LIB float4 matrixColumn(Matrix3 m, int i) {
  return vec3(component(m.row0, i), component(m.row1, i), component(m.row2, i));
}
LIB Matrix3 matrixFromQuaternion(float4 q) {
  // Scaled by 2 / |q|^2 as Bullet does, so that a slightly denormalised quaternion still gives a rotation.
  const float s = 2.0f / (q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  const float xs = q.x * s, ys = q.y * s, zs = q.z * s;
  const float wx = q.w * xs, wy = q.w * ys, wz = q.w * zs;
  const float xx = q.x * xs, xy = q.x * ys, xz = q.x * zs;
  const float yy = q.y * ys, yz = q.y * zs, zz = q.z * zs;
  Matrix3 m;
  m.row0 = vec3(1.0f - (yy + zz), xy - wz, xz + wy);
  m.row1 = vec3(xy + wz, 1.0f - (xx + zz), yz - wx);
  m.row2 = vec3(xz - wy, yz + wx, 1.0f - (xx + yy));
  return m;
}
LIB float4 quaternionProduct(float4 a, float4 b) {
  return F4(a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z,
            a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
}
LIB float4 rotate(float4 q, float4 v) { return mulMatrix(matrixFromQuaternion(q), v); }
LIB float4 rotateInverse(float4 q, float4 v) { return mulTransposed(matrixFromQuaternion(q), v); }

// R diag(d) R^T for the rotation R of q: a diagonal tensor in body axes, seen in world axes.
LIB Matrix3 worldTensor(Matrix3 r, float4 d) {
  const float4 c0 = scale3(r.row0, d), c1 = scale3(r.row1, d), c2 = scale3(r.row2, d);
  Matrix3 m;
  m.row0 = vec3(dot3(c0, r.row0), dot3(c0, r.row1), dot3(c0, r.row2));
  m.row1 = vec3(dot3(c1, r.row0), dot3(c1, r.row1), dot3(c1, r.row2));
  m.row2 = vec3(dot3(c2, r.row0), dot3(c2, r.row1), dot3(c2, r.row2));
  return m;
}

// Solves m x = b by Cramer's rule; a singular matrix gives zero.
LIB float4 solve3(Matrix3 m, float4 b) {
  const float4 c0 = matrixColumn(m, 0), c1 = matrixColumn(m, 1), c2 = matrixColumn(m, 2);
  const float det = dot3(c0, cross3(c1, c2));
  const float inverse = fabs(det) > BTGPU_EPSILON ? 1.0f / det : 0.0f;
  return vec3(dot3(b, cross3(c1, c2)), dot3(c0, cross3(b, c2)), dot3(c0, cross3(c1, b))) * inverse;
}

// Two unit vectors p and q = n x p that span the plane normal to n. Which ones is a convention: friction
// directions and manifold data are compared with the oracle, so this is Bullet's (btPlaneSpace1).
LIB void planeSpace(float4 n, REF(float4) p, REF(float4) q) {
  *p = normalize3(fabs(n.z) > BTGPU_HALF_SQRT2 ? vec3(0.0f, -n.z, n.y) : vec3(-n.y, n.x, 0.0f));
  *q = cross3(n, *p);
}

BTGPU_END
#endif
