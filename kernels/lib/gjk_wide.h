// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// GJK for BTGPU_WIDE pairs of cores at once: the loops of closestFeatures (convex.h) and, with BTGPU_CURVED, of
// closestCurved (curved.h), from the vertex on that they begin with. Each lane takes the steps that its pair takes
// there, rounded alike, so that results are the same bits. Farthest points of hulls and of several spheres are looked
// for pair by pair. OpenCL C only.
#ifndef BTGPU_LIB_GJK_WIDE_H
#define BTGPU_LIB_GJK_WIDE_H
#ifdef BTGPU_CURVED
#include "curved.h"
#else
#include "convex.h"
#endif
#include "wide.h"

// Where a vertex of the simplex came from.
#ifdef BTGPU_CURVED
typedef Lanes3 WideOrigin;  // A's point
typedef DifferencePoint ClosestBegun;
#else
typedef struct WideOrigin { int16 a, b; } WideOrigin;  // the cores' vertices
typedef FirstVertex ClosestBegun;
#endif

typedef struct WideSimplex {
  Lanes3 points[4];
  Lanes shares[4];
  WideOrigin origins[4];
  int16 count;
} WideSimplex;

#define KIND_BOX 0  // or segment or point
#define KIND_LIST 1  // of vertices, spheres or terms
#define KIND_TRIANGLE 2
#define KIND_CYLINDER 3
#define KIND_CONE 4

// What the farthest points of cores depend on.
typedef struct WideCores {
  int kinds[BTGPU_WIDE];
  float extents[3 * BTGPU_WIDE];
  int firstVertex[BTGPU_WIDE], vertexCount[BTGPU_WIDE];  // of hulls; no vertices: ask the core itself
#ifdef BTGPU_TRIANGLE_CORES
  float corners[3][3 * BTGPU_WIDE];
#endif
#ifdef BTGPU_CURVED
  float ups[3 * BTGPU_WIDE], radii[BTGPU_WIDE], halfLengths[BTGPU_WIDE];
#endif
} WideCores;

typedef struct WidePairs {
  WideCores a, b;
  float turns[3][3 * BTGPU_WIDE], offsets[3 * BTGPU_WIDE];
} WidePairs;

// The pairs that wait to be looked at together.
typedef struct GjkBlock {
  int count;
  CorePair pairs[BTGPU_WIDE];
  WidePairs wide;
  float limits[BTGPU_WIDE];
  float first[3 * BTGPU_WIDE];  // the first vertex: x of all, y, z
#ifdef BTGPU_CURVED
  float origins[3 * BTGPU_WIDE];
#else
  int firstA[BTGPU_WIDE], firstB[BTGPU_WIDE];
#endif
  // What came out: CORES_*.
  int what[BTGPU_WIDE];
  ClosestFeatures found[BTGPU_WIDE];
} GjkBlock;

#ifdef BTGPU_CURVED
WIDE WideOrigin pickOrigin(LaneMask mask, WideOrigin yes, WideOrigin no) { return pick3(mask, yes, no); }
#else
WIDE WideOrigin pickOrigin(LaneMask mask, WideOrigin yes, WideOrigin no) {
  yes.a = mask ? yes.a : no.a;
  yes.b = mask ? yes.b : no.b;
  return yes;
}
#endif

WIDE void putPoint(WideSimplex* s, int n, LaneMask mask, Lanes3 point, Lanes share, WideOrigin origin) {
  s->points[n] = pick3(mask, point, s->points[n]);
  s->shares[n] = pick(mask, share, s->shares[n]);
  s->origins[n] = pickOrigin(mask, origin, s->origins[n]);
}

// nearestOnSegment; share: q's.
WIDE Lanes3 nearestOnSegmentWide(Lanes3 p, Lanes3 q, Lanes* share) {
  const Lanes3 d = subtractWide(q, p);
  const Lanes lengthSqr = dotWide(d, d), along = -dotWide(p, d);
  const LaneMask after = along > 0.0f, beyond = along >= lengthSqr;
  *share = along / lengthSqr;
  Lanes3 v = addWide(p, timesWide(d, *share));
  v = subtractWide(v, timesWide(d, dotWide(v, d) / lengthSqr));
  *share = pick(after, pick(beyond, (Lanes)1.0f, *share), (Lanes)0.0f);
  return pick3(after, pick3(beyond, q, v), p);
}

