// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "contact_writer.h"

#include <algorithm>
#include <mutex>
#include <numeric>

#include "../gpu_engine/zone.h"
#include "compound_algorithm.h"
#include "contacts.h"
#include "host_contacts.h"
#include "parallel.h"
#include "prefetch.h"

BTGPU_TRANSLATION_BEGIN
namespace {

constexpr std::size_t kGrain = 256;

btBroadphasePair* pairOf(btDiscreteDynamicsWorld& world, const WorldReader& reader, ulong key) {
  btCollisionObject* low = reader.objectOf(static_cast<std::uint32_t>(key >> 32));
  btCollisionObject* high = reader.objectOf(static_cast<std::uint32_t>(key));
  btBroadphaseProxy *a = low->getBroadphaseHandle(), *b = high->getBroadphaseHandle();
  if (!a || !b) return nullptr;
  btOverlappingPairCache& cache = *world.getPairCache();
  btBroadphasePair* pair = cache.findPair(a, b);
  // The host's broadphase may be behind (btGpuSettings::m_hostQueries off).
  return pair ? pair : cache.addOverlappingPair(a, b);
}

bool isOfCompound(const WorldReader& reader, ulong key) {
  return reader.isChild(static_cast<std::uint32_t>(key >> 32)) || reader.isChild(static_cast<std::uint32_t>(key));
}

bool hasUserData(btPersistentManifold& manifold) {
  for (int k = 0; k < manifold.getNumContacts(); ++k) {
    if (manifold.getContactPoint(k).m_userPersistentData) return true;
  }
  return false;
}

// What Bullet keeps in a point and the device does not know follows the point to its new index; points that are gone
// are reported to gContactDestroyedCallback.
void carryUserData(const Manifold& from, btPersistentManifold& manifold) {
  void* before[MANIFOLD_POINTS] = {};
  const int count = manifold.getNumContacts();
  for (int k = 0; k < count; ++k) std::swap(before[k], manifold.getContactPoint(k).m_userPersistentData);
  void* after[MANIFOLD_POINTS] = {};
  for (int k = 0; k < from.pointCount; ++k) {
    const int origin = ((from.points[k].flags & POINT_ORIGIN) >> POINT_ORIGIN_SHIFT) - 1;
    if (origin >= 0 && origin < count) std::swap(after[k], before[origin]);
  }
  for (int k = 0; k < count; ++k) {
    if (!before[k]) continue;
    manifold.getContactPoint(k).m_userPersistentData = before[k];
    manifold.clearUserCache(manifold.getContactPoint(k));
    manifold.getContactPoint(k).m_userPersistentData = nullptr;
  }
  manifold.setNumContacts(from.pointCount);
  for (int k = 0; k < from.pointCount; ++k) manifold.getContactPoint(k).m_userPersistentData = after[k];
}

}  // namespace

void ContactWriter::write(btDiscreteDynamicsWorld& world, const WorldReader& reader, const StepResults& results,
                          std::size_t others, bool dropParted) {
  const Zone zone("writeBackContacts");
  // Manifolds that others made: a step on the stock path, or the application's own performDiscreteCollisionDetection.
  if (!m_known || reader.hostBodiesChanged() ||
      static_cast<std::size_t>(world.getDispatcher()->getNumManifolds()) != m_registry->alive() + others) {
    takeOver(world, reader);
  }
  if (m_registry->hasRemoved() || !mergeKnown(results)) merge(world, reader, results);
  m_registry->reclaim();
  update(reader, results);
  removeParted(world, dropParted);
}

void ContactWriter::takeOver(btDiscreteDynamicsWorld& world, const WorldReader& reader) {
  m_known = true;
  m_entries.clear();
  m_registry->reclaim();
  btOverlappingPairCache& cache = *world.getPairCache();
  btBroadphasePairArray& pairs = cache.getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i) {
    btBroadphasePair& pair = pairs[i];
    if (!pair.m_algorithm) continue;
    const auto [a, b] = slotsOf(reader, pair);
    if (a == kNoSlot || b == kNoSlot || collidesOnHost(reader, {a, b})) continue;
    if (reader.childrenOf(a) || reader.childrenOf(b)) {
      m_compounds = true;
      for (const auto& c : DeviceCompoundAlgorithm::of(pair, *world.getDispatcher(), m_registry).contacts()) {
        m_entries.push_back({c.key, c.handle, kGone});
      }
    } else if (auto* ours = DeviceContactAlgorithm::of(pair, *world.getDispatcher(), m_registry)) {
      m_entries.push_back({pairKeyOf(a, b), ours->handle(), kGone});
    }
  }
  std::sort(m_entries.begin(), m_entries.end(), [](const Entry& x, const Entry& y) { return x.key < y.key; });
}

