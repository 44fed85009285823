// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The first look of closestFeatures and closestCurved at BTGPU_WIDE pairs at once: most pairs are apart along the axis
// that they were apart along in the last step. Every lane is rounded as there. OpenCL C only.
#ifndef BTGPU_LIB_FIRST_LOOK_WIDE_H
#define BTGPU_LIB_FIRST_LOOK_WIDE_H
#include "gjk_wide.h"

// Where a pair's axis to begin with comes from.
#define START_CENTRES 0
#define START_CONTACT 1  // a normal on B
#define START_APART 2    // an axis that they were apart along

typedef struct FirstLook {
  WidePairs pairs;
  int lanes[BTGPU_WIDE];  // -1: to be looked at
  uint bodiesA[BTGPU_WIDE], bodiesB[BTGPU_WIDE];
  float limits[BTGPU_WIDE];
  int starts[BTGPU_WIDE];  // START_*
  float axes[3 * BTGPU_WIDE];  // world axes
  // What came out, of the lanes whose cores are farther apart than their limits: -1 in isFar[], and packAxis().
  int isFar[BTGPU_WIDE];
  uint packed[BTGPU_WIDE];
} FirstLook;

// Puts the cores of a pair in a lane. Several spheres and sums are not looked at here.
WIDE void addFirstLook(FirstLook* look, int l, Shape a, Shape b, float threshold) {
  fitMargins(&a, &b);
  const Core coreA = coreOf(a), coreB = coreOf(b);
  addCore(&look->pairs.a, l, &coreA);
  addCore(&look->pairs.b, l, &coreB);
  look->limits[l] = coreA.margin + coreB.margin + threshold;
  look->lanes[l] = -1;
#ifdef BTGPU_CURVED
  if (look->pairs.a.kinds[l] == KIND_LIST && !coreA.isHull) look->lanes[l] = 0;
  if (look->pairs.b.kinds[l] == KIND_LIST && !coreB.isHull) look->lanes[l] = 0;
#endif
}

// packAxis
WIDE uint16 packAxesWide(Lanes3 unit) {
  const uint16 x = as_uint16(convert_int16(unit.x * 511.0f + 512.0f)),
               y = as_uint16(convert_int16(unit.y * 511.0f + 512.0f)),
               z = as_uint16(convert_int16(unit.z * 511.0f + 512.0f));
  return 1u << 30 | (x & 1023u) << 20 | (y & 1023u) << 10 | (z & 1023u);
}

// The kernel's loop up to the first vertex of the difference, and what it stores of pairs that are apart there.
static void lookFirst(FirstLook* look, Hulls hulls, __global const BodyPose* poses) {
  __global const float4* from = (__global const float4*)poses;
  const Lanes4 positionA = gatherWide(from, 2, look->bodiesA), positionB = gatherWide(from, 2, look->bodiesB);
  const WideMatrix ra = matrixFromQuaternionWide(gatherWide(from + 1, 2, look->bodiesA));
  const WideMatrix rb = matrixFromQuaternionWide(gatherWide(from + 1, 2, look->bodiesB));
  const Lanes3 bFromA = subtractWide(xyzWide(positionB), xyzWide(positionA));
  const Lanes3 columns[3] = {{ra.row0.x, ra.row1.x, ra.row2.x},
                             {ra.row0.y, ra.row1.y, ra.row2.y},
                             {ra.row0.z, ra.row1.z, ra.row2.z}};
  for (int k = 0; k < 3; ++k) storeLanes3(mulTransposedWide(rb, columns[k]), look->pairs.turns[k]);
  const Lanes3 offset = mulTransposedWide(ra, bFromA);
  storeLanes3(offset, look->pairs.offsets);
  const int16 starts = vload16(0, look->starts);
  Lanes3 start = mulTransposedWide(ra, loadLanes3(look->axes));
  start = pick3(starts == START_CONTACT, timesWide(start, (Lanes)-1.0f), start);
  start = pick3(starts == START_CENTRES, offset, start);
  const LaneMask lanes = vload16(0, look->lanes);
  Lanes3 point;
  WideOrigin origin;
  supportsWide(&look->pairs, 0, hulls, lanes, start, &point, &origin);
  const Lanes ahead = dotWide(start, point), lengthSqr = dotWide(start, start), limit = vload16(0, look->limits);
  const LaneMask isFar = lanes & (ahead > 0.0f) & (ahead * ahead > limit * limit * lengthSqr);
  vstore16(isFar, 0, look->isFar);
  const Lanes length = sqrt(lengthSqr);
  start.x /= length;
  start.y /= length;
  start.z /= length;
  vstore16(packAxesWide(mulMatrixWide(ra, start)), 0, look->packed);
}

#endif
