// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Convex shapes as Bullet's convex algorithms see them: a core (point, segment, box, hull, cylinder, cone, spheres) with
// a margin around it. Here the distance of two cores that do not overlap: GJK, for those that have vertices; the others'
// is in curved.h. All in A's axes, from A's position.
//
// A sphere's and a capsule's core is kept as a box with three or two extents of zero, so that all but the hull are
// one case: 8 vertices (bit k of the index: the positive end along axis k), 6 faces, 12 edges.
#ifndef BTGPU_LIB_CONVEX_H
#define BTGPU_LIB_CONVEX_H
#include "../shared/contact.h"
#include "../shared/shape.h"
#include "triangle.h"
#include "vec.h"
// Kernels of worlds without curved shapes are built without what these need.
#if defined(__OPENCL_C_VERSION__) && !defined(BTGPU_CURVED)
#define IS_CURVED(core) 0
#else
#define IS_CURVED(core) ((core).curved != 0)
#endif
#if defined(__OPENCL_C_VERSION__) && defined(BTGPU_SHAPE_CPU)
#include "support_wide.h"
#define BTGPU_WIDE_SUPPORT
#define LIB_INLINED WIDE  // a call would cost a tenth of stage 44
#else
#define LIB_INLINED LIB
#endif

BTGPU_BEGIN

#define GJK_ITERATIONS 64
#define GJK_ACCURACY 1e-7f  // of the squared distance
#define GJK_STALLS 4              // steps that may bring no nearer point
#define GJK_STALL_GAP 1e-4f       // ... where the bound is farther below the distance, both squared, than this share
#define GJK_STALL_LENGTH 1.000001f
#define CORES_TOUCH 1e-5f   // of the pair's size: nearer cores give no direction in float
#define FACE_AS_GOOD 1e-6f  // of the pair's size: a face's axis is taken if it separates the cores as far as this
#define NEARLY_FACE 0.999f  // cosine between the axis found and a face's that may replace it
#define LIKELY_FACE 0.99f   // ... between the axis to begin with and that of a face worth a look

// The arrays of all hulls.
STRUCT(Hulls) {
  __global const float4* vertices;
  __global const HullFace* faces;
  __global const uint* corners;
  __global const HullEdge* edges;
};
LIB Hulls hullsOf(__global const float4* vertices, __global const HullFace* faces, __global const uint* corners,
                  __global const HullEdge* edges) {
  Hulls h;
  h.vertices = vertices;
  h.faces = faces;
  h.corners = corners;
  h.edges = edges;
  return h;
}

// Kernels for meshes have cores that are triangles as well, the others nothing of that.
#ifdef BTGPU_TRIANGLE_CORES
#define IF_TRIANGLE(core, statement) \
  if ((core).isTriangle) statement
#else
#define IF_TRIANGLE(core, statement)
#endif

STRUCT(Core) {
  int curved;  // SHAPE_* of a cylinder, cone, multi-sphere or sum, else 0
#ifdef BTGPU_TRIANGLE_CORES
  Triangle triangle;
  int isTriangle;
#endif
  int isHull;
  int isPolytope;  // has faces that others can rest on
  float4 extents;  // half extents if it is not a hull, else of its AABB
  int firstVertex, vertexCount, firstFace, faceCount, firstEdge, edgeCount;
  float margin;
  // Of a cylinder or cone.
  int axis;
  float radius, halfLength;
  float4 facing;  // of what is curved, when faces are asked for: the direction that they are to look along
};

STRUCT(CorePair) {
  Core a, b;
  Matrix3 turn;   // B's axes to A's
  float4 offset;  // B's position
  float size;     // of both together: what rounding errors are in proportion to
};

LIB int isCurvedShape(int type) {
  return type == SHAPE_CYLINDER || type == SHAPE_CONE || type == SHAPE_MULTI_SPHERE || type == SHAPE_SUM;
}

