// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "95_gather_contacts.h"

#include <algorithm>

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/95_gather_contacts.cl";

// Contacts to expect after a step that had so many.
size_t withSpare(size_t count) { return count + count / 16 + 64; }

}  // namespace

GatherContacts::GatherContacts(ComputeDevice& device)
    : m_inPlace(device.shape() == KernelShape::Cpu),
      m_mark(device, kFile, "markContacts"),
      m_list(device, kFile, "listContacts"),
      m_gatherKeys(device, kFile, "gatherContactKeys"),
      m_gather(device, kFile, "gatherContacts") {}

void GatherContacts::enqueue(Queue& queue, DeviceWorld& world, bool all) {
  queue.enterStage("95_gather_contacts");
  const uint capacity = static_cast<uint>(world.capacities.pairs);
  const Grid chunks = queue.device().chunkGrid(capacity);
  for (auto* array : {&m_flags, &world.touching, &world.fresh}) array->resize(queue, capacity);
  m_chunkSums.resize(queue, 2 * chunks.groups());
  m_mark.launch(queue, chunks, capacity, all ? 1u : 0u, world.counters, world.manifolds, m_flags, m_chunkSums);
  m_list.launch(queue, chunks, capacity, world.counters, m_flags, m_chunkSums, world.touching, world.fresh);
}

void GatherContacts::read(Queue& queue, DeviceWorld& world, bool all) {
  m_hostKeys.resize(queue, m_touching);
  m_hostIndices.resize(queue, m_inPlace ? m_fresh : 0);
  m_hostContacts.resize(queue, m_inPlace ? 0 : m_fresh);
  if (m_touching == 0) return;
  queue.enterStage("95_send_contacts");
  m_keys.resize(queue, m_touching);
  m_gatherKeys.launch(queue, queue.device().grid(m_touching), static_cast<uint>(m_touching), all ? 1u : 0u,
                      world.counters, world.touching, world.keys, world.manifolds, m_keys);
  m_hostKeys.readFrom(queue, m_keys.buffer());
  if (m_fresh == 0) return;
  if (m_inPlace) {
    m_hostIndices.readFrom(queue, world.fresh.buffer());
    m_view.map(queue, world.manifolds, world.capacities.pairs);
    return;
  }
  m_contacts.resize(queue, m_fresh);
  m_gather.launch(queue, queue.device().grid(m_fresh), static_cast<uint>(m_fresh), world.counters, world.fresh,
                  world.manifolds, m_contacts);
  m_hostContacts.readFrom(queue, m_contacts.buffer());
}

void GatherContacts::enqueueReads(Queue& queue, DeviceWorld& world, bool all) {
  // Where the stage ran on the host, the arrays hold what there is and no more.
  m_touching = std::min(m_touching, world.touching.size());
  m_fresh = std::min(m_fresh, world.fresh.size());
  read(queue, world, all);
}

void GatherContacts::finishReads(Queue& queue, DeviceWorld& world, bool all, StepResults& results) {
  const size_t touching = results.counters.touchingCount, fresh = results.counters.freshCount;
  if (touching > m_touching || fresh > m_fresh) {
    m_touching = touching;
    m_fresh = fresh;
    endReads(queue);
    read(queue, world, all);
    const Zone zone("waitForContacts");
    queue.finish();
  }
  results.contactKeys.assign(m_hostKeys.data(), m_hostKeys.data() + touching);
  if (fresh == 0) {
    results.contacts = {};
  } else if (m_inPlace) {
    results.contacts = {m_view.data(), fresh, m_hostIndices.data()};
  } else {
    results.contacts = {m_hostContacts.data(), fresh};
  }
  m_touching = withSpare(touching);
  m_fresh = withSpare(fresh);
}

}  // namespace btgpu