// nearestOnTriangle; shares of p, q, r.
static void nearestOnTriangleWide(const Lanes3* pp, const Lanes3* pq, const Lanes3* pr, Lanes* shares,
                                  Lanes3* nearest) {
  const Lanes3 p = *pp, q = *pq, r = *pr;
  const Lanes3 normal = crossWide(subtractWide(q, p), subtractWide(r, p));
  const Lanes lengthSqr = dotWide(normal, normal);
  const Lanes atP = dotWide(normal, crossWide(q, r)), atQ = dotWide(normal, crossWide(r, p)),
              atR = dotWide(normal, crossWide(p, q));
  const LaneMask inside = (atP > 0.0f) & (atQ > 0.0f) & (atR > 0.0f) & (lengthSqr > 0.0f);
  const Lanes sum = atP + atQ + atR;
  Lanes ofPq, ofQr, ofRp;
  const Lanes3 onPq = nearestOnSegmentWide(p, q, &ofPq), onQr = nearestOnSegmentWide(q, r, &ofQr),
               onRp = nearestOnSegmentWide(r, p, &ofRp);
  const Lanes a = dotWide(onPq, onPq), b = dotWide(onQr, onQr), c = dotWide(onRp, onRp), zero = (Lanes)0.0f;
  const LaneMask byPq = (a <= b) & (a <= c), byQr = ~byPq & (b <= c);
  shares[0] = pick(inside, atP / sum, pick(byPq, 1.0f - ofPq, pick(byQr, zero, ofRp)));
  shares[1] = pick(inside, atQ / sum, pick(byPq, ofPq, pick(byQr, 1.0f - ofQr, zero)));
  shares[2] = pick(inside, atR / sum, pick(byPq, zero, pick(byQr, ofQr, 1.0f - ofRp)));
  const Lanes3 onSides = pick3(byPq, onPq, pick3(byQr, onQr, onRp));
  *nearest = pick3(inside, timesWide(normal, dotWide(normal, p) / lengthSqr), onSides);
}

WIDE LaneMask outsideFaceWide(Lanes3 p, Lanes3 q, Lanes3 r, Lanes3 other) {
  const Lanes3 to = subtractWide(other, p), normal = crossWide(subtractWide(q, p), subtractWide(r, p));
  const Lanes height = dotWide(normal, to), origin = -dotWide(normal, p);
  const LaneMask flat = height * height <= 1e-12f * dotWide(normal, normal) * dotWide(to, to);
  const LaneMask above = (origin < 0.0f) | (origin > height), below = (origin > 0.0f) | (origin < height);
  return flat | ((height > 0.0f) ? above : below);
}

