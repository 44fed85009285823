// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 48: btManifoldResult::addContactPoint, btPersistentManifold and its
// refreshContactPoints, after a reduction of the candidates to four. Exact: carried manifolds, which points
// there are and in which order, life times, flags, impulses, thresholds - unless a distance lies at the
// breaking threshold or two choices of the reduction are equally good. Points, distances, friction
// directions: within 2e-6 of the pair's size (distance of the centres plus distance of the point from them),
// since the reference computes in double.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/contact.h"
#include "../../kernels/shared/shape.h"

namespace btgpu {

// The candidates that stay, in the order in which they are added: at most four of them as they came; else the
// deepest, the one farthest from it, and from either side of the line through these two (first the side that
// cross(normal, second - first) looks to) the one farthest from the line. The first one where two are as
// good.
RawContacts reduceContactsReference(const RawContacts& raw);

// One manifold a pair, in pair order. An index in `oldManifolds` is Pair::oldManifold. unseen: STEP_CONTACTS_UNSEEN.
std::vector<Manifold> matchContactsReference(const std::vector<Pair>& pairs, const std::vector<RawContacts>& contacts,
                                             const std::vector<Manifold>& oldManifolds,
                                             const std::vector<BodyInfo>& infos, const std::vector<Shape>& shapes,
                                             const std::vector<BodyPose>& poses,
                                             const std::vector<BodyMaterial>& materials, bool unseen = false);

}  // namespace btgpu