LIB Core coreOf(Shape shape) {
  Core core;
  core.curved = isCurvedShape(shape.type) ? shape.type : 0;
  core.axis = shape.variant;
  core.radius = shape.radius;
  core.halfLength = shape.halfLength;
  core.facing = vec3(1.0f, 0.0f, 0.0f);
#ifdef BTGPU_TRIANGLE_CORES
  core.isTriangle = 0;
#endif
  core.isHull = shape.type == SHAPE_HULL;
  core.isPolytope =
      core.isHull || shape.type == SHAPE_BOX || shape.type == SHAPE_CYLINDER || shape.type == SHAPE_CONE;
  core.extents = vec3(0.0f, 0.0f, 0.0f);
  core.margin = shape.margin;
  if (shape.type == SHAPE_BOX) {
    core.extents = fmax(xyz(shape.extents) - vec3(core.margin, core.margin, core.margin), core.extents);
  } else if (shape.type != SHAPE_SPHERE) {
    core.extents = xyz(shape.extents);
  }
  core.firstVertex = shape.firstVertex;
  core.vertexCount =
      core.isHull || shape.type == SHAPE_MULTI_SPHERE || shape.type == SHAPE_SUM ? shape.vertexCount : 8;
  core.firstFace = shape.firstFace;
  core.faceCount = core.isHull ? shape.faceCount : 6;
  core.firstEdge = shape.firstEdge;
  core.edgeCount = core.isHull ? shape.edgeCount : 12;
  return core;
}

LIB int hasVariant(Shape s, int bit) { return (s.type == SHAPE_HULL || s.type == SHAPE_BOX) && (s.variant & bit); }
#ifdef BTGPU_TRIANGLE_CORES
LIB Core triangleCore(Triangle triangle, float margin) {
  Core core;
  core.triangle = triangle;
  core.isTriangle = core.isPolytope = 1;
  core.isHull = core.curved = core.axis = 0;
  core.radius = core.halfLength = 0.0f;
  core.facing = vec3(1.0f, 0.0f, 0.0f);
  // Nothing but its length counts: that of a point is zero.
  core.extents = vec3(triangle.size, 0.0f, 0.0f);
  core.firstVertex = core.firstFace = core.firstEdge = 0;
  core.vertexCount = 3;
  core.faceCount = 2;
  core.edgeCount = 6;
  core.margin = margin;
  return core;
}
#endif

// Where Bullet leaves margins out: btPolyhedralContactClipping, SphereTriangleDetector.
LIB void fitMargins(REF(Shape) a, REF(Shape) b) {
  if (hasVariant(*a, HULL_POLYHEDRAL) && hasVariant(*b, HULL_POLYHEDRAL)) a->margin = b->margin = 0.0f;
  if (a->type == SHAPE_SPHERE && hasVariant(*b, HULL_TRIANGLE)) b->margin = 0.0f;
  if (b->type == SHAPE_SPHERE && hasVariant(*a, HULL_TRIANGLE)) a->margin = 0.0f;
}

LIB CorePair corePairOf(Shape a, Shape b, Matrix3 ra, Matrix3 rb, float4 bFromA) {
  CorePair pair;
  fitMargins(&a, &b);
  pair.a = coreOf(a);
  pair.b = coreOf(b);
  pair.turn.row0 = mulTransposed(rb, matrixColumn(ra, 0));
  pair.turn.row1 = mulTransposed(rb, matrixColumn(ra, 1));
  pair.turn.row2 = mulTransposed(rb, matrixColumn(ra, 2));
  pair.offset = mulTransposed(ra, bFromA);
  // Of two cores that touch; a distance beyond that is not counted.
  pair.size = length3(a.centre) + length3(pair.a.extents) + length3(b.centre) + length3(pair.b.extents);
  return pair;
}

LIB float4 boxVertex(float4 extents, int i) {
  return vec3(i & 1 ? extents.x : -extents.x, i & 2 ? extents.y : -extents.y, i & 4 ? extents.z : -extents.z);
}

LIB float4 coreVertex(Core core, Hulls hulls, int i) {
  IF_TRIANGLE(core, return triangleCorner(core.triangle, i);)
  if (core.isHull) return hulls.vertices[core.firstVertex + i];
  return boxVertex(core.extents, i);
}

// Index of the vertex farthest along the direction, in the core's own axes. Of a point or a segment always the same
// one of the vertices that fall together.
LIB int coreSupport(Core core, Hulls hulls, float4 direction) {
  IF_TRIANGLE(core, return triangleSupport(core.triangle, direction);)
  if (!core.isHull) {
    return (direction.x > 0.0f && core.extents.x > 0.0f ? 1 : 0) |
           (direction.y > 0.0f && core.extents.y > 0.0f ? 2 : 0) |
           (direction.z > 0.0f && core.extents.z > 0.0f ? 4 : 0);
  }
#ifdef BTGPU_WIDE_SUPPORT
  return farthestVertexWide(hulls.vertices + core.firstVertex, core.vertexCount, direction);
#else
  int best = 0;
  float farthest = dot3(hulls.vertices[core.firstVertex], direction);
  for (int i = 1; i < core.vertexCount; ++i) {
    const float along = dot3(hulls.vertices[core.firstVertex + i], direction);
    if (along > farthest) {
      farthest = along;
      best = i;
    }
  }
  return best;
#endif
}

