// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "read_world.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "../gpu_engine/zone.h"
#include "convert.h"
#include "parallel.h"
#include "read_bodies.h"
#include "support_check.h"

BTGPU_TRANSLATION_BEGIN
namespace {

template <typename T>
bool sameBits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

template <typename T>
void update(Tracked<T>& tracked, std::uint32_t i, const T& value, std::vector<std::uint32_t>& changed) {
  if (sameBits(tracked.values[i], value)) return;
  tracked.values[i] = value;
  changed.push_back(i);
}

// Only the rotation and the position count, not the padding of Bullet's vectors.
bool sameTransform(const btTransform& a, const btTransform& b) {
  for (int row = 0; row < 3; ++row) {
    if (std::memcmp(&a.getBasis()[row], &b.getBasis()[row], 3 * sizeof(btScalar)) != 0) return false;
  }
  return std::memcmp(&a.getOrigin(), &b.getOrigin(), 3 * sizeof(btScalar)) == 0;
}

constexpr std::size_t kChunk = 512;  // objects a thread reads at a time

BodyPose identityPose() { return {{0, 0, 0, 0}, {0, 0, 0, 1}}; }

}  // namespace

void WorldReader::read(btDiscreteDynamicsWorld& world, FallbackList& missing, FallbackList& notes) {
  const Zone zone("readWorld");
  ++m_step;
  m_hostShares.clear();
  m_globalCallback = globalContactCallback();
  const auto* dispatcher = static_cast<const btCollisionDispatcher*>(world.getDispatcher());
  m_shapes.begin(gContactBreakingThreshold, (dispatcher->getDispatcherFlags() &
                                             btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD) != 0);
  findObjects(world.getCollisionObjectArray());

  markIntegrated(world.getNonStaticRigidBodies());
  chooseRegion(missing);
  m_input.ignoredPairs.clear();
  readShapes(world, missing);
  readObjects(missing, notes);
  m_shapes.end(m_input);
  sortChanges();
}

void WorldReader::markIntegrated(const btAlignedObjectArray<btRigidBody*>& bodies) {
  parallelFor(static_cast<std::size_t>(bodies.size()), kChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const btRigidBody* body = bodies[static_cast<int>(i)];
      const int position = body->getWorldArrayIndex();
      if (position < 0 || position >= static_cast<int>(m_order.size())) continue;
      BodySlot& slot = m_slots[m_order[static_cast<std::size_t>(position)]];
      if (slot.object == body) slot.integrated = m_step;
    }
  });
}

// Objects are checked and their shapes noted on several threads, since it is waiting for memory that takes the time;
// the table of shapes is kept by one.
void WorldReader::readShapes(btDiscreteDynamicsWorld& world, FallbackList& missing) {
  const Zone zone("readShapes");
  const std::size_t count = m_order.size();
  m_orderShapes.assign(count, nullptr);
  m_orderShapeIndices.assign(count, -1);
  std::vector<FallbackList> missed(chunkCount(count, kChunk));
  parallelChunks(count, kChunk, [&](std::size_t chunk, std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      const btCollisionObject& object = *m_slots[m_order[k]].object;
      if (!checkObject(world, object, btRigidBody::upcast(&object), missed[chunk])) continue;
      m_orderShapes[k] = object.getCollisionShape();
    }
  });
  for (const FallbackList& list : missed) missing.addAll(list);
  for (std::size_t k = 0; k < count; ++k) {
    if (m_orderShapes[k]) m_orderShapeIndices[k] = m_shapes.read(m_orderShapes[k], m_input, missing, m_hostShares);
  }
}

void WorldReader::readObjects(FallbackList& missing, FallbackList& notes) {
  const Zone zone("readBodies");
  m_changes.resize(std::max(m_changes.size(), chunkCount(m_order.size(), kChunk)));
  parallelChunks(m_order.size(), kChunk, [this](std::size_t chunk, std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      const std::uint32_t slot = m_order[k];
      if (m_orderShapeIndices[k] >= 0) readObject(slot, m_orderShapeIndices[k], m_changes[chunk]);
      readIgnoredPairs(*m_slots[slot].object, slot, m_changes[chunk].ignoredPairs);
    }
  });
  for (Changes& changes : m_changes) take(changes, missing, notes);
}

void WorldReader::take(Changes& changes, FallbackList& missing, FallbackList& notes) {
  const auto append = [](auto& to, auto& from) {
    to.insert(to.end(), from.begin(), from.end());
    from.clear();
  };
  append(m_input.infos.changed, changes.infos);
  append(m_input.poses.changed, changes.poses);
  append(m_input.velocities.changed, changes.velocities);
  append(m_input.forces.changed, changes.forces);
  append(m_input.masses.changed, changes.masses);
  append(m_input.materials.changed, changes.materials);
  append(m_input.dampings.changed, changes.dampings);
  append(m_input.activations.changed, changes.activations);
  append(m_input.born, changes.born);
  append(m_input.ignoredPairs, changes.ignoredPairs);
  missing.addAll(changes.missing);
  notes.addAll(changes.notes);
  m_hostShares.addAll(changes.hostShares);
  m_hostBodiesChanged = m_hostBodiesChanged || changes.hostBodiesChanged;
  changes.missing.clear();
  changes.notes.clear();
  changes.hostShares.clear();
  changes.hostBodiesChanged = false;
}

