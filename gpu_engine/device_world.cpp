// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "device_world.h"

#include <algorithm>
#include <utility>

#include "../kernels/shared/team.h"
#include "debug/kernel_checks.h"
#include "slots.h"

namespace btgpu {
namespace {

// Beyond this many separate ranges one copy of the whole array is cheaper than many small ones.
constexpr size_t kMaxRanges = 64;
// Unchanged elements between two changed ones that are sent along rather than starting a new range.
constexpr std::uint32_t kGap = 16;

struct Range {
  size_t first, count;
};

std::vector<Range> mergeRanges(const std::vector<std::uint32_t>& changed) {
  std::vector<Range> ranges;
  for (const std::uint32_t i : changed) {
    if (!ranges.empty() && i <= ranges.back().first + ranges.back().count + kGap) {
      ranges.back().count = i - ranges.back().first + 1;
    } else {
      ranges.push_back({i, 1});
    }
  }
  return ranges;
}

template <typename T>
void uploadTracked(Queue& queue, const Tracked<T>& source, DeviceArray<T>& target) {
  const bool grown = target.size() != source.values.size();
  target.resize(queue, source.values.size());
  if (source.values.empty()) return;
  const auto ranges = mergeRanges(source.changed);
  if (grown || ranges.size() > kMaxRanges) {
    target.copyFromHost(queue, source.values, false);
    return;
  }
  for (const Range r : ranges) target.copyRangeFromHost(queue, source.values, r.first, r.count, false);
}

}  // namespace

void DeviceWorld::reserve(Queue& queue, const Capacities& wanted, bool twoFriction, bool torsionRows) {
  Capacities& c = capacities;
  c.bodies = std::max(c.bodies, wanted.bodies);
  c.pairs = std::max(c.pairs, wanted.pairs);
  c.slots = std::max(c.slots, (wanted.slots + BTGPU_LANES - 1) / BTGPU_LANES * BTGPU_LANES);
  c.triangleHits = std::max(c.triangleHits, wanted.triangleHits);
  c.colourLaunches = std::min<uint>(COLOUR_LIMIT, wanted.colourLaunches);
  c.colourRounds = std::max(c.colourRounds, wanted.colourRounds);
  c.residentGroups = wanted.residentGroups;
  c.colourGroups = wanted.colourGroups;

  const auto resizeAll = [&queue](size_t size, auto&... arrays) {
    (arrays.resize(queue, std::max(size, arrays.size())), ...);
  };
  resizeAll(c.bodies, born, steps, aabbs, stepActivations, roots, islandFlags, solved, solverBodies, solverMasses);
  resizeAll(c.pairs, keys, pairs, items, contacts, manifolds, constraints, oldKeys, oldManifolds);
  resizeAll(1, pairCount, oldPairCount, manifoldCount, constraintCount, params, counters, hostAabbs);
  if (!m_begun) {
    // No manifolds yet. Both, since the step of an empty world swaps them without a kernel having run.
    pairCount.copyFromHost(queue, {0u});
    oldPairCount.copyFromHost(queue, {0u});
    solverTeam.copyFromHost(queue, std::vector<uint>(TEAM_SIZE, 0));
    m_begun = true;
  }
  resizeAll(BUCKET_COUNT + 1, bucketFirst);
  if (c.triangleHits > 0) resizeAll(c.triangleHits, triangleHits, triangleTouches);
  resizeAll(COLOUR_TABLE, slotFirst);
  resizeAll(c.slots, slots);
  resizeAll(c.slots * SLOT_FIELDS, rows);
  if (twoFriction) resizeAll(c.slots * SLOT_TANGENT2_FIELDS, tangent2);
  if (torsionRows) resizeAll(c.slots * SLOT_TORSION_FIELDS, torsion);
}

void DeviceWorld::reserveSubsteps(Queue& queue, bool torsionRows) {
  const auto atLeast = [&queue](size_t size, auto& array) { array.resize(queue, std::max(size, array.size())); };
  atLeast(capacities.bodies, substepStarts);
  atLeast(capacities.slots * SLOT_SOFT_FIELDS, softRows);
  if (torsionRows) atLeast(capacities.slots * SLOT_ROLL_FIELDS, rolls);
}

// A body that is new, or not where it was, has no AABB yet (but those of WorldInput::keptAabbs); an empty one says so.
static const Aabb kNoAabb = {{1, 1, 1, 0}, {-1, -1, -1, 0}};

void DeviceWorld::upload(Queue& queue, const WorldInput& input) {
  bodyCount = input.bodyCount;
  uploadTracked(queue, input.infos, infos);
  uploadTracked(queue, input.poses, poses);
  uploadTracked(queue, input.velocities, velocities);
  uploadTracked(queue, input.activations, activations);
  uploadTracked(queue, input.forces, forces);
  uploadTracked(queue, input.masses, masses);
  uploadTracked(queue, input.materials, materials);
  uploadTracked(queue, input.dampings, dampings);
  uploadTracked(queue, input.shapes, shapes);
  uploadTracked(queue, input.childPoses, childPoses);
  if (!input.hostAabbs.empty()) hostAabbs.copyFromHost(queue, input.hostAabbs, false);
  hostManifoldCount = static_cast<uint>(input.hostManifolds.size());
  if (hostManifoldCount > 0) hostManifolds.copyFromHost(queue, input.hostManifolds, false);
  uploadHulls(queue, input.hulls);
  uploadMeshes(queue, input.meshes);

  uploadBorn(queue, input.born, input.replaceManifolds);
  if (input.replaceManifolds) uploadManifolds(queue, input);
  uploadJoints(queue, input);
  listedCount = static_cast<uint>(input.listedPairs.size());
  onlyListed = input.onlyListedPairs;
  if (listedCount > 0 && input.listedPairs != m_listedPairs) {
    m_listedPairs = input.listedPairs;
    listedPairs.copyFromHost(queue, m_listedPairs, false);
  }
}

static bool sameBodies(const std::vector<Joint>& a, const std::vector<Joint>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Joint& x, const Joint& y) { return x.bodyA == y.bodyA && x.bodyB == y.bodyB; });
}

