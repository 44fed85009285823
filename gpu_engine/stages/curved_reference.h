// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of what stages 42, 44 and 46 do with cylinders, cones and spheres of several sizes, in double. All
// that it knows of a core is its point farthest along a direction, and whether a point lies in it.
//
// That two cores are at their closest, or leave each other by the shortest way, needs no second search to be checked:
// an axis along which the cores are as far apart as two of their points are from each other shows both (the gap along
// any axis is at most the distance of any two points). Only of overlapping cores a shorter way out is looked for, along
// many axes.
#pragma once

#include "contract.h"
#include "pair_arrays.h"

namespace btgpu {

bool isCurved(const Shape& shape);

// A core in world axes, from A's position.
struct PlacedCore {
  const Shape* shape;
  const HullArrays* hulls;
  reference::Matrix rotation;
  reference::Vec position;
  double margin;  // 0 where two shapes collide without

  reference::Vec support(reference::Vec direction) const;
  // How far a point is outside of the core; for spheres of several sizes no more than that, as seen along many
  // directions.
  double distanceTo(reference::Vec point) const;
};

struct CurvedPair {
  PlacedCore a, b;
  double size, margins, threshold;
  double limit() const { return margins + threshold; }
};

CurvedPair curvedPairOf(const PairArrays& in, const Pair& pair);

// The gap along an axis from A to B; below zero: overlap.
double gapAlong(const CurvedPair& pair, reference::Vec axis);

struct WidestGap {
  reference::Vec axis;
  double gap;
};

// The axis along which the two are farthest apart, or overlap least: out of many, and the best ones refined. Exact to
// some 1e-7 of the size.
WidestGap widestGapReference(const CurvedPair& pair);
// Whether they are that far apart along some axis looked at, which is told much sooner; false proves nothing.
bool areFartherApart(const CurvedPair& pair, double than);

// What stage 44 writes of a pair: normal, separation and closest points. Of what lies flat on each other the points are
// any that are farthest along the axis.
ClosestFeatures curvedFeaturesReference(const PairArrays& in, const Pair& pair);
void checkCurvedFeatures(Contract& contract, const PairArrays& in, const Pair& pair, const ClosestFeatures& device);

// Stage 46. The reference shows the closest point alone; the device may show others, each of both shapes.
RawContacts curvedContactsReference(const PairArrays& in, const Pair& pair, const ClosestFeatures& found);
void checkCurvedContacts(Contract& contract, const PairArrays& in, const Pair& pair, const ClosestFeatures& found,
                         const RawContacts& device);

// Stage 42: on a plane, likewise: the lowest point alone.
RawContacts curvedPlaneReference(const PairArrays& in, const Pair& pair);
void checkCurvedPlane(Contract& contract, const PairArrays& in, const Pair& pair, const RawContacts& device);

}  // namespace btgpu