// nearestOnSimplex, of the lanes given; the result: those whose simplex the origin is not inside of.
static LaneMask nearestOnSimplexWide(WideSimplex* s, LaneMask lanes, Lanes3* nearest) {
  Lanes shares[4], of[3];
  for (int n = 0; n < 4; ++n) shares[n] = (Lanes)0.0f;
  LaneMask outside = lanes;
  const LaneMask two = lanes & (s->count == 2), three = lanes & (s->count == 3), four = lanes & (s->count == 4);
  Lanes3 v;
  v.x = v.y = v.z = (Lanes)0.0f;
  *nearest = v;
  if (anyLane(two)) {
    *nearest = nearestOnSegmentWide(s->points[0], s->points[1], &of[0]);
    shares[0] = pick(two, 1.0f - of[0], shares[0]);
    shares[1] = pick(two, of[0], shares[1]);
  }
  if (anyLane(three)) {
    nearestOnTriangleWide(&s->points[0], &s->points[1], &s->points[2], of, &v);
    *nearest = pick3(three, v, *nearest);
    for (int n = 0; n < 3; ++n) shares[n] = pick(three, of[n], shares[n]);
  }
  if (anyLane(four)) {
    Lanes best = (Lanes)INFINITY;
    for (int other = 0; other < 4; ++other) {
      const int i = other == 0 ? 1 : 0, j = other <= 1 ? 2 : 1, k = other <= 2 ? 3 : 2;
      LaneMask better = four & outsideFaceWide(s->points[i], s->points[j], s->points[k], s->points[other]);
      if (!anyLane(better)) continue;
      nearestOnTriangleWide(&s->points[i], &s->points[j], &s->points[k], of, &v);
      const Lanes lengthSqr = dotWide(v, v);
      better &= ~(lengthSqr >= best);
      best = pick(better, lengthSqr, best);
      *nearest = pick3(better, v, *nearest);
      shares[i] = pick(better, of[0], shares[i]);
      shares[j] = pick(better, of[1], shares[j]);
      shares[k] = pick(better, of[2], shares[k]);
      shares[other] = pick(better, (Lanes)0.0f, shares[other]);
    }
    outside &= ~(four & (best == INFINITY));
  }
  int16 kept = 0;
  UNROLL
  for (int n = 0; n < 4; ++n) {
    const LaneMask keep = (n < s->count) & (shares[n] > 0.0f);
    const Lanes3 point = s->points[n];
    const WideOrigin origin = s->origins[n];
    UNROLL
    for (int to = 0; to <= n; ++to) putPoint(s, to, keep & (kept == to), point, shares[n], origin);
    kept -= keep;
  }
  s->count = kept;
  return outside;
}

static void addCore(WideCores* cores, int l, const Core* core) {
  cores->kinds[l] = core->isHull ? KIND_LIST : KIND_BOX;
  setLane(cores->extents, l, core->extents);
  cores->firstVertex[l] = core->firstVertex;
  cores->vertexCount[l] = core->isHull ? core->vertexCount : 0;
#ifdef BTGPU_TRIANGLE_CORES
  if (core->isTriangle) {
    cores->kinds[l] = KIND_TRIANGLE;
    setLane(cores->corners[0], l, core->triangle.a);
    setLane(cores->corners[1], l, core->triangle.b);
    setLane(cores->corners[2], l, core->triangle.c);
  }
#endif
#ifdef BTGPU_CURVED
  if (core->curved == SHAPE_MULTI_SPHERE || core->curved == SHAPE_SUM) {
    cores->kinds[l] = KIND_LIST;
  } else if (core->curved) {
    cores->kinds[l] = core->curved == SHAPE_CONE ? KIND_CONE : KIND_CYLINDER;
    setLane(cores->ups, l, unitVector(core->axis));
    cores->radii[l] = core->radius;
    cores->halfLengths[l] = core->halfLength;
  }
#endif
}

#ifdef BTGPU_CURVED
// roundSupport
WIDE Lanes3 roundSupportWide(const WideCores* cores, LaneMask isCone, Lanes3 direction) {
  const Lanes3 up = loadLanes3(cores->ups);
  const Lanes radius = vload16(0, cores->radii), halfLength = vload16(0, cores->halfLengths);
  const Lanes along = dotWide(direction, up);
  const Lanes3 across = subtractWide(direction, timesWide(up, along));
  const Lanes size = sqrt(dotWide(across, across));
  const Lanes3 rim = timesWide(across, pick(size > 0.0f, radius / size, (Lanes)0.0f)), tip = timesWide(up, halfLength);
  const Lanes3 ofCylinder = addWide(rim, timesWide(up, pick(along < 0.0f, -halfLength, halfLength)));
  const LaneMask atTip = along * halfLength > size * radius - along * halfLength;
  return pick3(isCone, pick3(atTip, tip, subtractWide(rim, tip)), ofCylinder);
}
#endif