// Gives every object of the world its slot: objects that stayed keep theirs, slots of those that left become
// free, then new ones get the lowest free slots in the order of the world's array.
void WorldReader::findObjects(const btCollisionObjectArray& objects) {
  const Zone zone("findObjects");
  const int count = objects.size();
  m_order.resize(static_cast<std::size_t>(count), kNoSlot);
  m_newObjects.clear();
  for (int i = 0; i < count; ++i) {
    const auto position = static_cast<std::size_t>(i);
    btCollisionObject* object = objects[i];
    std::uint32_t slot = m_order[position];
    if (slot == kNoSlot || slot >= m_slots.size() || m_slots[slot].object != object) slot = m_index.find(object);
    m_order[position] = slot;
    if (slot == kNoSlot) {
      m_newObjects.push_back(static_cast<std::uint32_t>(i));
    } else {
      m_slots[slot].seen = m_step;
    }
  }
  removeUnseen();
  for (const std::uint32_t slot : m_addedAgain) {
    if (m_slots[slot].object) becomeNew(slot, m_input.born);
  }
  m_addedAgain.clear();
  for (const std::uint32_t i : m_newObjects) {
    const std::uint32_t slot = m_index.insert(objects[static_cast<int>(i)]);
    growTo(m_index.slotCount());
    m_slots[slot] = BodySlot{};
    m_slots[slot].object = objects[static_cast<int>(i)];
    m_slots[slot].seen = m_step;
    m_order[i] = slot;
    m_input.born.push_back(slot);
  }
}

// Of an object that left and came back: it keeps its slot and nothing of what the last step knew of it.
void WorldReader::becomeNew(std::uint32_t slot, std::vector<std::uint32_t>& born) {
  born.push_back(slot);
  m_slots[slot].deviceQuarantined = false;
}

void WorldReader::noteAdded(const btCollisionObject* object) {
  const std::uint32_t slot = m_index.find(object);
  if (slot != kNoSlot) m_addedAgain.push_back(slot);
}

void WorldReader::removeUnseen() {
  for (std::uint32_t slot = 0; slot < m_slots.size(); ++slot) {
    if (!m_slots[slot].object || m_slots[slot].seen == m_step) continue;
    m_index.erase(slot);
    m_slots[slot] = BodySlot{};
    update(m_input.infos, slot, BodyInfo{}, m_input.infos.changed);
  }
}

void WorldReader::growTo(std::uint32_t slotCount) {
  if (slotCount <= m_input.bodyCount) return;
  m_slots.resize(slotCount);
  m_input.bodyCount = slotCount;
  m_input.infos.values.resize(slotCount);
  m_input.poses.values.resize(slotCount, identityPose());
  m_input.velocities.values.resize(slotCount);
  m_input.forces.values.resize(slotCount);
  m_input.masses.values.resize(slotCount);
  m_input.materials.values.resize(slotCount);
  m_input.dampings.values.resize(slotCount);
  m_input.activations.values.resize(slotCount);
}

// In a double world the device's floats count from an origin near the bodies, on a coarse grid: chosen when
// the first bodies come, and again when one leaves the region. A float world needs none: its own numbers are
// as coarse.
void WorldReader::chooseRegion(FallbackList& missing) {
  if (sizeof(btScalar) == sizeof(float) || m_order.empty()) return;
  constexpr double kGrid = 1024, kRegionSize = 8192;  // at its border a float's unit is 0.5 to 1 mm
  const Bounds bounds = boundsOfMoving();
  if (bounds.empty()) return;
  if (m_regionChosen && bounds.farthestFrom(m_input.regionOrigin) <= kRegionSize) return;
  m_regionChosen = true;
  double origin[3];
  for (int k = 0; k < 3; ++k) origin[k] = std::round((bounds.lower[k] + bounds.upper[k]) / 2 / kGrid) * kGrid;
  if (bounds.farthestFrom(origin) > kRegionSize) {
    missing.add("bodies far apart", "more than 16 km: too far for the device's floats");
  }
  if (std::equal(origin, origin + 3, m_input.regionOrigin)) return;
  std::copy(origin, origin + 3, m_input.regionOrigin);
  // Whoever came before knew another origin.
  for (const std::uint32_t slot : m_order) m_slots[slot].poseKnown = false;
}

WorldReader::Bounds WorldReader::boundsOfMoving() const {
  Bounds bounds;
  for (const std::uint32_t slot : m_order) {
    const btVector3& p = m_slots[slot].object->getWorldTransform().getOrigin();
    if (!isIntegrated(slot) || !std::isfinite(double(p.x() + p.y() + p.z()))) continue;
    for (int k = 0; k < 3; ++k) {
      bounds.lower[k] = std::min(bounds.lower[k], double(p[k]));
      bounds.upper[k] = std::max(bounds.upper[k], double(p[k]));
    }
  }
  return bounds;
}

