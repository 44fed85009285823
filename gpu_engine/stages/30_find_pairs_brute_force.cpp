// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "30_find_pairs_brute_force.h"

#include "../../kernels/shared/bvh.h"

namespace btgpu {
namespace {

constexpr const char* kFile = "stages/30_find_pairs_brute_force.cl";

}  // namespace

FindPairsBruteForce::FindPairsBruteForce(ComputeDevice& device)
    : m_brutePairs(device, kFile, "brutePairs"), m_pairs(device) {
  if (device.shape() == KernelShape::Cpu) m_layBoxes = Kernel(device, kFile, "layBoxes");
}

// On a CPU in blocks; a GPU takes them as they are.
const DeviceArray<Aabb>& FindPairsBruteForce::layBoxes(Queue& queue, const DeviceWorld& world) {
  const size_t bodies = world.bodyCount;
  m_order.resize(queue, bodies);
  if (!m_layBoxes.isBuilt()) return world.aabbs;
  m_boxes.resize(queue, boxesInBlocks(static_cast<uint>(bodies)));
  m_layBoxes.launch(queue, queue.device().grid(bodies), static_cast<uint>(bodies), world.aabbs, m_boxes, m_order);
  return m_boxes;
}

void FindPairsBruteForce::enqueue(Queue& queue, DeviceWorld& world) {
  queue.enterStage("30_find_pairs_brute_force");
  const size_t bodies = world.bodyCount;
  // Each is tried with half of the others: a little of that is worth a work item.
  constexpr size_t kTriesAnItem = 16;
  const Grid grid = queue.device().grid(bodies * (1 + bodies / kTriesAnItem));
  m_pairs.begin(queue, world);
  const DeviceArray<Aabb>& boxes = layBoxes(queue, world);
  m_brutePairs.launch(queue, grid, static_cast<uint>(bodies), static_cast<uint>(world.capacities.pairs), world.infos,
                      boxes, m_order, m_pairs.listed, m_pairs.list);
  m_pairs.finish(queue, world);
}

}  // namespace btgpu
