// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the items of batched queries are made of, and the farthest points of their shapes, with Bullet's bits.
#ifndef BTGPU_LIB_QUERY_SHAPES_H
#define BTGPU_LIB_QUERY_SHAPES_H
#include "../shared/contact.h"
#include "../shared/mesh.h"
#include "../shared/query.h"
#include "../shared/shape.h"
#include "vec.h"
#if defined(__OPENCL_C_VERSION__) && defined(BTGPU_SHAPE_CPU)
#include "support_wide.h"
#endif

BTGPU_BEGIN

LIB float4 toWorldPoint(ItemPose pose, float4 origin, float4 p) {
  return vec3(dot3(p, pose.row0), dot3(p, pose.row1), dot3(p, pose.row2)) + origin;
}
LIB float4 toLocalDirection(ItemPose pose, float4 d) {
  return xyz(pose.row0 * d.x + pose.row1 * d.y + pose.row2 * d.z);
}
LIB float4 originOf(ItemPose pose) { return vec3(pose.row0.w, pose.row1.w, pose.row2.w); }

// What shapes are made of.
STRUCT(QueryShapes) {
  __global const Shape* shapes;
  __global const float4* hullVertices;
  __global const float4* spheres;
  __global const Mesh* meshes;
  __global const MeshNode* meshNodes;
  __global const MeshTriangle* meshTriangles;
};

LIB QueryShapes queryShapes(__global const Shape* shapes, __global const float4* hullVertices,
                            __global const float4* spheres, __global const Mesh* meshes,
                            __global const MeshNode* meshNodes, __global const MeshTriangle* meshTriangles) {
  QueryShapes q;
  q.shapes = shapes;
  q.hullVertices = hullVertices;
  q.spheres = spheres;
  q.meshes = meshes;
  q.meshNodes = meshNodes;
  q.meshTriangles = meshTriangles;
  return q;
}

LIB float4 hullSupport(Shape shape, __global const float4* vertices, float4 direction) {
  __global const float4* own = vertices + shape.firstVertex;
#if defined(__OPENCL_C_VERSION__) && defined(BTGPU_SHAPE_CPU)
  return xyz(own[farthestVertexWide(own, shape.vertexCount, direction)]);
#else
  float4 point = vec3(0.0f, 0.0f, 0.0f);
  float farthest = -INFINITY;
  for (int i = 0; i < shape.vertexCount; ++i) {
    const float along = dot3(own[i], direction);
    if (along > farthest) {
      farthest = along;
      point = xyz(own[i]);
    }
  }
  return point;
#endif
}

// Of a cylinder's and a cone's rim: along a direction without a part across the axis a cylinder's is the point on its
// next axis, a cone's the centre.
LIB float4 rimSupport(Shape shape, float4 direction) {
  const float4 up = unitVector(shape.variant);
  const float along = component(direction, shape.variant);
  const float4 across = vec3(shape.variant == 0 ? 0.0f : direction.x, shape.variant == 1 ? 0.0f : direction.y,
                             shape.variant == 2 ? 0.0f : direction.z);
  const float size = length3(across);
  if (shape.type == SHAPE_CYLINDER) {
    const float4 end = up * (along < 0.0f ? -shape.halfLength : shape.halfLength);
    return size != 0.0f ? across * (shape.radius / size) + end
                        : unitVector(shape.variant == 0 ? 1 : 0) * shape.radius + end;
  }
  const float height = 2.0f * shape.halfLength;
  const float sine = shape.radius / sqrt(shape.radius * shape.radius + height * height);
  if (along > length3(direction) * sine) return up * shape.halfLength;
  return (size > BTGPU_EPSILON ? across * (shape.radius / size) : vec3(0.0f, 0.0f, 0.0f)) - up * shape.halfLength;
}

// Of several spheres, without the margin that Bullet puts around all shapes.
LIB float4 spheresSupportPoint(ItemForm form, __global const float4* spheres, float4 direction) {
  const float lengthSqr = lengthSqr3(direction);
  const float4 unit = lengthSqr < BTGPU_EPSILON * BTGPU_EPSILON ? vec3(1.0f, 0.0f, 0.0f)
                                                                : xyz(direction) * (1.0f / sqrt(lengthSqr));
  const float4 around = spheres[form.firstSphere - 1], outward = scale3(unit, around), inward = unit * around.w;
  float4 point = vec3(0.0f, 0.0f, 0.0f);
  float farthest = -INFINITY;
  for (int i = 0; i < form.sphereCount; ++i) {
    const float4 sphere = spheres[form.firstSphere + i];
    const float4 there = xyz(sphere) + outward * sphere.w - inward;
    const float along = dot3(unit, there);
    if (along > farthest) {
      farthest = along;
      point = there;
    }
  }
  return point;
}

// Boxes have their corners, also those that Bullet has other classes for.
LIB int isBoxToRays(Shape shape) {
  return shape.type == SHAPE_BOX || (shape.type == SHAPE_HULL && (shape.variant & HULL_BOX));
}

// The point of a convex shape, its margin included, that lies farthest along a direction in its own axes, and not
// scaled: localGetSupportingVertex.
LIB float4 supportPoint(Shape shape, ItemForm form, QueryShapes q, float4 direction) {
  if (isBoxToRays(shape)) {
    return vec3(direction.x >= 0.0f ? shape.extents.x : -shape.extents.x,
                direction.y >= 0.0f ? shape.extents.y : -shape.extents.y,
                direction.z >= 0.0f ? shape.extents.z : -shape.extents.z);
  }
  float4 point = vec3(0.0f, 0.0f, 0.0f);
  float margin = shape.margin;
  if (form.sphereCount > 0) {
    point = spheresSupportPoint(form, q.spheres, direction);
    margin = q.spheres[form.firstSphere - 1].w;
  } else if (shape.type == SHAPE_CAPSULE) {
    // Bullet takes a short direction for that of the x axis.
    const int isBehind = lengthSqr3(direction) >= 1e-4f && dot3(shape.extents, direction) < 0.0f;
    point = isBehind ? -xyz(shape.extents) : xyz(shape.extents);
  } else if (shape.type == SHAPE_HULL) {
    point = hullSupport(shape, q.hullVertices, direction);
  } else if (shape.type == SHAPE_CYLINDER || shape.type == SHAPE_CONE) {
    point = rimSupport(shape, direction);
  }
  if (margin == 0.0f) return point;
  if (lengthSqr3(direction) < BTGPU_EPSILON * BTGPU_EPSILON) direction = vec3(-1.0f, -1.0f, -1.0f);
  return point + direction * (1.0f / length3(direction)) * margin;
}

// Who asks with these filters meets an item; `ignored`: position of an object that it passes through.
LIB int mayMeet(int filterGroup, int filterMask, uint ignored, BodyInfo info) {
  return (info.filterGroup & filterMask) != 0 && (filterGroup & info.filterMask) != 0 &&
         (uint)info.uniqueId != ignored;
}

BTGPU_END
#endif