// A cylinder's or cone's point farthest along the direction. At its centre a cap's point is any.
LIB float4 roundSupport(Core core, float4 direction) {
  const float4 up = unitVector(core.axis);
  const float along = dot3(direction, up);
  const float4 across = xyz(direction) - up * along;
  const float size = length3(across);
  const float4 rim = across * (size > 0.0f ? core.radius / size : 0.0f);
  if (core.curved == SHAPE_CYLINDER) return rim + up * (along < 0.0f ? -core.halfLength : core.halfLength);
  // The tip against the rim of the base.
  if (along * core.halfLength > size * core.radius - along * core.halfLength) return up * core.halfLength;
  return rim - up * core.halfLength;
}

// Of spheres: the point farthest along the direction.
LIB float4 spheresSupport(Core core, Hulls hulls, float4 direction) {
  const float4 stretch = hulls.vertices[core.firstVertex + core.vertexCount];
  const float4 stretched = scale3(stretch, direction);
  const float size = length3(stretched);
  const float4 outward = size > 0.0f ? scale3(stretch, stretched) / size : vec3(0.0f, 0.0f, 0.0f);
  float4 best = vec3(0.0f, 0.0f, 0.0f);
  float farthest = -INFINITY;
  for (int i = 0; i < core.vertexCount; ++i) {
    const float4 sphere = hulls.vertices[core.firstVertex + i];
    const float along = dot3(sphere, direction) + sphere.w * size;
    if (!(along > farthest)) continue;
    farthest = along;
    best = xyz(sphere) + outward * sphere.w;
  }
  return best;
}

// Of a sum: the points of its terms together.
LIB float4 sumSupport(Core core, Hulls hulls, float4 direction) {
  const int end = core.firstVertex + core.vertexCount;
  float4 sum = hulls.vertices[core.firstVertex];
  for (int v = core.firstVertex + 1; v < end;) {
    const float4 turn = hulls.vertices[v], head = hulls.vertices[v + 1], inTerm = rotateInverse(turn, direction);
    Core term = core;
    term.curved = (int)head.x;
    v += SUM_HEAD;
    if (term.curved == SHAPE_MULTI_SPHERE) {
      term.firstVertex = v;
      term.vertexCount = (int)head.y;
      sum += rotate(turn, spheresSupport(term, hulls, inTerm));
      v += term.vertexCount + 1;
    } else {
      term.axis = (int)head.y;
      term.radius = head.z;
      term.halfLength = head.w;
      sum += rotate(turn, roundSupport(term, inTerm));
    }
  }
  return sum;
}

// A kernel in which the compiler would copy it to too many places, and take half a minute (NVIDIA's), says so before it
// includes this.
#ifdef BTGPU_SUPPORT_BY_CALL
#define SUPPORT_LIB static __attribute__((noinline))
#else
#define SUPPORT_LIB LIB
#endif

// Of any core: its point farthest along the direction, in its own axes. The one place that knows all shapes.
SUPPORT_LIB float4 coreSupportPoint(Core core, Hulls hulls, float4 direction) {
  if (IS_CURVED(core)) {
    if (core.curved == SHAPE_SUM) return sumSupport(core, hulls, direction);
    return core.curved == SHAPE_MULTI_SPHERE ? spheresSupport(core, hulls, direction) : roundSupport(core, direction);
  }
  return coreVertex(core, hulls, coreSupport(core, hulls, direction));
}

LIB float4 vertexOfB(CorePair pair, Hulls hulls, int i) {
  return pair.offset + mulMatrix(pair.turn, coreVertex(pair.b, hulls, i));
}
// The points of A and of B that lie farthest along the direction.
LIB float4 supportOfA(CorePair pair, Hulls hulls, float4 direction) {
  return coreSupportPoint(pair.a, hulls, direction);
}
LIB float4 supportOfB(CorePair pair, Hulls hulls, float4 direction) {
  return pair.offset + mulMatrix(pair.turn, coreSupportPoint(pair.b, hulls, mulTransposed(pair.turn, direction)));
}

