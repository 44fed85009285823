// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Box against box: separating axis test, then the incident face clipped by the reference face (the paper,
// "GPU contact computation"). Faces are preferred to edges by the margin that Bullet's box test has, because a
// flickering choice topples stacks.
#ifndef BTGPU_LIB_BOX_BOX_H
#define BTGPU_LIB_BOX_BOX_H
#include "collide.h"

BTGPU_BEGIN

#define EDGE_PENALTY 1.05f  // an edge axis must beat the best face by 5 %
#define EDGE_SLACK 1e-5f    // keeps nearly parallel edges from separating boxes by rounding

STRUCT(AxisSearch) {
  float separation;  // along the best axis, negative: overlap
  float4 normal;     // in A's axes, not yet oriented from A to B
  int code;          // SeparatingAxis.code; -1 once a separating axis is found
};

LIB void tryFace(REF(AxisSearch) best, float distance, float reach, float4 normal, int code) {
  const float separation = fabs(distance) - reach;
  if (best->code == -1) return;
  if (separation > 0.0f) {
    best->code = -1;
  } else if (separation > best->separation) {
    best->separation = separation;
    best->normal = distance < 0.0f ? -normal : normal;
    best->code = code;
  }
}

LIB void tryEdge(REF(AxisSearch) best, float4 axis, float distance, float reach, int code) {
  const float separation = fabs(distance) - reach;
  if (best->code == -1) return;
  if (separation > BTGPU_EPSILON) {
    best->code = -1;
    return;
  }
  const float length = length3(axis);
  if (length <= BTGPU_EPSILON || separation / length * EDGE_PENALTY <= best->separation) return;
  best->separation = separation / length;
  best->normal = axis * ((distance < 0.0f ? -1.0f : 1.0f) / length);
  best->code = code;
}

// A's axis i x v, in A's axes.
LIB float4 edgeAxis(int i, float4 v) {
  return i == 0 ? vec3(0.0f, -v.z, v.y) : i == 1 ? vec3(v.z, 0.0f, -v.x) : vec3(-v.y, v.x, 0.0f);
}

// Tests the 15 axes of two boxes with half extents a, b, rotations ra, rb. result.normal is in world axes.
LIB SeparatingAxis separatingAxisBoxBox(float4 a, Matrix3 ra, float4 b, Matrix3 rb, float4 bFromA) {
  const float4 t = mulTransposed(ra, bFromA);  // B's centre in A's axes
  AxisSearch best;
  best.separation = -BTGPU_LARGE;
  best.normal = vec3(0.0f, 0.0f, 0.0f);
  best.code = -2;

  float4 axisB[3], absB[3];  // B's axes in A's axes
  for (int j = 0; j < 3; ++j) {
    axisB[j] = mulTransposed(ra, matrixColumn(rb, j));
    absB[j] = abs3(axisB[j]);
  }
  for (int i = 0; i < 3; ++i) {
    const float reachB =
        b.x * component(absB[0], i) + b.y * component(absB[1], i) + b.z * component(absB[2], i);
    tryFace(&best, component(t, i), component(a, i) + reachB, unitVector(i), i);
  }
  for (int j = 0; j < 3; ++j) {
    tryFace(&best, dot3(t, axisB[j]), dot3(a, absB[j]) + component(b, j), axisB[j], 3 + j);
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const float4 axis = edgeAxis(i, axisB[j]);
      const float reachA = dot3(a, abs3(axis) + (vec3(1.0f, 1.0f, 1.0f) - unitVector(i)) * EDGE_SLACK);
      float reachB = 0.0f;
      for (int k = 0; k < 3; ++k) {
        // |axis . axisB[k]| = |unit(i) . (axisB[j] x axisB[k])|: the i-th component of the third axis.
        if (k != j) reachB += component(b, k) * (component(absB[3 - j - k], i) + EDGE_SLACK);
      }
      tryEdge(&best, axis, dot3(t, axis), reachA + reachB, 6 + 3 * i + j);
    }
  }
  SeparatingAxis result;
  result.code = best.code < 0 ? -1 : best.code;
  result.normal = withW(mulMatrix(ra, best.normal), -best.separation);
  result.unused[0] = result.unused[1] = result.unused[2] = 0;
  return result;
}

// The corner or edge point of a box farthest along `direction` (world axes, from the box's centre); along the
// axis `skip` the midpoint is taken, which gives the middle of an edge.
LIB float4 boxSupport(float4 halfExtents, Matrix3 rotation, float4 direction, int skip) {
  float4 p = vec3(0.0f, 0.0f, 0.0f);
  for (int i = 0; i < 3; ++i) {
    const float4 axis = matrixColumn(rotation, i);
    if (i != skip) p += axis * (dot3(direction, axis) > 0.0f ? component(halfExtents, i) : -component(halfExtents, i));
  }
  return p;
}

