// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "95_gather_contacts.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/95_gather_contacts.cl";

}  // namespace

GatherContacts::GatherContacts(ComputeDevice& device)
    : m_mark(device, kFile, "markContacts"),
      m_count(device, kFile, "countContacts"),
      m_gatherKeys(device, kFile, "gatherContactKeys"),
      m_gather(device, kFile, "gatherContacts"),
      m_compact(device) {}

void GatherContacts::enqueue(Queue& queue, DeviceWorld& world, bool all) {
  queue.enterStage("95_gather_contacts");
  const size_t capacity = world.capacities.pairs;
  const Count count{capacity, &world.pairCount};
  for (auto* array : {&m_touchingFlags, &m_freshFlags, &world.touching, &world.fresh}) array->resize(queue, capacity);
  for (auto* array : {&m_touchingCount, &m_freshCount}) array->resize(queue, 1);
  m_mark.launch(queue, queue.device().grid(capacity), static_cast<uint>(capacity), all ? 1u : 0u, world.counters,
                world.manifolds, m_touchingFlags, m_freshFlags);
  m_compact.run(queue, count, m_touchingFlags, world.touching, m_touchingCount);
  m_compact.run(queue, count, m_freshFlags, world.fresh, m_freshCount);
  m_count.launch(queue, {1, 1}, m_touchingCount, m_freshCount, world.counters);
}

void GatherContacts::enqueueReads(Queue& queue, DeviceWorld& world, StepResults& results, bool all) {
  const size_t touching = results.counters.touchingCount, fresh = results.counters.freshCount;
  results.contactKeys.resize(touching);
  results.contacts = {};
  if (touching == 0) return;
  queue.enterStage("95_send_contacts");
  m_keys.resize(queue, touching);
  m_gatherKeys.launch(queue, queue.device().grid(touching), static_cast<uint>(touching), all ? 1u : 0u, world.touching,
                      world.keys, world.manifolds, m_keys);
  queue.read(m_keys.buffer(), 0, touching * sizeof(ulong), results.contactKeys.data(), false);
  if (fresh == 0) return;
  if (queue.device().shape() == KernelShape::Cpu) {
    results.contactIndices.resize(fresh);
    queue.read(world.fresh.buffer(), 0, fresh * sizeof(uint), results.contactIndices.data(), false);
    m_view.map(queue, world.manifolds, results.counters.pairCount);
    results.contacts = {m_view.data(), fresh, results.contactIndices.data()};
    return;
  }
  m_contacts.resize(queue, fresh);
  m_gather.launch(queue, queue.device().grid(fresh), static_cast<uint>(fresh), world.fresh, world.manifolds,
                  m_contacts);
  m_view.map(queue, m_contacts, fresh);
  results.contacts = {m_view.data(), fresh};
}

}  // namespace btgpu