// The cores' points farthest along the directions, in their own axes, of the lanes given; where cores have vertices,
// vertices[] says which they are. pairs[]: whose cores they are, A's or B's; null where no lane has several spheres or a
// sum.
static Lanes3 coreSupportsWide(const WideCores* cores, const CorePair* pairs, int ofA, Hulls hulls, LaneMask lanes,
                               Lanes3 direction, int16* vertices) {
  const int16 kind = vload16(0, cores->kinds);
  const Lanes3 extents = loadLanes3(cores->extents);
  const LaneMask upX = (direction.x > 0.0f) & (extents.x > 0.0f), upY = (direction.y > 0.0f) & (extents.y > 0.0f),
                 upZ = (direction.z > 0.0f) & (extents.z > 0.0f);
  Lanes3 best;
  best.x = pick(upX, extents.x, -extents.x);
  best.y = pick(upY, extents.y, -extents.y);
  best.z = pick(upZ, extents.z, -extents.z);
  *vertices = (upX & 1) | (upY & 2) | (upZ & 4);
#ifdef BTGPU_TRIANGLE_CORES
  const LaneMask isTriangle = lanes & (kind == KIND_TRIANGLE);
  if (anyLane(isTriangle)) {
    const Lanes3 first = loadLanes3(cores->corners[0]), second = loadLanes3(cores->corners[1]),
                 third = loadLanes3(cores->corners[2]);
    const Lanes a = dotWide(first, direction), b = dotWide(second, direction), c = dotWide(third, direction);
    const LaneMask isThird = (c > a) & (c > b), isSecond = ~isThird & (b > a);
    best = pick3(isTriangle, pick3(isThird, third, pick3(isSecond, second, first)), best);
    *vertices = isTriangle ? (isThird & 2) | (isSecond & 1) : *vertices;
  }
#endif
#ifdef BTGPU_CURVED
  const LaneMask isRound = lanes & (kind >= KIND_CYLINDER);
  if (anyLane(isRound)) best = pick3(isRound, roundSupportWide(cores, kind == KIND_CONE, direction), best);
#endif
  const LaneMask isList = lanes & (kind == KIND_LIST);
  if (!anyLane(isList)) return best;
  float directions[3 * BTGPU_WIDE], at[3 * BTGPU_WIDE];
  int isIn[BTGPU_WIDE], found[BTGPU_WIDE];
  storeLanes3(direction, directions);
  vstore16(isList, 0, isIn);
  for (int l = 0; l < BTGPU_WIDE; ++l) {
    if (!isIn[l]) continue;
#ifdef BTGPU_CURVED
    if (cores->vertexCount[l] == 0) {
      setLane(at, l, coreSupportPoint(ofA ? pairs[l].a : pairs[l].b, hulls, laneOf(directions, l)));
      continue;
    }
#endif
    __global const float4* hull = hulls.vertices + cores->firstVertex[l];
    found[l] = farthestVertexWide(hull, cores->vertexCount[l], laneOf(directions, l));
    setLane(at, l, hull[found[l]]);
  }
  *vertices = isList ? vload16(0, found) : *vertices;
  return pick3(isList, loadLanes3(at), best);
}

// The vertices of the differences B - A farthest against v, of the lanes given.
static void supportsWide(const WidePairs* w, const CorePair* pairs, Hulls hulls, LaneMask lanes, Lanes3 v,
                         Lanes3* points, WideOrigin* origins) {
  WideMatrix turn;
  turn.row0 = loadLanes3(w->turns[0]);
  turn.row1 = loadLanes3(w->turns[1]);
  turn.row2 = loadLanes3(w->turns[2]);
  int16 a, b;
  const Lanes3 onA = coreSupportsWide(&w->a, pairs, 1, hulls, lanes, v, &a);
#ifdef BTGPU_CURVED
  const Lanes3 inB = mulTransposedWide(turn, timesWide(v, (Lanes)-1.0f));
#else
  const Lanes3 inB = timesWide(mulTransposedWide(turn, v), (Lanes)-1.0f);
#endif
  const Lanes3 onB = coreSupportsWide(&w->b, pairs, 0, hulls, lanes, inB, &b);
  *points = subtractWide(addWide(loadLanes3(w->offsets), mulMatrixWide(turn, onB)), onA);
#ifdef BTGPU_CURVED
  *origins = onA;
#else
  origins->a = a;
  origins->b = b;
#endif
}