// merge() where no pair has begun to touch and no manifold has gone, on several threads. False if it is not so; then
// merge() has all to do.
bool ContactWriter::mergeKnown(const StepResults& results) {
  const Zone zone("mergeKnown");
  constexpr std::size_t kChunk = 2048;
  const std::vector<ulong>& keys = results.contactKeys;
  if (keys.size() > m_entries.size()) return false;
  m_fresh.resize(keys.size());
  std::uint32_t fresh = 0;
  for (std::size_t k = 0; k < keys.size(); ++k) m_fresh[k] = keys[k] & CONTACT_CARRIED ? kCarried : fresh++;
  m_matched.assign(chunkCount(m_entries.size(), kChunk), 0);
  parallelChunks(m_entries.size(), kChunk, [&](std::size_t chunk, std::size_t first, std::size_t last) {
    const auto keyAt = [&keys](std::size_t k) { return keys[k] & ~CONTACT_CARRIED; };
    const auto begin = std::lower_bound(keys.begin(), keys.end(), m_entries[first].key,
                                        [](ulong marked, ulong key) { return (marked & ~CONTACT_CARRIED) < key; });
    auto k = static_cast<std::size_t>(begin - keys.begin());
    std::size_t matched = 0;
    for (std::size_t i = first; i < last; ++i) {
      Entry& entry = m_entries[i];
      // A key without an entry stays behind, so that too few match.
      while (k < keys.size() && keyAt(k) < entry.key) ++k;
      const bool touching = k < keys.size() && keyAt(k) == entry.key;
      entry.contact = touching ? m_fresh[k++] : kGone;
      matched += touching;
    }
    m_matched[chunk] = matched;
  });
  return std::accumulate(m_matched.begin(), m_matched.end(), std::size_t{0}) == keys.size();
}

// Both lists are sorted by key. Entries stay while their manifold lives, whether it has points or not.
void ContactWriter::merge(btDiscreteDynamicsWorld& world, const WorldReader& reader, const StepResults& results) {
  const Zone zone("mergeContacts");
  m_next.clear();
  std::size_t known = 0;
  std::uint32_t fresh = 0;
  const auto keepUntil = [&](ulong key) {
    for (; known < m_entries.size() && m_entries[known].key < key; ++known) {
      if (m_registry->at(m_entries[known].handle))
        m_next.push_back({m_entries[known].key, m_entries[known].handle, kGone});
    }
  };
  for (const ulong marked : results.contactKeys) {
    const ulong key = marked & ~CONTACT_CARRIED;
    const std::uint32_t contact = marked & CONTACT_CARRIED ? kCarried : fresh++;
    keepUntil(key);
    if (known < m_entries.size() && m_entries[known].key == key) {
      const Entry entry = m_entries[known++];
      if (m_registry->at(entry.handle)) {
        m_next.push_back({key, entry.handle, contact});
        continue;
      }
    }
    append(world, reader, key, contact);
  }
  keepUntil(~ulong{0});
  std::swap(m_entries, m_next);
}

void ContactWriter::append(btDiscreteDynamicsWorld& world, const WorldReader& reader, ulong key,
                           std::uint32_t contact) {
  if (contact == kCarried) return;  // emptied by the application while asleep: comes back when it wakes, as in stock
  btBroadphasePair* pair = pairOf(world, reader, key);
  if (pair && isOfCompound(reader, key)) {
    m_compounds = true;
    // In the order of the manifold, which is set when it is filled.
    const auto* made = DeviceCompoundAlgorithm::of(*pair, *world.getDispatcher(), m_registry)
                           .contact(key, *reader.objectOf(static_cast<std::uint32_t>(key >> 32)),
                                    *reader.objectOf(static_cast<std::uint32_t>(key)));
    if (made) m_next.push_back({key, made->handle, contact});
    return;
  }
  auto* algorithm = pair ? DeviceContactAlgorithm::of(*pair, *world.getDispatcher(), m_registry) : nullptr;
  if (algorithm) m_next.push_back({key, algorithm->handle(), contact});
}

