// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Axis-aligned bounding boxes, collision filters and Morton codes.
#ifndef BTGPU_LIB_BOUNDS_H
#define BTGPU_LIB_BOUNDS_H
#include "../shared/body.h"
#include "../shared/shape.h"
#include "motion.h"
#include "vec.h"

BTGPU_BEGIN

#define MOVING_AABB_LIMIT_SQR 1e12f  // squared diagonal beyond which Bullet takes a moving body out of the world
#define MORTON_BITS 16               // per axis
#define PAIR_SORT_BIT (3 * MORTON_BITS)  // the lower one of two that say in which of four groups a body is sorted

// Of a body whose size along each axis is `reach`, about a point.
LIB Aabb aabbAround(float4 point, float4 reach) {
  Aabb box;
  box.lower = point - reach;
  box.upper = point + reach;
  return box;
}

LIB Aabb mergeAabb(Aabb a, Aabb b) {
  Aabb m;
  m.lower = fmin(a.lower, b.lower);
  m.upper = fmax(a.upper, b.upper);
  return m;
}

// Of a circle around a unit axis. Not the root of 1 - up.y^2, of which nothing is left where it stands.
LIB float4 circleReach(float4 up, float radius) {
  return vec3(sqrt(up.y * up.y + up.z * up.z), sqrt(up.x * up.x + up.z * up.z), sqrt(up.x * up.x + up.y * up.y)) *
         radius;
}

// How far a shape without its margin, turned but not moved, reaches along the axes: btUniformScalingShape::getAabb and
// btConvexInternalShape::getAabbSlow ask for its farthest points. `vertices`: those of all hulls.
LIB Aabb coreAabb(Shape shape, Matrix3 r, __global const float4* vertices) {
  if (shape.type == SHAPE_CYLINDER || shape.type == SHAPE_CONE) {
    const float4 up = matrixColumn(r, shape.variant), end = up * shape.halfLength;
    const float4 rim = circleReach(up, shape.radius), none = vec3(0.0f, 0.0f, 0.0f);
    return mergeAabb(aabbAround(end, shape.type == SHAPE_CONE ? none : rim), aabbAround(-end, rim));
  }
  const int spheres = shape.type == SHAPE_MULTI_SPHERE;
  float4 stretched = vec3(0.0f, 0.0f, 0.0f);  // of a sphere of radius 1
  if (spheres) {
    const float4 s = vertices[shape.firstVertex + shape.vertexCount];
    stretched = vec3(length3(scale3(s, r.row0)), length3(scale3(s, r.row1)), length3(scale3(s, r.row2)));
  }
  Aabb box;
  for (int i = 0; i < shape.vertexCount; ++i) {
    const float4 v = vertices[shape.firstVertex + i];
    const Aabb of = aabbAround(mulMatrix(r, xyz(v)), spheres ? stretched * v.w : stretched);
    box = i == 0 ? of : mergeAabb(box, of);
  }
  return box;
}

LIB Aabb shapeAabb(Shape shape, BodyPose pose, __global const float4* vertices) {
  float4 extent = vec3(BTGPU_LARGE, BTGPU_LARGE, BTGPU_LARGE);
  float4 centre = pose.position;
  if (shape.type == SHAPE_SPHERE) {
    extent = vec3(shape.extents.x, shape.extents.x, shape.extents.x);
  } else if (shape.type == SHAPE_BOX) {
    const Matrix3 r = matrixFromQuaternion(pose.orientation);
    extent =
        vec3(dot3(abs3(r.row0), shape.extents), dot3(abs3(r.row1), shape.extents), dot3(abs3(r.row2), shape.extents));
  } else if (shape.boundsMargins > 0) {
    const float4 margins = vec3(1.0f, 1.0f, 1.0f) * (shape.margin * (float)shape.boundsMargins);
    Aabb box = coreAabb(shape, matrixFromQuaternion(pose.orientation), vertices);
    box.lower = xyz(centre) + (box.lower - margins);
    box.upper = xyz(centre) + (box.upper + margins);
    return box;
  } else if (shape.type != SHAPE_PLANE) {
    // btCapsuleShape::getAabb, btPolyhedralConvexAabbCachingShape::getAabb, btCylinderShape::getAabb,
    // btCompoundShape::getAabb, btTriangleMeshShape::getAabb: of the box around the shape in its own axes.
    const Matrix3 r = matrixFromQuaternion(pose.orientation);
    const float radius = shape.type == SHAPE_CAPSULE ? shape.margin : 0.0f;
    const float4 reach = shape.extents + vec3(radius, radius, radius);
    extent = vec3(dot3(abs3(r.row0), reach), dot3(abs3(r.row1), reach), dot3(abs3(r.row2), reach));
    centre = xyz(centre) + mulMatrix(r, shape.centre);
  } else {
    centre = vec3(0.0f, 0.0f, 0.0f);  // a plane has no bounds
  }
  Aabb box;
  box.lower = centre - extent;
  box.upper = centre + extent;
  return box;
}