double WorldReader::Bounds::farthestFrom(const double (&origin)[3]) const {
  double farthest = 0;
  for (int k = 0; k < 3; ++k) farthest = std::max({farthest, origin[k] - lower[k], upper[k] - origin[k]});
  return farthest;
}

void WorldReader::readObject(std::uint32_t i, int shapeIndex, Changes& changes) {
  BodySlot& slot = m_slots[i];
  const btCollisionObject& object = *slot.object;
  const int shapeType = m_input.shapes.values[static_cast<std::size_t>(shapeIndex)].type;
  if (shapeType == SHAPE_PLANE && !object.isStaticOrKinematicObject()) {
    changes.missing.add("plane on a body that moves", "Bullet's planes are static");
    return;
  }

  BodyRecord record = readBody(object, shapeIndex, isIntegrated(i));
  if (const char* callback = m_globalCallback ? m_globalCallback : contactCallback(object)) {
    record.info.flags |= BODY_HOST_CONTACTS;
    changes.hostShares.addShare(callback, "contacts by Bullet's own algorithm on the CPU");
  }
  const bool onHost = shapeType == SHAPE_HOST || (record.info.flags & BODY_HOST_CONTACTS);
  if (onHost != slot.onHost) changes.hostBodiesChanged = true;
  slot.onHost = onHost;
  const bool moved = !slot.poseKnown || !sameTransform(slot.lastTransform, object.getWorldTransform());
  const BodyPose pose = moved ? toPose(object.getWorldTransform(), m_input.regionOrigin) : m_input.poses.values[i];
  const BodyInfo& known = m_input.infos.values[i];
  // With btDbvtBroadphase the proxy's id changes when an object leaves and comes back, whoever took it there.
  if ((known.flags & BODY_PRESENT) && known.uniqueId != record.info.uniqueId) becomeNew(i, changes.born);

  const bool wasQuarantined = slot.quarantined;
  slot.quarantined = !isFiniteBody(record, pose);
  if (slot.quarantined) {
    if (!wasQuarantined)
      changes.notes.addShare("body", "NaN or infinite state: left out until the application gives it a finite one");
    record.info.flags |= BODY_QUARANTINED;
    update(m_input.infos, i, record.info, changes.infos);
    return;
  }
  // Quarantine by the device ends when the application gives the body a new state.
  if (slot.deviceQuarantined && (moved || !sameBits(record.velocity, m_input.velocities.values[i]))) {
    slot.deviceQuarantined = false;
  }
  if (slot.deviceQuarantined) record.info.flags |= BODY_QUARANTINED;

  update(m_input.infos, i, record.info, changes.infos);
  update(m_input.velocities, i, record.velocity, changes.velocities);
  update(m_input.forces, i, record.forces, changes.forces);
  update(m_input.masses, i, record.mass, changes.masses);
  update(m_input.materials, i, record.material, changes.materials);
  update(m_input.dampings, i, record.damping, changes.dampings);
  update(m_input.activations, i, record.activation, changes.activations);
  if (moved) {
    slot.lastTransform = object.getWorldTransform();
    slot.poseKnown = true;
    update(m_input.poses, i, pose, changes.poses);
  }
}

// Either of two objects may list the other (btCollisionDispatcher::needsCollision). The lists may hold objects that are
// gone: their addresses are only looked up.
void WorldReader::readIgnoredPairs(btCollisionObject& object, std::uint32_t slot, std::vector<ulong>& ignored) const {
  for (int k = 0; k < object.getNumObjectsWithoutCollision(); ++k) {
    const std::uint32_t other = m_index.find(object.getObjectWithoutCollision(k));
    if (other != kNoSlot && other != slot) ignored.push_back(pairKeyOf(slot, other));
  }
}

void WorldReader::sortChanges() {
  WorldInput& in = m_input;
  for (auto* list :
       {&in.infos.changed, &in.poses.changed, &in.velocities.changed, &in.forces.changed, &in.masses.changed,
        &in.materials.changed, &in.dampings.changed, &in.activations.changed, &in.shapes.changed, &in.born}) {
    std::sort(list->begin(), list->end());
    list->erase(std::unique(list->begin(), list->end()), list->end());
  }
  auto& ignored = in.ignoredPairs;
  std::sort(ignored.begin(), ignored.end());
  ignored.erase(std::unique(ignored.begin(), ignored.end()), ignored.end());
}

void WorldReader::acceptResults(const StepResults& results) {
  m_input.poses.values = results.poses;
  m_input.velocities.values = results.velocities;
  m_input.activations.values = results.activations;
  for (const std::uint32_t i : results.quarantined) {
    m_input.infos.values[i].flags |= BODY_QUARANTINED;
    m_slots[i].deviceQuarantined = !m_slots[i].quarantined;
  }
  m_input.clearChanges();
  m_hostBodiesChanged = false;
}

void WorldReader::clear() { *this = WorldReader(); }

BTGPU_TRANSLATION_END
