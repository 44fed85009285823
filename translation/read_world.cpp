// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "read_world.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "../gpu_engine/zone.h"
#include "convert.h"
#include "parallel.h"
#include "prefetch.h"
#include "read_bodies.h"
#include "support_check.h"

BTGPU_TRANSLATION_BEGIN
namespace {

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

template <typename T>
bool same(const Tracked<T>& tracked, std::uint32_t i, const T& value) {
  return sameBits(tracked.values[i], value);
}

constexpr std::size_t kChunk = 256;  // objects a thread reads at a time

// Whether `array` holds just what is in `known`.
template <typename T>
bool sameElements(const btAlignedObjectArray<T>& array, const std::vector<T>& known) {
  const auto count = static_cast<std::size_t>(array.size());
  return count == known.size() && (count == 0 || std::equal(known.begin(), known.end(), &array[0]));
}

template <typename T>
void copyElements(const btAlignedObjectArray<T>& array, std::vector<T>& known) {
  known.clear();
  if (array.size() > 0) known.assign(&array[0], &array[0] + array.size());
}

BodyPose identityPose() { return {{0, 0, 0, 0}, {0, 0, 0, 1}}; }

}  // namespace

void WorldReader::read(btDiscreteDynamicsWorld& world, FallbackList& missing, FallbackList& notes) {
  const Zone zone("readWorld");
  ++m_step;
  m_ownFilter = world.getPairCache()->getOverlapFilterCallback() != nullptr;
  m_useContinuous = world.getDispatchInfo().m_useContinuous;
  const auto* dispatcher = static_cast<const btCollisionDispatcher*>(world.getDispatcher());
  m_globalCallback = globalContactCallback(*dispatcher);
  m_shapes.configure(
      gContactBreakingThreshold,
      (dispatcher->getDispatcherFlags() & btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD) != 0);
  m_shapes.setOwnAlgorithms(typesWithOwnAlgorithms(*dispatcher));
  const btCollisionObjectArray& objects = world.getCollisionObjectArray();
  const auto& bodies = world.getNonStaticRigidBodies();
  m_objectsKnown = isListed(objects, bodies);
  if (!m_objectsKnown) {
    findObjects(objects);
    markIntegrated(bodies);
    m_shapesKnown = false;
  }
  chooseRegion(missing);
  m_changes.resize(chunkCount(m_order.size(), kChunk));
  if (!m_shapesKnown || !readKnownObjects(missing)) {
    readShapes(missing);
    readObjects();
    m_shapesKnown = true;
  }
  mergeIgnored();
  m_sweptBodies.clear();
  for (Changes& changes : m_changes) take(changes, missing, notes);
  readCompounds();
  m_shapes.end(m_input);
  sortChanges();
}

bool WorldReader::isListed(const btCollisionObjectArray& objects,
                           const btAlignedObjectArray<btRigidBody*>& bodies) const {
  return m_addedAgain.empty() && sameElements(objects, m_objects) && sameElements(bodies, m_bodies);
}

void WorldReader::markIntegrated(const btAlignedObjectArray<btRigidBody*>& bodies) {
  copyElements(bodies, m_bodies);
  for (BodySlot& slot : m_slots) slot.integrated = false;
  parallelFor(m_bodies.size(), kChunk, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const btRigidBody* body = m_bodies[i];
      const int position = body->getWorldArrayIndex();
      if (position < 0 || position >= static_cast<int>(m_order.size())) continue;
      BodySlot& slot = m_slots[m_order[static_cast<std::size_t>(position)]];
      if (slot.object == body) slot.integrated = true;
    }
  });
}

