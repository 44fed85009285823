// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The CPU's share of the narrowphase: pairs with a shape that the device lacks, or with a callback of the
// application's, get their contacts from Bullet's own algorithms, before the step is launched and from the poses that
// it starts with. They are solved on the device with all the others.
#pragma once

#include "read_world.h"

BTGPU_TRANSLATION_BEGIN

class HostContacts {
 public:
  // Runs Bullet's narrowphase on the pairs of the host. The reader must have read the world, and the host's broadphase
  // must be current. May call gContactAddedCallback.
  void find(btDiscreteDynamicsWorld& world, const WorldReader& reader);

  // Adds the contacts that fast bodies are about to have (btDiscreteDynamicsWorld::createPredictiveContacts).
  void add(const btAlignedObjectArray<btPersistentManifold*>& predictive, const WorldReader& reader);

  // Puts what was found into the input; what the solver of the device can't do goes into `missing`.
  void fill(WorldInput& input, const WorldReader& reader, int solverMode, bool fast, FallbackList& missing);

  // The impulses of the step, into the manifolds that find() saw; `input` as fill() left it.
  void writeBack(const WorldInput& input, const StepResults& results);

  void clear(WorldInput& input);

  // Manifolds of the host's pairs that Bullet's algorithms own, with points or without, and the predictive ones.
  std::size_t manifoldCount() const { return m_manifoldCount; }

 private:
  struct Found {
    btPersistentManifold* manifold;
    std::uint32_t bodyA, bodyB;
  };
  std::vector<Found> m_found;  // those with points
  std::size_t m_manifoldCount = 0;
  bool m_twoDirections = false;
};

// The slots of a pair's objects; kNoSlot for one that the reader does not know.
struct PairSlots {
  std::uint32_t a, b;
};
PairSlots slotsOf(const WorldReader& reader, const btBroadphasePair& pair);

// True if the contacts of this pair are the host's business.
bool collidesOnHost(const WorldReader& reader, PairSlots slots);

BTGPU_TRANSLATION_END
