// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "bullet.h"
#include "mesh_tree.h"

class btHeightfieldTerrainShape;

BTGPU_TRANSLATION_BEGIN

// Memory of the application's that a shape was made from.
struct WatchedBytes {
  const unsigned char* first;
  std::size_t count;
};

// Tells whether such memory has changed, by hashes of its blocks. Up to kAtOnce bytes are looked at in each call; of
// more, a part, the next one in the next call: a change is then noticed a few calls later.
class MemoryWatch {
 public:
  static constexpr std::size_t kBlock = std::size_t{1} << 16, kAtOnce = std::size_t{4} << 20;
  // True if it is not what it was in the last calls, or is somewhere else.
  bool changed(const std::vector<WatchedBytes>& memory);

 private:
  std::vector<WatchedBytes> m_memory;
  std::vector<WatchedBytes> m_blocks;
  std::vector<std::uint64_t> m_hashes;  // by block
  std::size_t m_next = 0;
};

// The triangle meshes and height fields in use, each once: Bullet's shapes of triangles as the device has them. They
// are read again when their scaling, their settings or the memory that they lie in changes.
class MeshReader {
 public:
  // False if the shape is none of triangles, or too large for the device; `why` says so.
  bool convert(const btCollisionShape& shape, std::uint32_t index, MeshArrays& meshes, Shape& out, const char*& why);
  void drop(std::uint32_t index);
  // Gives the room of meshes that went or changed to others, now and then. The shapes of all meshes have to be written
  // anew if it did: place() has where they are.
  bool reclaim(MeshArrays& meshes);
  template <typename F>
  void forEachPlace(const F& f) const {
    for (const auto& [index, entry] : m_entries) f(index, entry.place);
  }
  void clear();

 private:
  // Of what makes the triangles of a shape, all but the memory.
  struct Settings {
    const void* from = nullptr;  // mesh interface, or heights
    btVector3 scaling = btVector3(0, 0, 0), inner = btVector3(0, 0, 0);
    int numbers[8] = {};
    bool operator==(const Settings& o) const;
  };
  struct Entry {
    Settings settings;
    MemoryWatch watch;
    MeshTree tree;
    int place = 0;  // in MeshArrays::meshes
  };
  struct Source;

  static bool open(const btCollisionShape& shape, Source& source);
  static std::vector<MeshTriangle> trianglesOf(const Source& source);

  std::map<std::uint32_t, Entry> m_entries;  // by shape index
  std::size_t m_dead = 0;                    // triangles in the input's array of meshes that went or changed
};

// How the triangles that a ray meets in a height field (performRaycast) differ from those that bodies collide with.
struct HeightFieldRays {
  bool sameTriangles;  // but for this: as part and index each has its cell, and
  bool otherWinding;   // their corners may run the other way round
};
HeightFieldRays raysThrough(const btHeightfieldTerrainShape& heights);

BTGPU_TRANSLATION_END
