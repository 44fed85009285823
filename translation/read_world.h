// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <unordered_map>
#include <vector>

#include "../gpu_engine/step_results.h"
#include "../gpu_engine/world_input.h"
#include "bullet.h"
#include "fallback_list.h"
#include "index_map.h"
#include "read_shapes.h"

BTGPU_TRANSLATION_BEGIN

// What translation remembers of one object between steps. Pointers are followed only while the object is
// known to be in the world, that is within read() and until the application's next callback.
struct BodySlot {
  btCollisionObject* object = nullptr;  // null: the slot is free
  bool integrated = false;              // it is in the list of non-static rigid bodies
  bool poseKnown = false;               // WorldReader::knownTransform() holds what the device has
  bool quarantined = false;             // NaN or infinity came from the application
  bool deviceQuarantined = false;       // ... or arose on the device
  bool onHost = false;                  // the contacts of all its pairs come from Bullet's own algorithms
  // A step that does not change it has nothing to write: an earlier one has left in it all that steps leave in a body
  // that stays where it is (restingTransform() among it), and nobody has touched it since.
  bool resting = false;
  std::uint32_t parent = kNoSlot;  // of a slot that holds one of a compound's shapes, and no object: the body's
};

// Reads a Bullet world into a WorldInput: finds what came, went and changed by comparing with what the device
// knows. The input's arrays always mirror the device's state.
class WorldReader {
 public:
  // Brings `input()` up to date. What the device can't do yet goes into `missing`; the input may then be
  // incomplete, but the next read puts it right. Bodies put into quarantine go into `notes`. May be called again before
  // the step: what the application changed in between is found as well.
  void read(btDiscreteDynamicsWorld& world, FallbackList& missing, FallbackList& notes);

  WorldInput& input() { return m_input; }
  const WorldInput& input() const { return m_input; }
  const std::vector<BodySlot>& slots() const { return m_slots; }
  std::vector<BodySlot>& slots() { return m_slots; }
  // The slot of the body that a slot belongs to: its own, but for the shapes of compounds.
  std::uint32_t ownerOf(std::uint32_t slot) const {
    return m_slots[slot].parent == kNoSlot ? slot : m_slots[slot].parent;
  }
  bool isChild(std::uint32_t slot) const { return m_slots[slot].parent != kNoSlot; }
  btCollisionObject* objectOf(std::uint32_t slot) const { return m_slots[ownerOf(slot)].object; }
  // The slots of the shapes of a body's compound, in the order of its leaves; null for another shape.
  const std::vector<std::uint32_t>* childrenOf(std::uint32_t slot) const {
    const auto it = m_children.find(slot);
    return it == m_children.end() ? nullptr : &it->second;
  }
  bool isIntegrated(std::uint32_t slot) const { return m_slots[slot].integrated; }
  // By slot: the world transform of an object as it was last read or written, and the interpolation transform of a
  // dynamic one that rests.
  btTransform& knownTransform(std::uint32_t slot) { return m_knownTransforms[slot]; }
  btTransform& restingTransform(std::uint32_t slot) { return m_restingTransforms[slot]; }
  // Slot of an object that was in the world at the last read, or kNoSlot.
  std::uint32_t findSlot(const btCollisionObject* object) const { return m_index.find(object); }

  // The same for an object whose place in the world's array is current; faster.
  std::uint32_t slotOf(const btCollisionObject& object) const {
    const auto position = static_cast<std::size_t>(object.getWorldArrayIndex());
    if (position >= m_order.size() || m_slots[m_order[position]].object != &object) return findSlot(&object);
    return m_order[position];
  }

  // Whether the world's lists are those of the last read, and no object has left and come back since.
  bool isListed(const btCollisionObjectArray& objects, const btAlignedObjectArray<btRigidBody*>& bodies) const;
  // ShapeReader's of the same names.
  void rememberShapes() { m_shapes.remember(m_input); }
  bool hasChangedShapes() const { return m_shapes.hasChanged(m_input); }

  // What of the last read has to be collided on the host, by name; empty if the device can do everything.
  const FallbackList& hostShares() const { return m_hostShares; }
  // Slots of the bodies that Bullet would sweep in this step if they are fast (setCcdMotionThreshold), asleep or not,
  // in the world's order.
  const std::vector<std::uint32_t>& sweptBodies() const { return m_sweptBodies; }
  // True if since the last step some body that the device used to collide went to the host, or back.
  bool hostBodiesChanged() const { return m_hostBodiesChanged; }