// What curved shapes show along `facing`, as faces with corners on them: a cap, as an octagon; the line of a cylinder
// or cone that lies along a plane there; or a point.
#define PATCH_CAP 0    // of a cylinder: at -halfLength; of a cone: the base
#define PATCH_TOP 1    // of a cylinder: at +halfLength
#define PATCH_LINE 2
#define PATCH_POINT 3
#define CAP_CORNERS 8
#define PATCH_COSINE 0.995f  // as FACE_ALONG_AXIS in convex_clip.h

LIB int patchAlong(Core core, float4 direction) {
  if (core.curved == SHAPE_MULTI_SPHERE || core.curved == SHAPE_SUM) return PATCH_POINT;
  const float4 up = unitVector(core.axis);
  const float size = length3(direction), along = dot3(direction, up);
  const float across = sqrt(fmax(0.0f, size * size - along * along));
  if (core.curved == SHAPE_CYLINDER) {
    if (fabs(along) > PATCH_COSINE * size) return along < 0.0f ? PATCH_CAP : PATCH_TOP;
    return across > PATCH_COSINE * size ? PATCH_LINE : PATCH_POINT;
  }
  const float sign = core.halfLength < 0.0f ? -1.0f : 1.0f, height = 2.0f * fabs(core.halfLength);
  if (-along * sign > PATCH_COSINE * size) return PATCH_CAP;
  const float slant = sqrt(height * height + core.radius * core.radius);
  // The normal of its side leans towards the tip by radius / slant.
  return across * height + along * sign * core.radius > PATCH_COSINE * size * slant ? PATCH_LINE : PATCH_POINT;
}

LIB float4 patchCorner(Core core, Hulls hulls, int patch, int k) {
  if (patch == PATCH_POINT) return coreSupportPoint(core, hulls, core.facing);
  const float4 up = unitVector(core.axis);
  if (patch == PATCH_LINE) {
    const float4 across = core.facing - up * dot3(core.facing, up);
    const float4 rim = across * (core.radius / length3(across));
    if (core.curved == SHAPE_CONE) return k ? up * core.halfLength : xyz(rim) - up * core.halfLength;
    return xyz(rim) + up * (k ? core.halfLength : -core.halfLength);
  }
  // Anticlockwise from outside.
  const int outsideIsUp = core.curved == SHAPE_CONE ? core.halfLength < 0.0f : patch == PATCH_TOP;
  const int eighth = (outsideIsUp ? k : CAP_CORNERS - k) & 7;
  const float slanted = BTGPU_HALF_SQRT2;
  const float u = eighth == 0 ? 1.0f : eighth == 4 ? -1.0f : (eighth & 1) == 0 ? 0.0f
                  : (eighth == 1 || eighth == 7) ? slanted : -slanted;
  const float v = eighth == 2 ? 1.0f : eighth == 6 ? -1.0f : (eighth & 1) == 0 ? 0.0f
                  : eighth < 4 ? slanted : -slanted;
  return (unitVector((core.axis + 1) % 3) * u + unitVector((core.axis + 2) % 3) * v) * core.radius +
         up * (patch == PATCH_TOP ? core.halfLength : -core.halfLength);
}

LIB float4 patchPlane(Core core, Hulls hulls, int patch) {
  if (patch >= PATCH_LINE) {
    const float4 normal = normalize3(core.facing);
    return withW(normal, dot3(normal, coreSupportPoint(core, hulls, core.facing)));
  }
  const float sign = patch == PATCH_TOP || (core.curved == SHAPE_CONE && core.halfLength < 0.0f) ? 1.0f : -1.0f;
  return withW(unitVector(core.axis) * sign, fabs(core.halfLength));
}

