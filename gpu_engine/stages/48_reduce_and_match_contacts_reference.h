// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 48: btManifoldResult::addContactPoint, btPersistentManifold and its
// refreshContactPoints, after a reduction of the candidates to four. Exact: carried manifolds, which points
// there are and in which order, life times, flags, impulses, thresholds - unless a distance lies at the
// breaking threshold or two choices are equally good; then what comes of either is right
// (checkMatchedContacts tries them all). Points, distances, friction
// directions: within 2e-6 of the pair's size (distance of the centres plus distance of the point from them),
// since the reference computes in double.
#pragma once

#include <vector>

#include "contract.h"
#include "pair_arrays.h"

namespace btgpu {

struct MatchInput {
  PairArrays arrays;
  std::vector<RawContacts> contacts;  // one a pair
  std::vector<BodyMaterial> materials;
  bool unseen = false;  // STEP_CONTACTS_UNSEEN
};

// The candidates that stay, in the order in which they are added: at most four of them as they came; else the
// deepest, the one farthest from it, and from either side of the line through these two (first the side that
// cross(normal, second - first) looks to) the one farthest from the line. The first one where two are as
// good.
RawContacts reduceContactsReference(const RawContacts& raw);

// One manifold a pair, in pair order. An index in `oldManifolds` is Pair::oldManifold.
std::vector<Manifold> matchContactsReference(const MatchInput& in);

void checkMatchedContacts(Contract& contract, const MatchInput& in, const std::vector<Manifold>& device);

}  // namespace btgpu