void DeviceWorld::uploadJoints(Queue& queue, const WorldInput& input) {
  jointCount = static_cast<uint>(input.joints.size());
  jointIterations = 0;
  for (const Joint& j : input.joints) {
    if (j.rowCount > 0) jointIterations = std::max(jointIterations, j.iterations);
  }
  if (jointCount == 0) return;
  joints.copyFromHost(queue, input.joints, false);
  if (!input.jointRows.empty()) jointRows.copyFromHost(queue, input.jointRows, false);
  jointEffects.resize(queue, input.jointRows.size());
  jointImpulses.resize(queue, input.jointRows.size());
  jointSolved.resize(queue, jointCount);
  uploadLastImpulses(queue, input);
  softJointRows.resize(queue, input.jointRows.size());
  if (!sameBodies(input.joints, m_colouredJoints)) colourJoints(queue, input);
  if (queue.device().shape() == KernelShape::Cpu) layJoints(queue, input.joints);
}

// Zeros where none are known: those are there once for all.
void DeviceWorld::uploadLastImpulses(Queue& queue, const WorldInput& input) {
  const size_t count = input.jointRows.size();
  const bool zeros = input.jointImpulses.empty();
  if (count == 0 || (zeros && m_noLastImpulses && count <= m_lastJointImpulses.size())) return;
  m_noLastImpulses = zeros;
  m_lastJointImpulses = input.jointImpulses;
  m_lastJointImpulses.resize(count, 0.0f);
  lastJointImpulses.copyFromHost(queue, m_lastJointImpulses, false);
}

void DeviceWorld::colourJoints(Queue& queue, const WorldInput& input) {
  m_colouredJoints = input.joints;
  m_laidRowCounts.clear();
  jointColours = btgpu::colourJoints(input.joints, input.bodyCount);
  if (!jointColours.order.empty()) jointOrder.copyFromHost(queue, jointColours.order, false);
}

// How many rows a joint has may change from step to step, but mostly does not.
void DeviceWorld::layJoints(Queue& queue, const std::vector<Joint>& input) {
  std::vector<uint> counts;
  counts.reserve(input.size());
  for (const Joint& j : input) counts.push_back(j.rowCount);
  if (counts == m_laidRowCounts) return;
  m_laidRowCounts = std::move(counts);
  m_jointBlocks = blocksOf(jointColours, input);
  jointBlockColours.copyFromHost(queue, m_jointBlocks.colours, false);
  jointBlockRows.copyFromHost(queue, m_jointBlocks.rows, false);
  if (!m_jointBlocks.lanes.empty()) jointLanes.copyFromHost(queue, m_jointBlocks.lanes, false);
  jointHeads.resize(queue, m_jointBlocks.lanes.size() * JOINT_HEAD_FIELDS);
  jointLaneRows.resize(queue, size_t{m_jointBlocks.rows.back()} * JOINT_ROW_FIELDS * JOINT_LANES);
}