// Outward plane of a face in the core's own axes.
LIB float4 facePlane(Core core, Hulls hulls, int face) {
  if (IS_CURVED(core)) return patchPlane(core, hulls, face);
  IF_TRIANGLE(core, return face ? -core.triangle.plane : core.triangle.plane;)
  if (core.isHull) return hulls.faces[core.firstFace + face].plane;
  const int axis = face >> 1;
  return withW(unitVector(axis) * (face & 1 ? 1.0f : -1.0f), component(core.extents, axis));
}
LIB int faceCorners(Core core, Hulls hulls, int face) {
  if (IS_CURVED(core)) return face == PATCH_POINT ? 1 : face == PATCH_LINE ? 2 : CAP_CORNERS;
  IF_TRIANGLE(core, return 3;)
  return core.isHull ? hulls.faces[core.firstFace + face].cornerCount : 4;
}
// Corner `k` of a face, anticlockwise from outside.
LIB float4 faceCorner(Core core, Hulls hulls, int face, int k) {
  if (IS_CURVED(core)) return patchCorner(core, hulls, face, k);
  IF_TRIANGLE(core, return triangleCorner(core.triangle, face ? 2 - k : k);)
  if (core.isHull) {
    const int first = hulls.faces[core.firstFace + face].firstCorner;
    return hulls.vertices[core.firstVertex + (int)hulls.corners[first + k]];
  }
  const int axis = face >> 1, positive = face & 1;
  const int u = (axis + (positive ? 1 : 2)) % 3, v = (axis + (positive ? 2 : 1)) % 3;
  return boxVertex(core.extents, positive << axis | (k == 1 || k == 2) << u | (k >= 2) << v);
}
LIB int boxFaceAlong(float4 direction) {
  const float4 size = abs3(direction);
  if (size.z > size.x && size.z > size.y) return direction.z > 0.0f ? 5 : 4;
  if (size.y > size.x) return direction.y > 0.0f ? 3 : 2;
  return direction.x > 0.0f ? 1 : 0;
}
// The face that looks most along the direction, in the core's own axes.
LIB int faceAlong(Core core, Hulls hulls, float4 direction) {
  if (IS_CURVED(core)) return patchAlong(core, direction);
  IF_TRIANGLE(core, return dot3(core.triangle.plane, direction) < 0.0f ? 1 : 0;)
  if (!core.isHull) return boxFaceAlong(direction);
  int best = 0;
  float most = -2.0f;
  for (int f = 0; f < core.faceCount; ++f) {
    const float along = dot3(facePlane(core, hulls, f), direction);
    if (along > most) {
      most = along;
      best = f;
    }
  }
  return best;
}

// Up to four vertices of the difference B - A, each with the vertices that it came from and its share in the point
// nearest to the origin.
STRUCT(Simplex) {
  float4 points[4];  // w: the share
  int a[4], b[4];
  int count;
};

// Nearest to the origin on the segment p, q; w of the result: q's share.
LIB float4 nearestOnSegment(float4 p, float4 q) {
  const float4 d = q - p;
  const float lengthSqr = dot3(d, d);
  const float along = -dot3(p, d);
  if (!(along > 0.0f)) return withW(p, 0.0f);
  if (along >= lengthSqr) return withW(q, 1.0f);
  // What remains along the segment is rounding.
  const float share = along / lengthSqr;
  const float4 v = p + d * share;
  return withW(v - d * (dot3(v, d) / lengthSqr), share);
}

// Nearest to the origin on the triangle of points i, j, k of the simplex; shares: of all four points.
LIB float4 nearestOnTriangle(const Simplex* s, int i, int j, int k, float* shares) {
  const float4 p = s->points[i], q = s->points[j], r = s->points[k];
  for (int n = 0; n < 4; ++n) shares[n] = 0.0f;
  const float4 normal = cross3(q - p, r - p);
  const float lengthSqr = dot3(normal, normal);
  const float atP = dot3(normal, cross3(q, r)), atQ = dot3(normal, cross3(r, p)), atR = dot3(normal, cross3(p, q));
  if (atP > 0.0f && atQ > 0.0f && atR > 0.0f && lengthSqr > 0.0f) {
    const float sum = atP + atQ + atR;
    shares[i] = atP / sum;
    shares[j] = atQ / sum;
    shares[k] = atR / sum;
    return normal * (dot3(normal, p) / lengthSqr);
  }
  const float4 pq = nearestOnSegment(p, q), qr = nearestOnSegment(q, r), rp = nearestOnSegment(r, p);
  const float a = lengthSqr3(pq), b = lengthSqr3(qr), c = lengthSqr3(rp);
  if (a <= b && a <= c) {
    shares[i] = 1.0f - pq.w;
    shares[j] = pq.w;
    return xyz(pq);
  }
  if (b <= c) {
    shares[j] = 1.0f - qr.w;
    shares[k] = qr.w;
    return xyz(qr);
  }
  shares[k] = 1.0f - rp.w;
  shares[i] = rp.w;
  return xyz(rp);
}