// work(position, object, changes), on several threads.
template <typename Work>
void WorldReader::forEachObject(const Work& work) {
  parallelChunks(m_order.size(), kChunk, [&](std::size_t chunk, std::size_t first, std::size_t last) {
    Changes& changes = m_changes[chunk];
    changes.missing.clear();
    changes.hostShares.clear();
    changes.swept.clear();
    changes.reshaped = false;
    const std::size_t end = m_objects.size();
    for (std::size_t k = first; k < last; ++k) {
      if (k + 2 * kAhead < end) prefetch(m_objects[k + 2 * kAhead], sizeof(btRigidBody));
      if (k + kAhead < last) prefetch(m_objects[k + kAhead]->getBroadphaseHandle(), sizeof(btBroadphaseProxy));
      work(k, *m_objects[k], changes);
    }
    if (m_objectsKnown && ignoredAsBefore(changes, first, last)) return;
    changes.ignoredChanged = true;
    findIgnored(changes, first, last);
  });
}

// Objects are checked and their shapes noted on several threads, since it is waiting for memory that takes the time;
// the table of shapes is kept by one.
void WorldReader::readShapes(FallbackList& missing) {
  const Zone zone("readShapes");
  m_hostShares.clear();
  m_orderShapes.assign(m_order.size(), nullptr);
  m_orderShapeIndices.assign(m_order.size(), -1);
  forEachObject([&](std::size_t k, btCollisionObject& object, Changes& changes) {
    if (checkObject(object, changes.missing)) m_orderShapes[k] = object.getCollisionShape();
  });
  for (const Changes& changes : m_changes) missing.addAll(changes.missing);
  m_shapes.begin();
  for (std::size_t k = 0; k < m_order.size(); ++k) {
    if (m_orderShapes[k]) m_orderShapeIndices[k] = m_shapes.read(m_orderShapes[k], m_input, missing, m_hostShares);
  }
}

void WorldReader::readObjects() {
  const Zone zone("readBodies");
  forEachObject([this](std::size_t k, btCollisionObject&, Changes& changes) {
    if (m_orderShapeIndices[k] >= 0) readObject(m_order[k], m_orderShapeIndices[k], changes);
  });
}

