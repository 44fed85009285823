// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "50_append_host_contacts.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/50_append_host_contacts.cl";

}  // namespace

AppendHostContacts::AppendHostContacts(ComputeDevice& device)
    : m_count(device, kFile, "countHostContacts"), m_append(device, kFile, "appendHostContacts") {}

void AppendHostContacts::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("50_append_host_contacts");
  m_count.launch(queue, {1, 1}, static_cast<uint>(world.capacities.pairs), world.params, world.counters,
                 world.manifoldCount);
  m_append.launch(queue, queue.device().grid(world.hostManifoldCount), world.params, world.counters,
                  world.hostManifolds, world.manifolds);
}

}  // namespace btgpu