void DeviceWorld::uploadHulls(Queue& queue, const HullArrays& hulls) {
  if (hulls.vertices.empty() || (!hulls.changed && !hullVertices.empty())) return;
  m_paddedVertices = hulls.vertices;
  m_paddedVertices.resize(hulls.vertices.size() + HULL_PADDING);
  hullVertices.copyFromHost(queue, m_paddedVertices, false);
  hullFaces.copyFromHost(queue, hulls.faces, false);
  hullCorners.copyFromHost(queue, hulls.corners, false);
  // A kernel's argument has to be something, even where all hulls are points.
  static const std::vector<HullEdge> kNoEdges(1);
  hullEdges.copyFromHost(queue, hulls.edges.empty() ? kNoEdges : hulls.edges, false);
}

void DeviceWorld::uploadMeshes(Queue& queue, const MeshArrays& arrays) {
  if (arrays.meshes.empty() || (!arrays.changed && !meshes.empty())) return;
  mostMeshParts = 0;
  for (const Mesh& mesh : arrays.meshes) mostMeshParts = std::max(mostMeshParts, static_cast<uint>(mesh.partCount));
  meshes.copyFromHost(queue, arrays.meshes, false);
  // A kernel's argument has to be something, even where all meshes are empty.
  const auto copy = [&queue](const auto& from, auto& to) {
    static const std::decay_t<decltype(from)> kNone(1);
    to.copyFromHost(queue, from.empty() ? kNone : from, false);
  };
  copy(arrays.triangles, meshTriangles);
  copy(arrays.nodes, meshNodes);
  copy(arrays.parts, meshParts);
}

void DeviceWorld::keepAabbs(Queue& queue, const WorldInput& input) {
  forgetStaleAabbs(queue, input);
  for (const KeptAabb& kept : input.keptAabbs) {
    queue.write(oldAabbs.buffer(), kept.slot * sizeof(Aabb), sizeof(Aabb), &kept.box, false);
  }
}

void DeviceWorld::forgetStaleAabbs(Queue& queue, const WorldInput& input) {
  if (!input.shapes.changed.empty() || input.replaceManifolds) {
    m_noAabbs.assign(bodyCount, kNoAabb);
    queue.write(oldAabbs.buffer(), 0, bodyCount * sizeof(Aabb), m_noAabbs.data(), false);
    return;
  }
  for (const auto* changed : {&input.poses.changed, &input.infos.changed}) {
    for (const std::uint32_t i : *changed)
      queue.write(oldAabbs.buffer(), i * sizeof(Aabb), sizeof(Aabb), &kNoAabb, false);
  }
  if (input.childPoses.values.empty() || input.unchanged()) return;
  const auto isIn = [](const std::vector<std::uint32_t>& list, std::uint32_t i) {
    return std::binary_search(list.begin(), list.end(), i);
  };
  for (std::uint32_t i = 0; i < bodyCount; ++i) {
    const BodyInfo& info = input.infos.values[i];
    if (!(info.flags & BODY_CHILD)) continue;
    if (isIn(input.poses.changed, info.parent) || isIn(input.infos.changed, info.parent) ||
        isIn(input.childPoses.changed, i)) {
      queue.write(oldAabbs.buffer(), i * sizeof(Aabb), sizeof(Aabb), &kNoAabb, false);
    }
  }
}

void DeviceWorld::uploadBorn(Queue& queue, const std::vector<std::uint32_t>& bornNow, bool manifoldsKnowThem) {
  const size_t oldCount = m_knownAabbs;
  oldAabbs.resize(queue, std::max(oldAabbs.size(), bodyCount));
  if (bodyCount > oldCount) {
    m_noAabbs.assign(bodyCount - oldCount, kNoAabb);
    queue.write(oldAabbs.buffer(), oldCount * sizeof(Aabb), m_noAabbs.size() * sizeof(Aabb), m_noAabbs.data(), false);
  }
  for (const std::uint32_t i : bornNow) {
    if (i < oldCount) queue.write(oldAabbs.buffer(), i * sizeof(Aabb), sizeof(Aabb), &kNoAabb, false);
  }
  m_knownAabbs = bodyCount;
  if (bornNow.empty() && !m_anyBorn && bodyCount == oldCount) return;
  m_anyBorn = !bornNow.empty();
  m_bornFlags.assign(bodyCount, 0);
  // Manifolds that come along with new bodies are theirs.
  for (const std::uint32_t i : bornNow) m_bornFlags[i] = manifoldsKnowThem ? 0 : 1;
  born.copyFromHost(queue, m_bornFlags, false);
}