// The same in one walk, as long as every object still has the shape that it had, and no shape has become another one.
// False if it is not so: then what it has found of shapes and objects is for nothing.
bool WorldReader::readKnownObjects(FallbackList& missing) {
  const Zone zone("readKnown");
  forEachObject([&](std::size_t k, btCollisionObject& object, Changes& changes) {
    const bool usable = checkObject(object, changes.missing);
    if ((usable ? object.getCollisionShape() : nullptr) != m_orderShapes[k]) {
      changes.reshaped = true;
      return;
    }
    if (m_orderShapeIndices[k] >= 0) readObject(m_order[k], m_orderShapeIndices[k], changes);
  });
  if (std::any_of(m_changes.begin(), m_changes.end(), [](const Changes& c) { return c.reshaped; })) return false;
  m_hostShares.clear();
  return m_shapes.readKnown(m_input, missing, m_hostShares);
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
  append(m_sweptBodies, changes.swept);
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
// free, then new ones get the lowest free slots in the order of the world's array. What was added again is new too: it
// may be another object at the address of one that is gone, and slots must not depend on addresses.
void WorldReader::findObjects(const btCollisionObjectArray& objects) {
  const Zone zone("findObjects");
  copyElements(objects, m_objects);
  for (const std::uint32_t slot : m_addedAgain) release(slot);
  m_addedAgain.clear();
  m_order.resize(m_objects.size(), kNoSlot);
  m_newObjects.clear();
  for (std::size_t position = 0; position < m_objects.size(); ++position) {
    btCollisionObject* object = m_objects[position];
    std::uint32_t slot = m_order[position];
    if (slot == kNoSlot || slot >= m_slots.size() || m_slots[slot].object != object) slot = m_index.find(object);
    m_order[position] = slot;
    if (slot == kNoSlot) {
      m_newObjects.push_back(static_cast<std::uint32_t>(position));
    } else {
      m_seen[slot] = m_step;
    }
  }
  removeUnseen();
  for (const std::uint32_t i : m_newObjects) {
    const std::uint32_t slot = m_index.insert(m_objects[i]);
    growTo(m_index.slotCount());
    m_slots[slot] = BodySlot{};
    m_slots[slot].object = m_objects[i];
    m_seen[slot] = m_step;
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
    if (m_seen[slot] != m_step) release(slot);
  }
}

// Of an object, with those of its shapes; nothing if it is free.
void WorldReader::release(std::uint32_t slot) {
  if (!m_slots[slot].object) return;
  if (const auto* children = childrenOf(slot)) {
    for (const std::uint32_t child : *children) releaseChild(child);
    m_children.erase(slot);
  }
  m_index.erase(slot);
  m_slots[slot] = BodySlot{};
  update(m_input.infos, slot, BodyInfo{}, m_input.infos.changed);
}

void WorldReader::releaseChild(std::uint32_t slot) {
  m_index.erase(slot);
  m_slots[slot] = BodySlot{};
  update(m_input.infos, slot, BodyInfo{}, m_input.infos.changed);
}

// The shapes of compounds have slots of their own, which follow what has become of the bodies in this read. In the
// world's order, so that the slots depend on nothing else.
void WorldReader::readCompounds() {
  if (!m_shapes.hasCompounds() && m_children.empty()) return;
  const Zone zone("readCompounds");
  for (std::size_t k = 0; k < m_order.size(); ++k) {
    const std::uint32_t body = m_order[k];
    const int shape = m_orderShapeIndices[k];
    if (shape >= 0 && m_input.shapes.values[static_cast<std::size_t>(shape)].type == SHAPE_COMPOUND) {
      readChildren(body, m_shapes.leaves(shape), m_children[body]);
    } else if (const auto* children = childrenOf(body)) {
      for (const std::uint32_t child : *children) releaseChild(child);
      m_children.erase(body);
    }
  }
  const std::vector<std::uint32_t> born = m_input.born;
  for (const std::uint32_t slot : born) {
    if (const auto* children = childrenOf(slot)) {
      m_input.born.insert(m_input.born.end(), children->begin(), children->end());
    }
  }
}

void WorldReader::readChildren(std::uint32_t body, const std::vector<CompoundLeaf>& leaves,
                               std::vector<std::uint32_t>& children) {
  while (children.size() > leaves.size()) {
    releaseChild(children.back());
    children.pop_back();
  }
  while (children.size() < leaves.size()) {
    const std::uint32_t slot = m_index.take();
    growTo(m_index.slotCount());
    m_slots[slot] = BodySlot{};
    m_slots[slot].parent = body;
    children.push_back(slot);
  }
  constexpr uint kShared = BODY_PRESENT | BODY_STATIC | BODY_KINEMATIC | BODY_NO_RESPONSE | BODY_RIGID |
                           BODY_HOST_CONTACTS | BODY_QUARANTINED;
  m_input.childPoses.values.resize(m_input.bodyCount, identityPose());
  const BodyInfo parent = m_input.infos.values[body];
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    const std::uint32_t slot = children[i];
    BodyInfo info = parent;
    info.shapeIndex = leaves[i].shapeIndex;
    info.flags = (parent.flags & kShared) | BODY_CHILD;
    info.parent = body;
    info.child = leaves[i].child;
    info.depth = leaves[i].depth;
    const BodyInfo& known = m_input.infos.values[slot];
    if (!(known.flags & BODY_CHILD) || known.shapeIndex != info.shapeIndex) m_input.born.push_back(slot);
    update(m_input.infos, slot, info, m_input.infos.changed);
    update(m_input.childPoses, slot, leaves[i].pose, m_input.childPoses.changed);
  }
}