// 1 if the origin is on the other side of the plane i, j, k than point `other`, or if the four are too flat to say.
LIB int outsideFace(const Simplex* s, int i, int j, int k, int other) {
  const float4 p = s->points[i], to = s->points[other] - p;
  const float4 normal = cross3(s->points[j] - p, s->points[k] - p);
  const float height = dot3(normal, to), origin = -dot3(normal, p);
  if (height * height <= 1e-12f * lengthSqr3(normal) * lengthSqr3(to)) return 1;
  // Farther up than the fourth point is outside as well; of four points that are nearly flat it says more.
  return height > 0.0f ? origin < 0.0f || origin > height : origin > 0.0f || origin < height;
}

// Finds the point of the simplex nearest to the origin and drops the vertices without a share in it. Returns 0 if
// the origin is inside.
LIB int nearestOnSimplex(REF(Simplex) s, REF(float4) nearest) {
  float shares[4] = {1.0f, 0.0f, 0.0f, 0.0f};
  if (s->count == 1) {
    *nearest = xyz(s->points[0]);
  } else if (s->count == 2) {
    const float4 v = nearestOnSegment(s->points[0], s->points[1]);
    shares[0] = 1.0f - v.w;
    shares[1] = v.w;
    *nearest = xyz(v);
  } else if (s->count == 3) {
    *nearest = nearestOnTriangle(s, 0, 1, 2, shares);
  } else {
    float best = INFINITY;
    for (int other = 0; other < 4; ++other) {
      const int i = other == 0 ? 1 : 0, j = other <= 1 ? 2 : 1, k = other <= 2 ? 3 : 2;
      if (!outsideFace(s, i, j, k, other)) continue;
      float ofFace[4];
      const float4 v = nearestOnTriangle(s, i, j, k, ofFace);
      if (lengthSqr3(v) >= best) continue;
      best = lengthSqr3(v);
      *nearest = v;
      for (int n = 0; n < 4; ++n) shares[n] = ofFace[n];
    }
    if (best == INFINITY) return 0;
  }
  int kept = 0;
  for (int n = 0; n < s->count; ++n) {
    if (!(shares[n] > 0.0f)) continue;
    s->points[kept] = withW(s->points[n], shares[n]);
    s->a[kept] = s->a[n];
    s->b[kept] = s->b[n];
    ++kept;
  }
  s->count = kept;
  return 1;
}

// Adds the vertex of the difference that lies farthest against `direction`; 0 if the simplex has it already.
LIB_INLINED int addSupport(REF(Simplex) s, CorePair pair, Hulls hulls, float4 direction) {
  const int ia = coreSupport(pair.a, hulls, direction);
  const int ib = coreSupport(pair.b, hulls, -mulTransposed(pair.turn, direction));
  int isNew = 1;
  for (int n = 0; n < s->count; ++n) isNew = isNew && (s->a[n] != ia || s->b[n] != ib);
  s->a[s->count] = ia;
  s->b[s->count] = ib;
  s->points[s->count] = withW(vertexOfB(pair, hulls, ib) - coreVertex(pair.a, hulls, ia), 0.0f);
  return isNew;
}

#define CORES_FAR 0      // farther apart than asked for
#define CORES_NEAR 1     // closest features found
#define CORES_OVERLAP 2  // or touch: SAT has to say how they leave each other
#define CORES_ON_FACE 3  // closest features found, one of them a face, whose normal is the axis
#define CORES_OPEN 4     // not known yet

// A direction in 31 bits, right within 1 in 500: good enough to begin with. Never 0.
LIB uint packAxis(float4 unit) {
  const uint x = (uint)(int)(unit.x * 511.0f + 512.0f), y = (uint)(int)(unit.y * 511.0f + 512.0f),
             z = (uint)(int)(unit.z * 511.0f + 512.0f);
  return 1u << 30 | (x & 1023u) << 20 | (y & 1023u) << 10 | (z & 1023u);
}
LIB float4 unpackAxis(uint packed) {
  return vec3((float)(packed >> 20 & 1023u) - 511.5f, (float)(packed >> 10 & 1023u) - 511.5f,
              (float)(packed & 1023u) - 511.5f);
}