// One contact where the two supporting edges come nearest.
LIB void collideEdges(float4 a, Matrix3 ra, float4 b, Matrix3 rb, float4 bFromA, SeparatingAxis axis,
                      REF(RawContacts) out) {
  const int i = (axis.code - 6) / 3, j = (axis.code - 6) % 3;
  const float4 u = matrixColumn(ra, i), v = matrixColumn(rb, j);
  const float4 pa = boxSupport(a, ra, axis.normal, i);
  const float4 pb = xyz(bFromA) + boxSupport(b, rb, -axis.normal, j);
  // Nearest point of line (pb, v) to line (pa, u); the lines are not parallel, or this axis had lost.
  const float4 between = pb - pa;
  const float uv = dot3(u, v), denominator = 1.0f - uv * uv;
  const float along = denominator > 1e-4f ? (uv * dot3(u, between) - dot3(v, between)) / denominator : 0.0f;
  out->normal = -xyz(axis.normal);
  addRaw(out, pb + v * along, -axis.normal.w);
}

// Keeps the part of the polygon (u, v in x, y) on the inner side of sign * coordinate <= limit.
LIB int clipPolygon(const float4* in, int count, float4* out, int coordinate, float sign, float limit) {
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const float4 p = in[i], q = in[i + 1 < count ? i + 1 : 0];
    const float dp = sign * component(p, coordinate) - limit, dq = sign * component(q, coordinate) - limit;
    if (dp <= 0.0f && kept < RAW_POINTS) out[kept++] = p;
    if ((dp <= 0.0f) != (dq <= 0.0f) && kept < RAW_POINTS) out[kept++] = p + (q - p) * (dp / (dp - dq));
  }
  return kept;
}

// Clips the incident face of one box by the side planes of the other's reference face and keeps what lies inside
// the reference box.
LIB void collideFaces(float4 a, Matrix3 ra, float4 b, Matrix3 rb, float4 bFromA, SeparatingAxis axis,
                      REF(RawContacts) out) {
  const int onA = axis.code < 3;
  const int k = onA ? axis.code : axis.code - 3;
  const Matrix3 refRotation = onA ? ra : rb, incRotation = onA ? rb : ra;
  const float4 refHalf = onA ? a : b, incHalf = onA ? b : a;
  const float4 outward = onA ? xyz(axis.normal) : -xyz(axis.normal);      // out of the reference face
  const float4 incFromRef = onA ? xyz(bFromA) : -xyz(bFromA);
  const int ku = (k + 1) % 3, kv = (k + 2) % 3;
  const float4 u = matrixColumn(refRotation, ku), v = matrixColumn(refRotation, kv);

  // The incident face is the one that looks most against `outward`.
  const float4 facing = mulTransposed(incRotation, outward);
  const float4 size = abs3(facing);
  int m = size.x >= size.y ? 0 : 1;
  if (size.z > component(size, m)) m = 2;
  const int m1 = (m + 1) % 3, m2 = (m + 2) % 3;
  const float4 centre =
      incFromRef + matrixColumn(incRotation, m) * (component(facing, m) > 0.0f ? -component(incHalf, m) : component(incHalf, m));
  const float4 e1 = matrixColumn(incRotation, m1) * component(incHalf, m1);
  const float4 e2 = matrixColumn(incRotation, m2) * component(incHalf, m2);

  // Corners in the reference face's coordinates: x, y along u, v; z along the outward normal from the face.
  const float face = component(refHalf, k);
  float4 polygon[RAW_POINTS], clipped[RAW_POINTS];
  for (int i = 0; i < 4; ++i) {
    const float4 p = centre + e1 * (i == 0 || i == 3 ? -1.0f : 1.0f) + e2 * (i < 2 ? -1.0f : 1.0f);
    polygon[i] = vec3(dot3(p, u), dot3(p, v), dot3(p, outward) - face);
  }
  int count = 4;
  count = clipPolygon(polygon, count, clipped, 0, 1.0f, component(refHalf, ku));
  count = clipPolygon(clipped, count, polygon, 0, -1.0f, component(refHalf, ku));
  count = clipPolygon(polygon, count, clipped, 1, 1.0f, component(refHalf, kv));
  count = clipPolygon(clipped, count, polygon, 1, -1.0f, component(refHalf, kv));

  out->normal = -xyz(axis.normal);
  const float4 refPosition = onA ? vec3(0.0f, 0.0f, 0.0f) : xyz(bFromA);
  for (int i = 0; i < count; ++i) {
    const float distance = polygon[i].z;
    if (distance > 0.0f) continue;
    const float4 onFace = refPosition + u * polygon[i].x + v * polygon[i].y + outward * face;
    // The clipped corner belongs to the incident box. If that is B it is the point on B itself, else its foot
    // on B's face is.
    addRaw(out, onA ? onFace + outward * distance : onFace, distance);
  }
}

BTGPU_END
#endif