LIB int overlapAabb(Aabb a, Aabb b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y && b.lower.y <= a.upper.y &&
         a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}

// An AABB that overlaps nothing, not even itself.
LIB Aabb emptyAabb(void) {
  Aabb m;
  m.lower = vec3(INFINITY, INFINITY, INFINITY);
  m.upper = vec3(-INFINITY, -INFINITY, -INFINITY);
  return m;
}

// Takes part in pair finding at all.
LIB int isCollidable(BodyInfo body) {
  return (body.flags & BODY_PRESENT) && !(body.flags & BODY_QUARANTINED) && body.shapeIndex >= 0;
}

// The body that a slot belongs to: that of the compound, where it holds one of a compound's shapes.
LIB uint ownerOf(BodyInfo info, uint slot) { return info.flags & BODY_CHILD ? info.parent : slot; }

// Bullet's broadphase filter. Of compounds it is the shapes that meet others, but not each other. As a whole a compound
// that moves meets only what else moves: in Bullet bodies whose AABBs overlap are of one island. Two
// bodies that cannot move are let through as well when the filters say so: that is what stock does, and the narrowphase
// sorts them out.
LIB int filtersMatch(BodyInfo a, BodyInfo b) {
  const uint either = a.flags | b.flags;
  if ((a.flags & b.flags & BODY_CHILD) && a.parent == b.parent) return 0;
  if ((either & BODY_COMPOUND) && (either & (BODY_CHILD | BODY_STATIC | BODY_KINEMATIC))) return 0;
  return (a.filterGroup & b.filterMask) != 0 && (b.filterGroup & a.filterMask) != 0;
}

// What filtersMatch() asks an item for besides groups and masks: its kind, and the kinds that it may form pairs with.
#define ITEM_CHILD 1u       // a shape of a compound
#define ITEM_COMPOUND 2u    // a compound that moves, as a whole
#define ITEM_BODY 4u        // anything else that moves,
#define ITEM_FIXED_BODY 8u  // or does not

// 0: forms no pair.
LIB uint itemKind(BodyInfo body) {
  const uint fixed = body.flags & (BODY_STATIC | BODY_KINEMATIC);
  if (!isCollidable(body)) return 0;
  if (body.flags & BODY_COMPOUND) return fixed ? 0 : ITEM_COMPOUND;
  if (body.flags & BODY_CHILD) return ITEM_CHILD;
  return fixed ? ITEM_FIXED_BODY : ITEM_BODY;
}
LIB uint kindsToMeet(uint kind) {
  return (kind & (ITEM_CHILD | ITEM_FIXED_BODY) ? ITEM_CHILD | ITEM_BODY | ITEM_FIXED_BODY : 0u) |
         (kind & ITEM_COMPOUND ? ITEM_COMPOUND | ITEM_BODY : 0u) |
         (kind & ITEM_BODY ? ITEM_CHILD | ITEM_COMPOUND | ITEM_BODY | ITEM_FIXED_BODY : 0u);
}

// Spreads the low 16 bits of v to every third bit.
LIB ulong spreadBits3(ulong v) {
  v &= 0xffffUL;
  v = (v | (v << 16)) & 0x0000ff0000ffUL;
  v = (v | (v << 8)) & 0x00f00f00f00fUL;
  v = (v | (v << 4)) & 0x0c30c30c30c3UL;
  return (v | (v << 2)) & 0x249249249249UL;
}

LIB ulong mortonAxis(float value, float lower, float inverseExtent) {
  const float cell = (value - lower) * inverseExtent * 65536.0f;
  return (ulong)clamp(cell, 0.0f, 65535.0f);
}

// Morton code of a point in the box `scene`: 16 bits an axis.
LIB ulong mortonCode(float4 p, Aabb scene) {
  const float4 extent = scene.upper - scene.lower;
  const float ix = extent.x > 0.0f ? 1.0f / extent.x : 0.0f;
  const float iy = extent.y > 0.0f ? 1.0f / extent.y : 0.0f;
  const float iz = extent.z > 0.0f ? 1.0f / extent.z : 0.0f;
  return spreadBits3(mortonAxis(p.x, scene.lower.x, ix)) | (spreadBits3(mortonAxis(p.y, scene.lower.y, iy)) << 1) |
         (spreadBits3(mortonAxis(p.z, scene.lower.z, iz)) << 2);
}

BTGPU_END
#endif
