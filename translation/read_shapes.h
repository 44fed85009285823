// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <map>
#include <unordered_map>
#include <vector>

#include "../gpu_engine/world_input.h"
#include "bullet.h"
#include "convex_core.h"
#include "fallback_list.h"
#include "hull_features.h"
#include "read_meshes.h"

BTGPU_TRANSLATION_BEGIN

// One shape of a compound, of nested ones too: which it is, and where in the outermost one's axes.
struct CompoundLeaf {
  int shapeIndex;
  int depth;  // of how many compounds around it
  int child;  // its number in the compound that it is in, as contact points have it (btManifoldPoint::m_index0)
  BodyPose pose;
};

// The shapes in use, each once, read anew every step, since applications change them after they were added.
class ShapeReader {
 public:
  // `threshold` is gContactBreakingThreshold; `relative` the dispatcher's flag for thresholds in proportion to the
  // shape.
  void configure(btScalar threshold, bool relative);
  // Types of Bullet's (bit XX_SHAPE_PROXYTYPE) for which the application has algorithms of its own: on the host.
  void setOwnAlgorithms(std::uint64_t types) { m_ownAlgorithms = types; }
  // Starts anew: no shape is in use.
  void begin();
  // Index of the shape, read into the input's shapes if this is its first use in the step. One that the device lacks is
  // a SHAPE_HOST, and named in `shares`; -1 and a line in `missing` for one that can't be used at all.
  int read(const btCollisionShape* shape, WorldInput& input, FallbackList& missing, FallbackList& shares);
  // Instead of begin() and read(), where the same shapes are in use as after the last read(): reads these. False if one
  // of them is of another type now, or can no longer be used, or can be used again; what is left to do then is a
  // begin().
  bool readKnown(WorldInput& input, FallbackList& missing, FallbackList& shares);
  // For a world that sleeps: whether a shape in use is another one than when remember() was called, as far as stock's
  // next step would show it. Of compounds, meshes and shapes of the host that is their AABB.
  void remember(const WorldInput& input);
  bool hasChanged(const WorldInput& input) const;
  // Ends a step: indices of shapes that went out of use are given to new ones, now and then, and so is the room of
  // hulls that went or changed.
  void end(WorldInput& input);
  void clear();

  // Of a SHAPE_COMPOUND.
  const std::vector<CompoundLeaf>& leaves(int shapeIndex) const {
    return m_compounds.at(static_cast<std::uint32_t>(shapeIndex));
  }
  bool hasCompounds() const { return !m_compounds.empty(); }

 private:
  struct Entry {
    std::uint32_t index;
    std::uint32_t stamp;  // step in which it was read last
    bool supported;
  };
  // Points as they were read, and where what was made of them lies in the input.
  struct Hull {
    CorePoints core;
    HullFeatures features;
    Shape place;  // the index fields of Shape
  };

  // In use, with its entry, which stays where it is.
  struct Used {
    const btCollisionShape* shape;
    Entry* entry;
    bool unchanged;
    btVector3 lower, upper;  // of remember(), where that is what is known
  };

  void readEntry(const btCollisionShape* shape, Entry& entry, WorldInput& input, FallbackList& missing,
                 FallbackList& shares);
  float breakingThreshold(const btCollisionShape& shape) const;
  bool isUnchanged(const btCollisionShape& shape, const Entry& entry, const WorldInput& input) const;
  // False if the device has no such shape, for a reason in `why` if it is not its kind; one that is not finite comes
  // out as such.
  bool convert(const btCollisionShape& shape, std::uint32_t index, WorldInput& input, FallbackList& missing,
               FallbackList& shares, Shape& out, const char*& why);
  void convertPoints(const btCollisionShape& shape, std::uint32_t index, HullArrays& hulls, Shape& out);
  void dropHull(std::uint32_t index);
  bool convertCompound(const btCompoundShape& compound, std::uint32_t index, WorldInput& input, FallbackList& missing,
                       FallbackList& shares, Shape& out);
  bool addLeaves(const btCompoundShape& compound, const btTransform& pose, int depth, WorldInput& input,
                 FallbackList& missing, FallbackList& shares, std::vector<CompoundLeaf>& leaves);

  std::unordered_map<const btCollisionShape*, Entry> m_entries;
  std::map<std::uint32_t, Hull> m_hulls;                           // by shape index; also spheres
  std::map<std::uint32_t, std::vector<CompoundLeaf>> m_compounds;  // likewise
  CorePoints m_core;                                               // of the shape that is read
  std::uint64_t m_ownAlgorithms = 0;
  MeshReader m_meshes;
  std::size_t m_deadVertices = 0;                 // in the input's array, of hulls that went or changed
  const btCollisionShape* m_lastShape = nullptr;  // neighbours in the world often share a shape
  Entry m_lastEntry{};
  std::uint32_t m_stamp = 0;
  std::vector<Used> m_used;           // in the order of their first use
  std::vector<std::uint32_t> m_free;  // indices of shapes that went out of use
  btScalar m_threshold = btScalar(0.02);
  bool m_relative = true;
};

BTGPU_TRANSLATION_END