// 1 if a point in the core's own axes lies over or under the face.
LIB int isOverFace(Core core, Hulls hulls, int face, float4 plane, float4 point) {
  const int corners = faceCorners(core, hulls, face);
  if (corners < 3) return 0;
  float4 from = faceCorner(core, hulls, face, corners - 1);
  for (int k = 0; k < corners; ++k) {
    const float4 to = faceCorner(core, hulls, face, k);
    if (dot3(cross3(to - from, point - from), plane) < 0.0f) return 0;
    from = to;
  }
  return 1;
}

// Whether the face of the one core that looks along the axis and the vertex of the other that is nearest to it are the
// closest features. They are if the vertex lies over the face: each core is on its side of the face's plane and of the
// parallel one through the vertex. What rests on a face is found so at once. CORES_OVERLAP where this can't be told.
LIB int closestOnFaceOfA(CorePair pair, Hulls hulls, float4 axis, float limit, REF(ClosestFeatures) out) {
  if (!pair.a.isPolytope) return CORES_OVERLAP;
  const int face = faceAlong(pair.a, hulls, axis);
  const float4 plane = facePlane(pair.a, hulls, face);
  if (dot3(plane, axis) < LIKELY_FACE * length3(axis)) return CORES_OVERLAP;
  const float4 vertex = supportOfB(pair, hulls, -xyz(plane));
  const float separation = dot3(plane, vertex) - plane.w;
  if (!(separation > 2.0f * CORES_TOUCH * pair.size)) return CORES_OVERLAP;
  if (!isOverFace(pair.a, hulls, face, plane, vertex)) return CORES_OVERLAP;
  out->normal = withW(plane, separation);
  out->onA = xyz(vertex - plane * separation);
  out->onB = xyz(vertex);
  return separation < limit ? CORES_ON_FACE : CORES_FAR;
}
LIB int closestOnFaceOfB(CorePair pair, Hulls hulls, float4 axis, float limit, REF(ClosestFeatures) out) {
  if (!pair.b.isPolytope) return CORES_OVERLAP;
  const float4 inB = -mulTransposed(pair.turn, axis);
  const int face = faceAlong(pair.b, hulls, inB);
  const float4 plane = facePlane(pair.b, hulls, face);
  if (dot3(plane, inB) < LIKELY_FACE * length3(axis)) return CORES_OVERLAP;
  const float4 normal = mulMatrix(pair.turn, plane);
  const float4 vertex = supportOfA(pair, hulls, -xyz(normal));
  const float4 vertexInB = mulTransposed(pair.turn, vertex - pair.offset);
  const float separation = dot3(plane, vertexInB) - plane.w;
  if (!(separation > 2.0f * CORES_TOUCH * pair.size)) return CORES_OVERLAP;
  if (!isOverFace(pair.b, hulls, face, plane, vertexInB)) return CORES_OVERLAP;
  out->normal = withW(-normal, separation);
  out->onA = xyz(vertex);
  out->onB = xyz(vertex - normal * separation);
  return separation < limit ? CORES_ON_FACE : CORES_FAR;
}

// The vertex of the difference that GJK begins with, and those of A and B that it came from.
STRUCT(FirstVertex) {
  float4 point;
  int a, b;
};

// The beginning of closestFeatures: CORES_OPEN if it takes GJK to find them.
LIB int beginClosest(CorePair pair, Hulls hulls, float4 start, float limit, REF(FirstVertex) first,
                     REF(ClosestFeatures) out) {
  Simplex s;
  s.count = 0;
  addSupport(&s, pair, hulls, start);
  out->normal = start;
  first->point = s.points[0];
  first->a = s.a[0];
  first->b = s.b[0];
  const float ahead = dot3(start, s.points[0]);
  if (ahead > 0.0f && ahead * ahead > limit * limit * lengthSqr3(start)) return CORES_FAR;
  int onFace = closestOnFaceOfA(pair, hulls, start, limit, out);
  if (onFace == CORES_OVERLAP) onFace = closestOnFaceOfB(pair, hulls, start, limit, out);
  return onFace == CORES_OVERLAP ? CORES_OPEN : onFace;
}