// Keys are of slots, manifolds of bodies.
void DeviceWorld::uploadManifolds(Queue& queue, const WorldInput& input) {
  std::vector<Manifold>& source = m_manifolds;
  source = input.manifolds;
  m_keys.clear();
  for (Manifold& m : source) {
    m_keys.push_back(pairKeyOf(m.bodyA, m.bodyB));
    m.bodyA = ownerOf(input.infos.values, m.bodyA);
    m.bodyB = ownerOf(input.infos.values, m.bodyB);
  }
  m_count.assign(1, static_cast<uint>(source.size()));
  oldKeys.resize(queue, std::max(oldKeys.size(), source.size()));
  oldManifolds.resize(queue, std::max(oldManifolds.size(), source.size()));
  oldPairCount.copyFromHost(queue, m_count, false);
  queue.write(oldKeys.buffer(), 0, m_keys.size() * sizeof(ulong), m_keys.data(), false);
  queue.write(oldManifolds.buffer(), 0, source.size() * sizeof(Manifold), source.data(), false);
}

void DeviceWorld::keepMatchedManifolds(Queue& queue) {
  matchedManifolds.resize(queue, manifolds.size());
  queue.copy(manifolds.buffer(), matchedManifolds.buffer(), 0, 0, manifolds.size() * sizeof(Manifold));
}

void DeviceWorld::spoilStepArrays(Queue& queue) {
  const auto spoilAll = [&queue](const auto&... arrays) {
    (fillWithPattern(queue, arrays.buffer(), 0, arrays.capacityBytes()), ...);
  };
  spoilAll(steps, aabbs, stepActivations, roots, islandFlags, solved, solverBodies, solverMasses);
  spoilAll(keys, pairs, items, bucketFirst, contacts, axes, closest, nearPairs, manifolds, constraints);
  spoilAll(triangleFound, triangleFirst, triangleHits, triangleTouches);
  spoilAll(nearCount, manifoldCount, constraintCount, jointEffects, jointImpulses, jointSolved);
  spoilAll(jointHeads, jointLaneRows);
  spoilAll(slotFirst, slots, rows, tangent2, torsion);
  spoilAll(split.copyFirst, split.joints, split.copies, split.copyMasses, split.jointRows);
  spoilAll(batches.groupBatches, batches.batchFirst);
  spoilAll(softRows, rolls, substepStarts, softJointRows);
}

void DeviceWorld::swapStepResults() {
  swap(oldAabbs, aabbs);
  swap(oldKeys, keys);
  swap(oldPairCount, pairCount);
  swap(oldManifolds, manifolds);
}

void DeviceWorld::swapWithSpare() {
  swap(aabbs, spareAabbs);
  swap(keys, sparePairKeys);
  swap(pairCount, sparePairCount);
  swap(manifolds, spareManifolds);
}

void DeviceWorld::advance(Queue& queue) {
  spareAabbs.resize(queue, std::max({spareAabbs.size(), aabbs.size(), oldAabbs.size()}));
  sparePairKeys.resize(queue, std::max({sparePairKeys.size(), keys.size(), oldKeys.size()}));
  sparePairCount.resize(queue, 1);
  spareManifolds.resize(queue, std::max({spareManifolds.size(), manifolds.size(), oldManifolds.size()}));
  swapStepResults();
  swapWithSpare();
}

void DeviceWorld::retreat() {
  swapWithSpare();
  swapStepResults();
}

void DeviceWorld::dropSpare() {
  spareAabbs = DeviceArray<Aabb>{spareAabbs.name()};
  sparePairKeys = DeviceArray<ulong>{sparePairKeys.name()};
  sparePairCount = DeviceArray<uint>{sparePairCount.name()};
  spareManifolds = DeviceArray<Manifold>{spareManifolds.name()};
}

bool DeviceWorld::holds(const WorldInput& input) const {
  return input.bodyCount == bodyCount && input.unchanged() && input.hostAabbs.empty() && input.hostManifolds.empty() &&
         hostManifoldCount == 0 && input.joints.empty() && jointCount == 0 && input.onlyListedPairs == onlyListed &&
         (input.listedPairs.empty() ? listedCount == 0
                                    : input.listedPairs.size() == listedCount && input.listedPairs == m_listedPairs);
}

void DeviceWorld::forgetBodies(Queue& queue) {
  infos.resize(queue, 0);
  poses.resize(queue, 0);
  velocities.resize(queue, 0);
  activations.resize(queue, 0);
}

void DeviceWorld::forgetUploads(Queue& queue) {
  forgetBodies(queue);
  forces.resize(queue, 0);
  masses.resize(queue, 0);
  materials.resize(queue, 0);
  dampings.resize(queue, 0);
  shapes.resize(queue, 0);
  childPoses.resize(queue, 0);
  hullVertices.resize(queue, 0);
  meshes.resize(queue, 0);
  m_anyBorn = true;
  m_colouredJoints.clear();
  m_laidRowCounts.clear();
  m_noLastImpulses = false;
  m_listedPairs.clear();
}

}  // namespace btgpu
