// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A convex shape on its way to a place, against one that stays where it is: conservative advancement, as
// btContinuousConvexCollision has it. How far the two are apart, over the speed at which that can shrink, is a part of
// the way on which they don't meet; and so on until they are SWEEP_NEAR apart. The distances are those of stages 44 and
// 47, GJK's, and where cores overlap at the start, the shortest way out.
#ifndef BTGPU_LIB_CONVEX_SWEEP_H
#define BTGPU_LIB_CONVEX_SWEEP_H
#ifndef BTGPU_TRIANGLE_CORES
#error "a sweep meets triangles: define BTGPU_TRIANGLE_CORES before all includes"
#endif
#include "bounds.h"
#include "closest_points.h"
#include "ray_mesh.h"

BTGPU_BEGIN

#define SWEEP_NEAR 0.001f     // length, as in Bullet: so far before the surface sweeps end
#define SWEEP_ITERATIONS 64

// Where it is after a part of its way.
STRUCT(SweepPlace) {
  float4 position;
  Matrix3 rotation;
};

LIB SweepPlace placeOnWay(Sweep s, float fraction) {
  BodyPose pose;
  pose.position = s.from;
  pose.orientation = s.orientation;
  pose = integratePose(pose, xyz(s.to - s.from), xyz(s.turn), fraction);
  SweepPlace place;
  place.position = pose.position;
  place.rotation = matrixFromQuaternion(pose.orientation);
  return place;
}

// What it meets: a shape in its place, or a triangle of a mesh, in world axes.
STRUCT(SweepTarget) {
  Shape shape;
  ItemPose pose;
  float4 a, b, c;
  int isTriangle;
};

STRUCT(SweepGap) {
  float4 normal;  // unit, world axes, towards the shape that moves; w: distance, below zero inside
  float4 point;   // on what it meets; w = 0
};

LIB SweepGap gapToPlane(Shape shape, SweepPlace at, SweepTarget target, Hulls hulls) {
  const Matrix3 r = rotationOf(target.pose);
  const float4 normal = mulMatrix(r, target.shape.extents), down = -mulTransposed(at.rotation, normal);
  const float4 lowest = at.position + mulMatrix(at.rotation, lowestPoint(shape, hulls, down));
  const float distance = dot3(lowest - placeOf(target.pose), normal) - target.shape.extents.w;
  SweepGap gap;
  gap.normal = withW(normal, distance);
  gap.point = xyz(lowest - normal * distance);
  return gap;
}

// Stock's sweeps know nothing of polyhedral features, nor of what spheres and triangles have to themselves.
LIB Shape withMargin(Shape shape) {
  if (shape.type == SHAPE_HULL || shape.type == SHAPE_BOX) shape.variant &= ~(HULL_POLYHEDRAL | HULL_TRIANGLE);
  return shape;
}

LIB CorePair coresOfSweep(Shape shape, SweepPlace at, SweepTarget target) {
  shape = withMargin(shape);
  target.shape = withMargin(target.shape);
  if (!target.isTriangle) {
    return corePairOf(shape, target.shape, at.rotation, rotationOf(target.pose), placeOf(target.pose) - at.position);
  }
  CorePair pair;
  const Triangle t = makeTriangle(mulTransposed(at.rotation, target.a - at.position),
                                  mulTransposed(at.rotation, target.b - at.position),
                                  mulTransposed(at.rotation, target.c - at.position));
  pair.a = coreOf(shape);
  pair.b = triangleCore(t, target.shape.margin);
  pair.turn.row0 = vec3(1.0f, 0.0f, 0.0f);
  pair.turn.row1 = vec3(0.0f, 1.0f, 0.0f);
  pair.turn.row2 = vec3(0.0f, 0.0f, 1.0f);
  pair.offset = vec3(0.0f, 0.0f, 0.0f);
  pair.size = length3(shape.centre) + length3(pair.a.extents) + t.size;
  return pair;
}

// 0 if they are farther apart than `limit`. `start`: about the direction to what it meets, in the shape's axes.
LIB int gapBetween(Shape shape, SweepPlace at, SweepTarget target, Hulls hulls, float limit, REF(float4) start,
                   REF(SweepGap) gap) {
  if (!target.isTriangle && target.shape.type == SHAPE_PLANE) {
    *gap = gapToPlane(shape, at, target, hulls);
    return 1;
  }
  const CorePair pair = coresOfSweep(shape, at, target);
  const float margins = pair.a.margin + pair.b.margin;
  ClosestFeatures found;
  if (!closestOfPair(pair, hulls, *start, limit + margins, &found)) return 0;
  *start = xyz(found.normal);
  gap->normal = withW(-mulMatrix(at.rotation, found.normal), found.normal.w - margins);
  gap->point = xyz(at.position + mulMatrix(at.rotation, found.onB - found.normal * pair.b.margin));
  return 1;
}

// 1 if it is met before, or at, `best`.
LIB int sweepAgainst(Sweep s, Shape shape, SweepTarget target, Hulls hulls, float best, REF(SweepHit) hit) {
  const float4 along = xyz(s.to - s.from);
  const float speed = length3(along) + s.turn.w;
  SweepPlace at = placeOnWay(s, 0.0f);
  float4 middle = target.isTriangle ? (target.a + target.b + target.c) / 3.0f : placeOf(target.pose);
  float4 start = mulTransposed(at.rotation, middle - at.position);
  if (!(lengthSqr3(start) > 0.0f)) start = vec3(1.0f, 0.0f, 0.0f);
  SweepGap gap;
  float fraction = 0.0f;
  for (int n = 0;; ++n) {
    at = placeOnWay(s, fraction);
    if (!gapBetween(shape, at, target, hulls, speed * (best - fraction) + 2.0f * SWEEP_NEAR, &start, &gap)) return 0;
    const float distance = gap.normal.w + s.allowedPenetration;
    const float closing = s.turn.w - dot3(along, gap.normal);
    if ((n == 0 || distance > SWEEP_NEAR) && !(closing > BTGPU_EPSILON)) return 0;  // it moves away
    if (!(distance > SWEEP_NEAR)) break;
    if (n == SWEEP_ITERATIONS) return 0;
    const float next = fraction + distance / closing;
    if (!(next > fraction) || next > best) return 0;
    fraction = next;
  }
  hit->normal = withW(gap.normal, fraction);
  hit->point = gap.point;
  return fraction < 1.0f;
}

