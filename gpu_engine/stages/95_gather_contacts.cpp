// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "95_gather_contacts.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/95_gather_contacts.cl";

}  // namespace

GatherContacts::GatherContacts(ComputeDevice& device)
    : m_inPlace(device.shape() == KernelShape::Cpu),
      m_mark(device, kFile, "markContacts"),
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

void GatherContacts::enqueueReads(Queue& queue, DeviceWorld& world, const StepCounters& counters, bool all) {
  const size_t touching = counters.touchingCount, fresh = counters.freshCount;
  m_hostKeys.resize(queue, touching);
  m_hostIndices.resize(queue, m_inPlace ? fresh : 0);
  m_hostContacts.resize(queue, m_inPlace ? 0 : fresh);
  if (touching == 0) return;
  queue.enterStage("95_send_contacts");
  m_keys.resize(queue, touching);
  m_gatherKeys.launch(queue, queue.device().grid(touching), static_cast<uint>(touching), all ? 1u : 0u, world.touching,
                      world.keys, world.manifolds, m_keys);
  m_hostKeys.readFrom(queue, m_keys.buffer());
  if (fresh == 0) return;
  if (m_inPlace) {
    m_hostIndices.readFrom(queue, world.fresh.buffer());
    m_view.map(queue, world.manifolds, counters.pairCount);
    return;
  }
  m_contacts.resize(queue, fresh);
  m_gather.launch(queue, queue.device().grid(fresh), static_cast<uint>(fresh), world.fresh, world.manifolds,
                  m_contacts);
  m_hostContacts.readFrom(queue, m_contacts.buffer());
}

void GatherContacts::show(StepResults& results) {
  m_hostKeys.copyTo(results.contactKeys);
  if (m_inPlace) {
    results.contacts = {m_view.data(), m_hostIndices.size(), m_hostIndices.data()};
  } else {
    results.contacts = {m_hostContacts.data(), m_hostContacts.size()};
  }
}

}  // namespace btgpu