// The lanes whose simplex has the vertex already.
WIDE LaneMask hasPoint(const WideSimplex* s, Lanes3 point, WideOrigin origin) {
  LaneMask has = 0;
  UNROLL
  for (int n = 0; n < 4; ++n) {
#ifdef BTGPU_CURVED
    has |= (n < s->count) & (s->points[n].x == point.x) & (s->points[n].y == point.y) & (s->points[n].z == point.z);
#else
    has |= (n < s->count) & (s->origins[n].a == origin.a) & (s->origins[n].b == origin.b);
#endif
  }
  return has;
}

// The lanes whose cores touch.
WIDE LaneMask touchWide(Lanes distanceSqr, Lanes smallSqr) {
#ifdef BTGPU_CURVED
  return ~(distanceSqr > smallSqr);
#else
  return distanceSqr <= smallSqr;
#endif
}

// The lanes in which a step that brought no nearer point is the last one.
WIDE LaneMask stallsWide(Lanes distanceSqr, Lanes nearerSqr, Lanes bound, int16* stalls) {
  const LaneMask isNoNearer = ~(nearerSqr < distanceSqr);
#ifdef BTGPU_CURVED
  *stalls -= isNoNearer;
  return isNoNearer & (*stalls > CURVED_STALLS);
#else
  const LaneMask mayGoOn = isNoNearer & (distanceSqr - bound > GJK_STALL_GAP * distanceSqr) &
                           (nearerSqr <= distanceSqr * GJK_STALL_LENGTH);
  *stalls -= mayGoOn;
  return isNoNearer & (~mayGoOn | (*stalls > GJK_STALLS));
#endif
}

#ifdef BTGPU_CURVED
#define WIDE_ITERATIONS CURVED_ITERATIONS
#define WIDE_ACCURACY CURVED_ACCURACY
#else
#define WIDE_ITERATIONS GJK_ITERATIONS
#define WIDE_ACCURACY GJK_ACCURACY
#endif

// The result of a lane that ended where its cores are apart.
static void finishLane(GjkBlock* g, Hulls hulls, int l, float4 v, const float shares[][BTGPU_WIDE],
                       const WideSimplex* s, int count) {
  ClosestFeatures* out = &g->found[l];
  const float distance = length3(v);
  out->normal = v;
  if (distance >= g->limits[l]) {
    g->what[l] = CORES_FAR;
    return;
  }
  g->what[l] = CORES_NEAR;
  out->normal = withW(v / distance, distance);
  for (int n = 0; n < count; ++n) {
#ifdef BTGPU_CURVED
    out->onA += laneOf((const float*)&s->origins[n], l) * shares[n][l];
#else
    const int a = ((const int*)&s->origins[n].a)[l], b = ((const int*)&s->origins[n].b)[l];
    const CorePair* pair = &g->pairs[l];
    out->onA += coreVertex(pair->a, hulls, a) * shares[n][l];
    out->onB += (pair->offset + mulMatrix(pair->turn, coreVertex(pair->b, hulls, b))) * shares[n][l];
#endif
  }
  out->onA.w = out->onB.w = 0.0f;
#ifdef BTGPU_CURVED
  out->onB = xyz(out->onA + v);
#endif
}

// Adds a pair that closestFeatures or closestCurved has begun with. The block must have room.
static void addToBlock(GjkBlock* g, const CorePair* pair, float limit, ClosestBegun begun) {
  const int l = g->count;
  g->pairs[l] = *pair;
  addCore(&g->wide.a, l, &pair->a);
  addCore(&g->wide.b, l, &pair->b);
  setLane(g->wide.turns[0], l, pair->turn.row0);
  setLane(g->wide.turns[1], l, pair->turn.row1);
  setLane(g->wide.turns[2], l, pair->turn.row2);
  setLane(g->wide.offsets, l, pair->offset);
  g->limits[l] = limit;
  setLane(g->first, l, begun.point);
#ifdef BTGPU_CURVED
  setLane(g->origins, l, begun.onA);
#else
  g->firstA[l] = begun.a;
  g->firstB[l] = begun.b;
#endif
  g->count += 1;
}

