// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The device's contacts as btPersistentManifolds in the application's dispatcher: made when two bodies begin to touch,
// updated in place while they do, emptied when they part, and released by Bullet with their pair. So a manifold's
// address is that of the pair as long as the pair lives, as in stock.
#pragma once

#include "contact_algorithm.h"
#include "read_world.h"

BTGPU_TRANSLATION_BEGIN

class ContactWriter {
 public:
  // Brings the dispatcher's manifolds to where the step has left them. To be called before the bodies are written back:
  // as in stock, the points' world positions belong to the poses that the step started from. `others`: manifolds of
  // pairs that the host collides. `dropParted`: the host's broadphase is not kept current, so pairs that came apart are
  // taken out of it here.
  void write(btDiscreteDynamicsWorld& world, const WorldReader& reader, const StepResults& results, std::size_t others,
             bool dropParted);

  // The dispatcher's manifolds may have changed otherwise, or the reader's slots stand for other bodies: the next
  // write() looks at all of them.
  void forget() { m_known = false; }

  // True until write() has seen the world: then StepResults must hold every contact, carried or not.
  bool isFresh() const { return !m_known; }

 private:
  static constexpr std::uint32_t kCarried = 0xffffffff, kGone = 0xfffffffe;
  // A manifold of the dispatcher and the pair that it belongs to.
  struct Entry {
    ulong key;
    std::uint32_t handle;
    std::uint32_t contact;  // index in StepResults::contacts, kCarried or kGone
  };

  void takeOver(btDiscreteDynamicsWorld& world, const WorldReader& reader);
  bool mergeKnown(const StepResults& results);
  void merge(btDiscreteDynamicsWorld& world, const WorldReader& reader, const StepResults& results);
  void append(btDiscreteDynamicsWorld& world, const WorldReader& reader, ulong key, std::uint32_t contact);
  void update(const WorldReader& reader, const StepResults& results);
  void updateSpecial(const WorldReader& reader, const StepResults& results, const Entry& entry);
  void removeParted(btDiscreteDynamicsWorld& world, bool dropPairs);

  std::shared_ptr<ManifoldRegistry> m_registry = std::make_shared<ManifoldRegistry>();
  std::vector<Entry> m_entries, m_next;  // by key, ascending
  std::vector<std::size_t> m_matched;    // by chunk of entries
  std::vector<std::uint32_t> m_fresh;    // by place in StepResults::contactKeys: index in ::contacts
  bool m_known = false;
  bool m_compounds = false;  // some entries are, or were, of shapes of compounds
};

BTGPU_TRANSLATION_END