// What batched sweeps meet.
STRUCT(SweepShapes) {
  __global const Shape* shapes;
  Hulls hulls;
  __global const Mesh* meshes;
  __global const MeshNode* meshNodes;
  __global const MeshTriangle* meshTriangles;
};

LIB SweepShapes sweepShapes(__global const Shape* shapes, Hulls hulls, __global const Mesh* meshes,
                            __global const MeshNode* meshNodes, __global const MeshTriangle* meshTriangles) {
  SweepShapes q;
  q.shapes = shapes;
  q.hulls = hulls;
  q.meshes = meshes;
  q.meshNodes = meshNodes;
  q.meshTriangles = meshTriangles;
  return q;
}

LIB SweepTarget triangleTarget(MeshTriangle t, ItemPose pose, Shape mesh) {
  SweepTarget target;
  target.shape = mesh;
  target.isTriangle = 1;
  target.pose = pose;
  const float4 origin = originOf(pose);
  target.a = toWorldPoint(pose, origin, t.a);
  target.b = toWorldPoint(pose, origin, t.b);
  target.c = toWorldPoint(pose, origin, t.c);
  return target;
}

// The bounds around its place, in a mesh's axes, and as far around them as the mesh's margin and SWEEP_NEAR reach.
LIB Aabb sweepBoxInMesh(Sweep s, ItemPose pose, float margin) {
  const float grown = margin + SWEEP_NEAR;
  const float4 half_ = (s.upper - s.lower) * 0.5f + vec3(grown, grown, grown);
  const float4 middle = toLocalDirection(pose, (s.upper + s.lower) * 0.5f);
  const float4 reach = xyz(abs3(pose.row0) * half_.x + abs3(pose.row1) * half_.y + abs3(pose.row2) * half_.z);
  Aabb box;
  box.lower = middle - reach;
  box.upper = middle + reach;
  return box;
}

LIB SweepTarget shapeTarget(Shape shape, ItemPose pose) {
  SweepTarget target;
  target.shape = shape;
  target.isTriangle = 0;
  target.pose = pose;
  target.a = target.b = target.c = vec3(0.0f, 0.0f, 0.0f);
  return target;
}

LIB void startAtTriangles(REF(MeshWalk) walk, REF(Way) way, Sweep s, Shape meshShape, ItemPose pose, SweepShapes q,
                          float best) {
  const Mesh mesh = q.meshes[meshShape.firstVertex];
  const float4 from = toLocalDirection(pose, s.from - originOf(pose));
  const float4 to = toLocalDirection(pose, s.to - originOf(pose));
  const Aabb box = sweepBoxInMesh(s, pose, meshShape.margin);
  *way = wayInGrid(mesh, from, to, box.lower, box.upper);
  startAtMesh(walk, mesh, q.meshNodes, *way, best);
}

// 1 if the shape, or one of a mesh's triangles, is met at `best` or before; of several triangles at the same fraction the
// one with the lowest index. The only place that asks sweepAgainst: compilers for GPUs make a copy of it for each, and
// take minutes.
LIB int sweepAgainstShape(Sweep s, Shape shape, Shape target, ItemPose pose, SweepShapes q, float best,
                          REF(SweepHit) hit) {
  const int isMesh = target.type == SHAPE_MESH;
  MeshWalk walk;
  Way way;
  if (isMesh) startAtTriangles(&walk, &way, s, target, pose, q, best);
  SweepTarget at = shapeTarget(target, pose);
  int found = -1, link = 0;
  do {
    if (isMesh) {
      link = nextTriangle(&walk, q.meshNodes, way, best);
      if (link < 0) break;
      at = triangleTarget(q.meshTriangles[q.meshes[target.firstVertex].firstTriangle + link], pose, target);
    }
    SweepHit there = *hit;
    if (!sweepAgainst(s, shape, at, q.hulls, best, &there)) continue;
    if (!(there.normal.w < best || found < 0 || link < found)) continue;
    found = link;
    best = there.normal.w;
    *hit = there;
  } while (isMesh);
  return found >= 0;
}

// Whether a child of a compound is asked at all.
LIB int sweepMeetsChild(CompoundChild child, Sweep s) {
  return enterOnWay(child.objectAabb, wayOfBox(s.from, s.to, s.lower, s.upper), 1.0f) <= 1.0f;
}

LIB int sweepMayHit(Sweep s, BodyInfo info) {
  return mayMeet(s.filterGroup, s.filterMask, s.ignored, info);
}

LIB SweepHit noSweepHit(void) {
  SweepHit hit;
  hit.normal = F4(0.0f, 0.0f, 0.0f, 1.0f);
  hit.point = vec3(0.0f, 0.0f, 0.0f);
  hit.object = NO_INDEX;
  hit.unused[0] = hit.unused[1] = hit.unused[2] = 0;
  return hit;
}

LIB int isBetterSweepHit(SweepHit hit, SweepHit best) {
  return hit.normal.w < best.normal.w || (hit.normal.w == best.normal.w && hit.object < best.object);
}

BTGPU_END
#endif
