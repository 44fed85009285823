// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Collision shapes and the kinds of pairs that they form.
#ifndef BTGPU_SHARED_SHAPE_H
#define BTGPU_SHARED_SHAPE_H
#include "types.h"

BTGPU_BEGIN

#define SHAPE_NONE 0  // takes part in nothing
#define SHAPE_SPHERE 1
#define SHAPE_BOX 2
#define SHAPE_PLANE 3
#define SHAPE_CAPSULE 4
#define SHAPE_HULL 5
#define SHAPE_CYLINDER 6
#define SHAPE_CONE 7
#define SHAPE_MULTI_SPHERE 8
#define SHAPE_SUM 9        // of several convex shapes (btMinkowskiSumShape), one of them round
#define SHAPE_COMPOUND 10  // of a body whose shapes have slots of their own (BODY_CHILD); collides with nothing itself
#define SHAPE_MESH 12  // triangles, any number: mesh.h
#define SHAPE_HOST 16  // a shape that the device lacks: its AABB and its contacts come from the host

// Bits of Shape.variant.
#define HULL_POLYHEDRAL 1  // with Bullet's polyhedral features: two such collide without margins
#define HULL_TRIANGLE 2    // btTriangleShape: spheres collide with it without its margin
#define HULL_BOX 4         // a flat or scaled box: to planes, and to them alone, it has its corners

// The terms of a SHAPE_SUM lie one after the other among the vertices. First of all: how far the sum is from where
// they put it. Of each a head: how it is turned (a quaternion); SHAPE_CYLINDER or SHAPE_CONE, axis, radius and half
// length, or SHAPE_MULTI_SPHERE and how many spheres, which follow as in such a shape. Margins are the sum's.
#define SUM_HEAD 2

#define HULL_PADDING 15  // BTGPU_WIDE - 1

STRUCT(Shape) {
  int type;                 // SHAPE_*
  float margin;             // Bullet's collision margin; a sphere's and a capsule's is its radius
  float breakingThreshold;  // length: a contact is dropped when its points are farther apart
  int variant;  // cylinder, cone: the axis, 0 to 2; hull, box: HULL_*; compound: COMPOUND_*
  // Box: half extents with margin; sphere: x = radius; plane: xyz = normal, w = constant; capsule: half of the inner
  // segment along its axis, zero along the others; all others: half extents of its AABB in its own axes, as Bullet has
  // it.
  float4 extents;
  float4 centre;  // hull, multi-sphere, compound, mesh: centre of that AABB; w = 0
  // Hull: its part of the arrays of all hulls. Vertices lie without the margin; after the last one of all hulls there
  // are HULL_PADDING more, which may be read. Multi-sphere: the spheres' centres, w: what the radius is larger than the
  // margin; then, not counted, how far these spheres are stretched along the shape's axes. Sum: all that there is of
  // its terms, all counted (SUM_*).
  int firstVertex, vertexCount, firstFace, faceCount, firstEdge, edgeCount;
  // Cylinder, cone: of the core. A cone's tip is at +halfLength, which may be below zero.
  float radius, halfLength;
  // All but spheres and planes: 0 where Bullet bounds it by the box around it in its own axes, else it asks for the
  // farthest points of the core, and adds the margin so many times.
  int boundsMargins;
  int unused[3];
};

// Faces and edges of a hull, in its own axes. What has no volume has faces too, so that every direction in which two
// such things may leave each other is one of a face: a polygon has two, a segment six around its line and at its
// ends, a point six.
STRUCT(HullFace) {
  float4 plane;               // xyz: unit normal, outward; w: where it lies along the normal
  int firstCorner;            // in the array of corners
  int cornerCount;            // any number; 2 or 1 for the faces of a segment or a point
  int unused[2];
};

// The edge's outward normals lie on the shorter arc between two: those of its faces. The edge of a polygon is listed
// twice, a segment four times, since the arcs of their normals are longer.
STRUCT(HullEdge) {
  float4 normalA, normalB;  // unit; w = 0
  int from, to;             // vertices, counted from the hull's first
  int unused[2];
};

// A pair's bucket says which algorithm finds its contacts.
#define BUCKET_CARRY 0  // both bodies inactive: last step's manifold is kept as it is
#define BUCKET_SPHERE_SPHERE 1
#define BUCKET_SPHERE_PLANE 2
#define BUCKET_BOX_PLANE 3
#define BUCKET_SPHERE_BOX 4
#define BUCKET_BOX_BOX 5
#define BUCKET_CAPSULES 6  // a capsule and a capsule or sphere
#define BUCKET_CAPSULE_PLANE 7
#define BUCKET_HULL_PLANE 8
#define BUCKET_CAPSULE_BOX 9  // from here to BUCKET_CURVED: by closest features, with faces clipped
#define BUCKET_SPHERE_HULL 10
#define BUCKET_CAPSULE_HULL 11
#define BUCKET_BOX_HULL 12
#define BUCKET_HULL_HULL 13
#define BUCKET_CURVED 14        // likewise: a cylinder, cone, multi-sphere or sum and anything but a plane
#define BUCKET_CURVED_PLANE 15  // one of them and a plane
#define BUCKET_MESH 16  // any of the others but a plane, and a mesh
#define BUCKET_NONE 17  // no contacts can arise (two planes)
#define BUCKET_HOST 18  // the host finds the contacts
#define BUCKET_COUNT 19

#define BUCKET_FIRST_CONVEX BUCKET_CAPSULE_BOX
#define BUCKET_LAST_CONVEX BUCKET_CURVED

BTGPU_END
#endif