  // To be told of every object that is added to the world: one that left and came back between two reads is a
  // new body.
  void noteAdded(const btCollisionObject* object);

  // After a step whose bodies have been written back (writeBackBodies).
  void acceptResults(const StepResults& results);

  // Forgets everything: the next read reports all bodies as new.
  void clear();

 private:
  void findObjects(const btCollisionObjectArray& objects);
  void removeUnseen();
  void release(std::uint32_t slot);
  void becomeNew(std::uint32_t slot, std::vector<std::uint32_t>& born);
  void growTo(std::uint32_t slotCount);
  struct Bounds {
    double lower[3] = {1e300, 1e300, 1e300}, upper[3] = {-1e300, -1e300, -1e300};
    bool empty() const { return lower[0] > upper[0]; }
    void add(const double (&from)[3], const double (&to)[3]);
    double farthestFrom(const double (&origin)[3]) const;  // along an axis
  };
  void chooseRegion(FallbackList& missing);
  Bounds boundsOfMoving();  // positions of the bodies that move
  // What one thread found out about some objects.
  struct Changes {
    std::vector<std::uint32_t> infos, poses, velocities, forces, masses, materials, dampings, activations, born, swept;
    // Objects that the chunk's objects ignore, each list followed by a null, and the pairs with those that are in the
    // world: kept from read to read.
    std::vector<const btCollisionObject*> ignoredObjects;
    std::vector<ulong> ignoredPairs;
    bool ignoredChanged = false;
    FallbackList missing, notes, hostShares;
    bool hostBodiesChanged = false;
    bool reshaped = false;  // an object has another shape than it had in the last read
  };
  void markIntegrated(const btAlignedObjectArray<btRigidBody*>& bodies);
  void readShapes(FallbackList& missing);
  void readObjects();
  bool readKnownObjects(FallbackList& missing);
  template <typename Work>
  void forEachObject(const Work& work);
  bool isStirred(std::uint32_t slot) const;
  void readObject(std::uint32_t slot, int shapeIndex, Changes& changes);
  void readCompounds();
  void readChildren(std::uint32_t body, const std::vector<CompoundLeaf>& leaves, std::vector<std::uint32_t>& children);
  void releaseChild(std::uint32_t slot);
  void take(Changes& changes, FallbackList& missing, FallbackList& notes);
  void sortChanges();
  void mergeIgnored();
  void findIgnored(Changes& changes, std::size_t first, std::size_t last) const;
  bool ignoredAsBefore(const Changes& changes, std::size_t first, std::size_t last) const;

  IndexMap m_index;
  std::vector<BodySlot> m_slots;
  std::vector<btTransform> m_knownTransforms, m_restingTransforms;  // by slot
  std::vector<btCollisionObject*> m_objects;                        // the world's array as it was read last
  std::vector<btRigidBody*> m_bodies;                               // likewise its list of non-static rigid bodies
  std::vector<std::uint32_t> m_order;                               // slot of each object, in the world's order
  std::vector<std::uint32_t> m_seen;        // by slot: read in which its object was last looked for and found
  std::vector<std::uint32_t> m_addedAgain;  // slots of objects that were added while they had one
  std::vector<std::uint32_t> m_newObjects;  // positions in the world of objects without a slot yet
  std::vector<const btCollisionShape*> m_orderShapes;  // of each object in m_order; null: it can't be used
  std::vector<int> m_orderShapeIndices;                // likewise; -1
  bool m_shapesKnown = false;                          // these two are those of the last read
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> m_children;  // by slot of a body with a compound
  std::vector<ulong> m_ignoredPairs;                                         // of all chunks, sorted
  std::vector<Changes> m_changes;                                            // by chunk
  std::vector<Bounds> m_bounds;                                              // likewise
  ShapeReader m_shapes;
  WorldInput m_input;
  std::uint32_t m_step = 0;
  bool m_regionChosen = false;
  FallbackList m_hostShares;
  std::vector<std::uint32_t> m_sweptBodies;
  bool m_objectsKnown = false;   // of the read: the world's objects are those of the last one
  bool m_useContinuous = false;  // of the read: btDispatcherInfo's
  bool m_ownFilter = false;      // likewise: the application filters pairs itself
  const char* m_globalCallback = nullptr;
  bool m_hostBodiesChanged = false;
};

BTGPU_TRANSLATION_END
