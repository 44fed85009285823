// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <map>
#include <unordered_map>
#include <vector>

#include "../gpu_engine/world_input.h"
#include "bullet.h"
#include "fallback_list.h"
#include "hull_features.h"
#include "read_meshes.h"

BTGPU_TRANSLATION_BEGIN

// The shapes in use, each once, read anew every step, since applications change them after they were added.
class ShapeReader {
 public:
  // `threshold` is gContactBreakingThreshold; `relative` the dispatcher's flag for thresholds in proportion to the
  // shape.
  void configure(btScalar threshold, bool relative);
  // Starts anew: no shape is in use.
  void begin();
  // Index of the shape, read into the input's shapes if this is its first use in the step. One that the device lacks is
  // a SHAPE_HOST, and named in `shares`; -1 and a line in `missing` for one that can't be used at all.
  int read(const btCollisionShape* shape, WorldInput& input, FallbackList& missing, FallbackList& shares);
  // Instead of begin() and read(), where the same shapes are in use as after the last read(): reads these. False if one
  // of them is of another type now, or can no longer be used, or can be used again; what is left to do then is a
  // begin().
  bool readKnown(WorldInput& input, FallbackList& missing, FallbackList& shares);
  // Ends a step: indices of shapes that went out of use are given to new ones, now and then, and so is the room of
  // hulls that went or changed.
  void end(WorldInput& input);
  void clear();

 private:
  struct Entry {
    std::uint32_t index;
    std::uint32_t stamp;  // step in which it was read last
    bool supported;
  };
  // A hull as it was read, and where its features lie in the input.
  struct Hull {
    std::vector<btVector3> points;  // unscaled
    btVector3 scaling;
    HullFeatures features;
    Shape place;  // the index fields of Shape
  };

  // In use, with its entry, which stays where it is.
  struct Used {
    const btCollisionShape* shape;
    Entry* entry;
    bool unchanged;
  };

  void readEntry(const btCollisionShape* shape, Entry& entry, WorldInput& input, FallbackList& missing,
                 FallbackList& shares);
  float breakingThreshold(const btCollisionShape& shape) const;
  bool isUnchanged(const btCollisionShape& shape, const Entry& entry, const WorldInput& input) const;
  // False if the device has no such shape, for a reason in `why` if it is not its kind; one that is not finite comes out
  // as such.
  bool convert(const btCollisionShape& shape, std::uint32_t index, WorldInput& input, Shape& out, const char*& why);
  bool convertHull(const btConvexHullShape& hull, std::uint32_t index, HullArrays& hulls, Shape& out);
  void dropHull(std::uint32_t index);

  std::unordered_map<const btCollisionShape*, Entry> m_entries;
  std::map<std::uint32_t, Hull> m_hulls;          // by shape index
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
