// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What batched queries of all kinds share.
#pragma once

#include <cmath>

#include "../translation/parallel.h"
#include "world_state.h"

BTGPU_TRANSLATION_BEGIN

constexpr std::size_t kBatchGrain = 256;  // queries a thread takes at a time

inline bool isFinite(const btVector3& v) { return std::isfinite(double(v.x() + v.y() + v.z())); }
inline bool isFinite(const btTransform& t) {
  return isFinite(t.getOrigin()) && isFinite(t.getBasis()[0]) && isFinite(t.getBasis()[1]) && isFinite(t.getBasis()[2]);
}

// work(first, last), on several threads if the shapes that are asked bear it.
template <typename Work>
void forEachQuery(std::size_t count, bool atOnce, const Work& work) {
  if (atOnce) {
    parallelFor(count, kBatchGrain, work);
  } else {
    work(0, count);
  }
}

// Where an object is that a query passes through, or NO_INDEX: its place may be looked up only if it is still there.
inline uint placeOfIgnored(const QueryReader& reader, const btCollisionObject* object) {
  const int place = object ? reader.positionOf(object) : -1;
  return place < 0 ? NO_INDEX : static_cast<uint>(place);
}

// The engine for a batch of so many; null if the CPU is to answer it.
inline Engine* engineFor(WorldState& state, int count) {
  // Batches that the CPU has answered before a device has, and before one has been opened
  // (benchmarks/results/2026-11-23-pocl-rays.txt).
  constexpr int kSmallBatch = 200, kSmallFirstBatch = 15000;
  const int wanted = state.settings.m_smallBatch;
  const int small = wanted >= 0 ? wanted : state.engine ? kSmallBatch : kSmallFirstBatch;
  if (state.settings.m_stockOnly || count < small) return nullptr;
  return engineOf(state);
}

BTGPU_TRANSLATION_END
