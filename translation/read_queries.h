// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <utility>

#include "../gpu_engine/query_world.h"
#include "read_shapes.h"

BTGPU_TRANSLATION_BEGIN

// Where the bounds of objects come from.
enum class QueryBounds {
  Broadphase,  // that a query of Bullet's own would ask
  Shapes,      // the broadphase's are not kept current, or it asks none: an object's own, as btCollisionWorld would
               // update them now
};

// Reads a Bullet world as it is now for batched queries, independently of the steps, so also in the middle of one.
class QueryReader {
 public:
  void read(const btDiscreteDynamicsWorld& world, QueryBounds bounds, const double (&origin)[3]);

  const QueryWorld& world() const { return m_world; }
  // In the array of the world that was read last; -1 if an object is not in it. The pointer is not followed.
  int positionOf(const btCollisionObject* object) const;
  // Shape of the object at a position in the array: index in world().shapes, or -1 if it is not one that the device has
  // closest points for.
  int shapeOf(int position) const { return m_shapeOf[static_cast<std::size_t>(position)]; }
  // Shapes that Bullet itself has to be asked for, by name; of the last read.
  const FallbackList& hostShares() const { return m_hostShares; }

 private:
  struct Found {
    const btCollisionObject* object;
    std::uint32_t position;  // in the world's array
    int shapeIndex;
    int child;  // -1: the object's own shape
  };
  void findItems(const btCollisionObjectArray& objects);
  bool addChildren(const btCollisionObject& object, std::uint32_t position);
  bool isConvexOrPlane(const btCollisionShape& from, int shapeIndex) const;
  bool isTested(const btCollisionShape& from, int shapeIndex) const;
  void fill(const std::vector<Found>& found, bool onHost, const double (&origin)[3], QueryItems& items);
  Aabb boundsOf(const Found& found, const double (&origin)[3]) const;

  ShapeReader m_shapes;
  std::vector<Found> m_device, m_host;
  QueryItems m_newItems;
  std::vector<CompoundChild> m_newChildren;
  QueryBounds m_bounds = QueryBounds::Broadphase;
  bool m_dbvt = false;  // the broadphase is Bullet's btDbvtBroadphase
  QueryWorld m_world;
  FallbackList m_hostShares;
  std::vector<int> m_shapeOf;
  std::vector<std::pair<const btCollisionObject*, int>> m_positions;  // sorted by address
};

BTGPU_TRANSLATION_END