namespace {

// Something of the application's is to be called, or kept: for the caller's thread.
bool isSpecial(btPersistentManifold& manifold, bool touching) {
  const bool changes = (manifold.getNumContacts() > 0) != touching;
  return (changes && (touching ? gContactStartedCallback : gContactEndedCallback)) || hasUserData(manifold);
}

void fillFrom(const Manifold& from, ulong key, const WorldReader& reader, btPersistentManifold& manifold) {
  manifold.setBodies(reader.slots()[from.bodyA].object, reader.slots()[from.bodyB].object);
  fillManifold(from, manifold);
  nameShapes(from, reader, key, manifold);
}

}  // namespace

void ContactWriter::update(const WorldReader& reader, const StepResults& results) {
  const Zone zone("fillManifolds");
  // Manifolds lie anywhere in memory, and so do the bodies whose transforms give the points' world positions.
  const auto ask = [&](std::size_t i) {
    const Entry& entry = m_entries[i];
    if (entry.contact == kCarried) return;
    const btPersistentManifold* manifold = m_registry->at(entry.handle);
    if (entry.contact == kGone) {
      __builtin_prefetch(reinterpret_cast<const char*>(manifold + 1) - kLine);  // where its count of points is
      return;
    }
    prefetchToWrite(manifold, sizeof *manifold);
    for (const ulong slot : {entry.key >> 32, entry.key & 0xffffffff}) {
      const btCollisionObject* object = reader.objectOf(static_cast<std::uint32_t>(slot));
      if (object) prefetch(&object->getWorldTransform(), 2 * kLine);
    }
  };
  std::mutex mutex;
  std::vector<const Entry*> special;
  parallelFor(m_entries.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      if (i + kAhead < last) ask(i + kAhead);
      const Entry& entry = m_entries[i];
      if (entry.contact == kCarried) continue;
      btPersistentManifold& manifold = *m_registry->at(entry.handle);
      const bool touching = entry.contact != kGone;
      if (isSpecial(manifold, touching)) {
        const std::lock_guard<std::mutex> lock(mutex);
        special.push_back(&entry);
      } else if (touching) {
        fillFrom(results.contacts[entry.contact], entry.key, reader, manifold);
      } else if (manifold.getNumContacts() > 0) {
        manifold.setNumContacts(0);
      }
    }
  });
  std::sort(special.begin(), special.end());
  for (const Entry* entry : special) updateSpecial(reader, results, *entry);
}

void ContactWriter::updateSpecial(const WorldReader& reader, const StepResults& results, const Entry& entry) {
  btPersistentManifold* manifold = m_registry->at(entry.handle);
  if (!manifold) return;  // a callback before this one took the pair away
  if (entry.contact == kGone) {
    manifold->clearManifold();
    return;
  }
  const bool started = manifold->getNumContacts() == 0;
  carryUserData(results.contacts[entry.contact], *manifold);
  fillFrom(results.contacts[entry.contact], entry.key, reader, *manifold);
  if (started && gContactStartedCallback) gContactStartedCallback(manifold);
}

namespace {

btBroadphasePair* pairOf(btDiscreteDynamicsWorld& world, const btPersistentManifold& manifold) {
  auto* a = const_cast<btBroadphaseProxy*>(manifold.getBody0()->getBroadphaseHandle());
  auto* b = const_cast<btBroadphaseProxy*>(manifold.getBody1()->getBroadphaseHandle());
  return a && b ? world.getPairCache()->findPair(a, b) : nullptr;
}

}  // namespace

// Of two shapes of compounds the manifold goes when they part, as in stock: their bodies may stay together for ever,
// and touch with ever other shapes.
void ContactWriter::removeParted(btDiscreteDynamicsWorld& world, bool dropPairs) {
  if (!dropPairs && !m_compounds) return;
  for (const Entry& entry : m_entries) {
    btPersistentManifold* manifold = entry.contact == kGone ? m_registry->at(entry.handle) : nullptr;
    btBroadphasePair* pair = manifold ? pairOf(world, *manifold) : nullptr;
    if (!pair) continue;
    DeviceCompoundAlgorithm* compound = DeviceCompoundAlgorithm::find(*pair);
    if (compound) compound->release(manifold);
    if (dropPairs && (!compound || compound->contacts().empty())) {
      world.getPairCache()->removeOverlappingPair(pair->m_pProxy0, pair->m_pProxy1, world.getDispatcher());
    }
  }
}

BTGPU_TRANSLATION_END