void WorldReader::growTo(std::uint32_t slotCount) {
  if (slotCount <= m_input.bodyCount) return;
  m_slots.resize(slotCount);
  m_seen.resize(slotCount);
  m_knownTransforms.resize(slotCount, btTransform::getIdentity());
  m_restingTransforms.resize(slotCount, btTransform::getIdentity());
  m_input.bodyCount = slotCount;
  m_input.infos.values.resize(slotCount);
  m_input.poses.values.resize(slotCount, identityPose());
  m_input.velocities.values.resize(slotCount);
  m_input.forces.values.resize(slotCount);
  m_input.masses.values.resize(slotCount);
  m_input.materials.values.resize(slotCount);
  m_input.dampings.values.resize(slotCount);
  m_input.activations.values.resize(slotCount);
  if (!m_input.childPoses.values.empty()) m_input.childPoses.values.resize(slotCount, identityPose());
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

WorldReader::Bounds WorldReader::boundsOfMoving() {
  m_bounds.assign(chunkCount(m_order.size(), kChunk), Bounds());
  parallelChunks(m_order.size(), kChunk, [this](std::size_t chunk, std::size_t first, std::size_t last) {
    Bounds& bounds = m_bounds[chunk];
    for (std::size_t k = first; k < last; ++k) {
      if (k + kAhead < m_objects.size()) prefetch(&m_objects[k + kAhead]->getWorldTransform().getOrigin(), kLine);
      const btVector3& p = m_objects[k]->getWorldTransform().getOrigin();
      if (!isIntegrated(m_order[k]) || !std::isfinite(double(p.x() + p.y() + p.z()))) continue;
      const double at[3] = {double(p.x()), double(p.y()), double(p.z())};
      bounds.add(at, at);
    }
  });
  Bounds all;
  for (const Bounds& bounds : m_bounds) all.add(bounds.lower, bounds.upper);
  return all;
}

void WorldReader::Bounds::add(const double (&from)[3], const double (&to)[3]) {
  for (int k = 0; k < 3; ++k) {
    lower[k] = std::min(lower[k], from[k]);
    upper[k] = std::max(upper[k], to[k]);
  }
}

double WorldReader::Bounds::farthestFrom(const double (&origin)[3]) const {
  double farthest = 0;
  for (int k = 0; k < 3; ++k) farthest = std::max({farthest, origin[k] - lower[k], upper[k] - origin[k]});
  return farthest;
}

static bool holds(const WorldInput& input, std::uint32_t i, const BodyRecord& record) {
  return same(input.infos, i, record.info) && same(input.velocities, i, record.velocity) &&
         same(input.forces, i, record.forces) && same(input.masses, i, record.mass) &&
         same(input.materials, i, record.material) && same(input.dampings, i, record.damping) &&
         same(input.activations, i, record.activation);
}

// True if the application has changed what a step leaves in a body at rest and the device knows nothing of.
bool WorldReader::isStirred(std::uint32_t i) const {
  const BodySlot& slot = m_slots[i];
  if (!slot.integrated) return false;
  const btCollisionObject& object = *slot.object;
  return object.getHitFraction() != btScalar(1) ||
         (!object.isStaticOrKinematicObject() &&
          !sameTransform(m_restingTransforms[i], object.getInterpolationWorldTransform()));
}

void WorldReader::readObject(std::uint32_t i, int shapeIndex, Changes& changes) {
  BodySlot& slot = m_slots[i];
  const btCollisionObject& object = *slot.object;
  const int shapeType = m_input.shapes.values[static_cast<std::size_t>(shapeIndex)].type;
  if (m_useContinuous && isIntegrated(i) && isSwept(object)) changes.swept.push_back(i);
  BodyRecord record = readBody(object, shapeIndex, isIntegrated(i));
  // As in stock its callback stands in for groups and masks, which are then all.
  if (m_ownFilter) record.info.filterGroup = record.info.filterMask = -1;
  if (const char* callback = m_globalCallback ? m_globalCallback : contactCallback(object)) {
    record.info.flags |= BODY_HOST_CONTACTS;
    changes.hostShares.addShare(callback, "contacts by Bullet's own algorithm on the CPU");
  }
  if (shapeType == SHAPE_COMPOUND) record.info.flags |= BODY_COMPOUND;
  const bool onHost = shapeType == SHAPE_HOST || (record.info.flags & BODY_HOST_CONTACTS);
  if (onHost != slot.onHost) changes.hostBodiesChanged = true;
  // The device has manifolds of its pairs, but made without knowing the shape, and without points.
  if (slot.onHost && !onHost) changes.born.push_back(i);
  slot.onHost = onHost;
  const bool moved = !slot.poseKnown || !sameTransform(m_knownTransforms[i], object.getWorldTransform());
  if (slot.resting && (moved || isStirred(i))) slot.resting = false;
  // As the device has it, and so it was finite.
  if (!moved && !slot.quarantined && !slot.deviceQuarantined && holds(m_input, i, record)) return;
  slot.resting = false;
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
    m_knownTransforms[i] = object.getWorldTransform();
    slot.poseKnown = true;
    update(m_input.poses, i, pose, changes.poses);
  }
}