// Closest features of two cores nearer than `limit`. `start`: a guess of the axis from A to B. Of cores farther apart
// only normal is set, to an axis along which they are, of any length. gjk_wide.h has the same for many pairs at once.
LIB int closestFeatures(CorePair pair, Hulls hulls, float4 start, float limit, REF(ClosestFeatures) out) {
  FirstVertex first;
  const int begun = beginClosest(pair, hulls, start, limit, &first, out);
  if (begun != CORES_OPEN) return begun;
  Simplex s;
  s.points[0] = first.point;
  s.a[0] = first.a;
  s.b[0] = first.b;
  s.points[0].w = 1.0f;
  s.count = 1;
  float4 v = xyz(s.points[0]);
  float reachSqr = 0.0f;  // of the largest vertex met
  int stalls = 0;
  for (int n = 0; n < GJK_ITERATIONS; ++n) {
    const float distanceSqr = lengthSqr3(v);
    reachSqr = fmax(reachSqr, lengthSqr3(s.points[s.count - 1]));
    if (distanceSqr <= CORES_TOUCH * CORES_TOUCH * fmax(reachSqr, pair.size * pair.size)) return CORES_OVERLAP;
    Simplex next = s;
    const int isNew = addSupport(&next, pair, hulls, v);
    const float bound = dot3(v, next.points[next.count]);  // the cores are at least bound / |v| apart
    out->normal = v;
    if (bound > 0.0f && bound * bound > limit * limit * distanceSqr) return CORES_FAR;
    if (!isNew || distanceSqr - bound <= GJK_ACCURACY * distanceSqr) break;
    next.count += 1;
    float4 nearer;
    if (!nearestOnSimplex(&next, &nearer)) return CORES_OVERLAP;
    // Rounding allows no nearer point. Where the bound says that there is much to win yet, as between faces that are
    // almost flat on each other, the axis still turns for the better while the length stands still.
    if (!(lengthSqr3(nearer) < distanceSqr)) {
      const int worthIt = distanceSqr - bound > GJK_STALL_GAP * distanceSqr;
      const int still = lengthSqr3(nearer) <= distanceSqr * GJK_STALL_LENGTH;
      if (!worthIt || !still || ++stalls > GJK_STALLS) break;
    }
    s = next;
    v = nearer;
  }
  const float distance = length3(v);
  out->normal = v;
  if (distance >= limit) return CORES_FAR;
  out->normal = withW(v / distance, distance);
  out->onA = out->onB = vec3(0.0f, 0.0f, 0.0f);
  for (int n = 0; n < s.count; ++n) {
    out->onA += coreVertex(pair.a, hulls, s.a[n]) * s.points[n].w;
    out->onB += vertexOfB(pair, hulls, s.b[n]) * s.points[n].w;
  }
  out->onA.w = out->onB.w = 0.0f;
  return CORES_NEAR;
}

// Separation of the cores along the normal of a face of A or of B.
LIB float separationByFaceOfA(CorePair pair, Hulls hulls, float4 plane) {
  return dot3(plane, supportOfB(pair, hulls, -xyz(plane))) - plane.w;
}
// `normal`: B's, in A's axes.
LIB float separationByFaceOfB(CorePair pair, Hulls hulls, float4 normal, float planeOfB) {
  return dot3(normal, supportOfA(pair, hulls, -xyz(normal)) - pair.offset) - planeOfB;
}

// Where a face touches a vertex, its normal is exact and steady from step to step, which GJK's axis is only within
// rounding: takes the face's if the cores are as far apart along it.
LIB void preferFace(CorePair pair, Hulls hulls, REF(ClosestFeatures) c) {
  const float enough = c->normal.w - FACE_AS_GOOD * pair.size;
  if (pair.a.isPolytope) {
    const float4 plane = facePlane(pair.a, hulls, faceAlong(pair.a, hulls, c->normal));
    if (dot3(plane, c->normal) > NEARLY_FACE) {
      const float separation = separationByFaceOfA(pair, hulls, plane);
      if (separation >= enough) {
        c->normal = withW(plane, separation);
        return;
      }
    }
  }
  if (pair.b.isPolytope) {
    const float4 plane = facePlane(pair.b, hulls, faceAlong(pair.b, hulls, -mulTransposed(pair.turn, c->normal)));
    const float4 normal = mulMatrix(pair.turn, plane);
    if (-dot3(normal, c->normal) > NEARLY_FACE) {
      const float separation = separationByFaceOfB(pair, hulls, normal, plane.w);
      if (separation >= enough) c->normal = withW(-normal, separation);
    }
  }
}

BTGPU_END
#endif