// Looks at all pairs of the block: what[] and found[], as closestFeatures and closestCurved have them.
static void closestWide(GjkBlock* g, Hulls hulls) {
  const int16 lane = (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  LaneMask live = lane < g->count;
  WideSimplex s;
  for (int n = 0; n < 4; ++n) {
    s.points[n] = loadLanes3(g->first);
    s.shares[n] = (Lanes)1.0f;
#ifdef BTGPU_CURVED
    s.origins[n] = loadLanes3(g->origins);
#else
    s.origins[n].a = vload16(0, g->firstA);
    s.origins[n].b = vload16(0, g->firstB);
#endif
  }
  s.count = 1;
  float sizes[BTGPU_WIDE];
  for (int l = 0; l < BTGPU_WIDE; ++l) sizes[l] = l < g->count ? g->pairs[l].size : 0.0f;
  const Lanes size = vload16(0, sizes), limit = vload16(0, g->limits), sizeSqr = size * size;
  Lanes3 v = s.points[0];
  Lanes reachSqr = (Lanes)0.0f;
  int16 stalls = 0, what = CORES_NEAR;
  for (int n = 0; n < WIDE_ITERATIONS && anyLane(live); ++n) {
    const Lanes distanceSqr = dotWide(v, v);
    const Lanes3 last = pick3(s.count == 1, s.points[0], pick3(s.count == 2, s.points[1], s.points[2]));
    const Lanes lastSqr = dotWide(last, last);
    reachSqr = pick(lastSqr > reachSqr, lastSqr, reachSqr);
    const Lanes largestSqr = pick(reachSqr > sizeSqr, reachSqr, sizeSqr);
    const LaneMask touch = live & touchWide(distanceSqr, CORES_TOUCH * CORES_TOUCH * largestSqr);
    what = touch ? CORES_OVERLAP : what;
    live &= ~touch;
    if (!anyLane(live)) break;
    Lanes3 point, nearer;
    WideOrigin origin;
    supportsWide(&g->wide, g->pairs, hulls, live, v, &point, &origin);
    const Lanes bound = dotWide(v, point);
    const LaneMask isFar = live & (bound > 0.0f) & (bound * bound > limit * limit * distanceSqr);
    what = isFar ? CORES_FAR : what;
    live &= ~isFar;
    live &= ~(hasPoint(&s, point, origin) | (distanceSqr - bound <= WIDE_ACCURACY * distanceSqr));
    WideSimplex next = s;
    for (int k = 1; k < 4; ++k) putPoint(&next, k, s.count == k, point, (Lanes)0.0f, origin);
    next.count = s.count + 1;
    const LaneMask apart = nearestOnSimplexWide(&next, live, &nearer);
    what = (live & ~apart) ? CORES_OVERLAP : what;
    live &= apart;
    live &= ~stallsWide(distanceSqr, dotWide(nearer, nearer), bound, &stalls);
    for (int k = 0; k < 4; ++k) putPoint(&s, k, live, next.points[k], next.shares[k], next.origins[k]);
    s.count = live ? next.count : s.count;
    v = pick3(live, nearer, v);
  }
  float ends[3 * BTGPU_WIDE], shares[4][BTGPU_WIDE];
  int counts[BTGPU_WIDE];
  storeLanes3(v, ends);
  vstore16(s.count, 0, counts);
  vstore16(what, 0, g->what);
  for (int n = 0; n < 4; ++n) vstore16(s.shares[n], 0, shares[n]);
  for (int l = 0; l < g->count; ++l) {
    g->found[l].normal = laneOf(ends, l);
    g->found[l].onA = g->found[l].onB = vec3(0.0f, 0.0f, 0.0f);
    if (g->what[l] == CORES_NEAR) finishLane(g, hulls, l, laneOf(ends, l), shares, &s, counts[l]);
  }
}

#endif