// Of all chunks, if one of them has found other ignored pairs than before.
void WorldReader::mergeIgnored() {
  bool changed = !m_objectsKnown;
  for (Changes& changes : m_changes) changed |= std::exchange(changes.ignoredChanged, false);
  if (changed) {
    m_ignoredPairs.clear();
    for (const Changes& c : m_changes) {
      m_ignoredPairs.insert(m_ignoredPairs.end(), c.ignoredPairs.begin(), c.ignoredPairs.end());
    }
    std::sort(m_ignoredPairs.begin(), m_ignoredPairs.end());
    m_ignoredPairs.erase(std::unique(m_ignoredPairs.begin(), m_ignoredPairs.end()), m_ignoredPairs.end());
  }
  m_input.listedPairs = m_ignoredPairs;
}

// Whether the chunk's objects list the same objects to be ignored as in the last read.
bool WorldReader::ignoredAsBefore(const Changes& changes, std::size_t first, std::size_t last) const {
  auto next = changes.ignoredObjects.begin();
  const auto end = changes.ignoredObjects.end();
  for (std::size_t i = first; i < last; ++i) {
    btCollisionObject& object = *m_objects[i];
    const int count = object.getNumObjectsWithoutCollision();
    if (end - next <= count || next[count] != nullptr) return false;
    for (int k = 0; k < count; ++k, ++next) {
      if (*next != object.getObjectWithoutCollision(k)) return false;
    }
    ++next;
  }
  return next == end;
}

// Either of two objects may list the other (btCollisionDispatcher::needsCollision). The lists may hold objects that are
// gone: their addresses are only looked up.
void WorldReader::findIgnored(Changes& changes, std::size_t first, std::size_t last) const {
  changes.ignoredObjects.clear();
  changes.ignoredPairs.clear();
  for (std::size_t i = first; i < last; ++i) {
    btCollisionObject& object = *m_objects[i];
    for (int k = 0; k < object.getNumObjectsWithoutCollision(); ++k) {
      const std::uint32_t other = m_index.find(object.getObjectWithoutCollision(k));
      changes.ignoredObjects.push_back(object.getObjectWithoutCollision(k));
      if (other != kNoSlot && other != m_order[i]) changes.ignoredPairs.push_back(pairKeyOf(m_order[i], other));
    }
    changes.ignoredObjects.push_back(nullptr);
  }
}

void WorldReader::sortChanges() {
  WorldInput& in = m_input;
  for (auto* list : {&in.infos.changed, &in.poses.changed, &in.velocities.changed, &in.forces.changed,
                     &in.masses.changed, &in.materials.changed, &in.dampings.changed, &in.activations.changed,
                     &in.shapes.changed, &in.childPoses.changed, &in.born}) {
    // Nearly always they are: objects are mostly in the order of their slots.
    if (!std::is_sorted(list->begin(), list->end())) std::sort(list->begin(), list->end());
    list->erase(std::unique(list->begin(), list->end()), list->end());
  }
}

void WorldReader::acceptResults(const StepResults& results) {
  for (const std::uint32_t i : results.quarantined) {
    m_input.infos.values[i].flags |= BODY_QUARANTINED;
    m_slots[i].deviceQuarantined = !m_slots[i].quarantined;
  }
  m_input.clearChanges();
  m_hostBodiesChanged = false;
}

void WorldReader::clear() { *this = WorldReader(); }

BTGPU_TRANSLATION_END
