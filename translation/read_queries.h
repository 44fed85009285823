// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <map>
#include <utility>

#include "../gpu_engine/query_world.h"
#include "read_shapes.h"

class btMultiSphereShape;

struct btDbvtProxy;

BTGPU_TRANSLATION_BEGIN

// The leaf that the broadphase's rayTest looks at, for Bullet's own broadphases that have one; else null. Its AABB is
// known from the start, that of an axis sweep's proxy from its first update on.
using LeafOf = const btDbvtProxy* (*)(const btBroadphaseProxy& proxy);
LeafOf leafFinderOf(const btBroadphaseInterface& broadphase);

// Where the bounds of objects come from.
enum class QueryBounds {
  Broadphase,  // that a query of Bullet's own would ask
  Shapes,      // the broadphase's are not kept current, or it asks none: an object's own, as btCollisionWorld would
               // update them now
};

// What the world is read for: which shapes are the device's, and how it has them, differs.
enum class QueryKind { Rays, Sweeps, Pairs };

// Reads a Bullet world as it is now for batched queries, independently of the steps, so also in the middle of one.
class QueryReader {
 public:
  explicit QueryReader(QueryKind kind) : m_kind(kind) {}
  // `moving`: shapes that sweep through it.
  void read(const btDiscreteDynamicsWorld& world, QueryBounds bounds, const double (&origin)[3],
            const std::vector<const btConvexShape*>& moving = {});

  const QueryWorld& world() const { return m_world; }
  // In the array of the world that was read last; -1 if an object is not in it. The pointer is not followed.
  int positionOf(const btCollisionObject* object) const;
  // For QueryKind::Pairs. Shape of the object at a position in the array: index in world().shapes, or -1 if it is not
  // one that the device has closest points for.
  int shapeOf(int position) const { return m_shapeOf[static_cast<std::size_t>(position)]; }
  // Of a SHAPE_COMPOUND.
  const std::vector<CompoundLeaf>& leavesOf(int shapeIndex) const { return m_shapes.leaves(shapeIndex); }
  // Of one of the shapes that move, with what is around it; -1 if the device has no sweeps for it.
  int movingShape(const btConvexShape* shape) const;
  // Shapes that Bullet itself has to be asked for, by name; of the last read.
  const FallbackList& hostShares() const { return m_hostShares; }

 private:
  struct Found {
    const btCollisionObject* object;
    std::uint32_t position;  // in the world's array
    int shapeIndex;
    int child;  // -1: the object's own shape
    ItemForm form;
  };
  void findItems(const btCollisionObjectArray& objects, const std::vector<const btConvexShape*>& moving);
  bool addChildren(const btCollisionObject& object, std::uint32_t position);
  int readForPairs(const btCollisionShape& shape);
  bool isForPairs(int shapeIndex) const;
  // What rays meet of a shape; shapeIndex: -1 if that is Bullet's to say.
  struct Form {
    int shapeIndex = -1;
    ItemForm item{{1, 1, 1, 0}, NO_INDEX, 0, 0, 0};
  };
  const Form& formOf(const btCollisionShape& shape);
  Form readForm(const btCollisionShape& shape);
  Form readSolidForm(const btCollisionShape& shape);
  bool isCastAt(const btCollisionShape& inner, const Form& form) const;
  void addSpheres(const btMultiSphereShape& spheres, ItemForm& form);
  int readShape(const btCollisionShape& shape);
  void fill(const std::vector<Found>& found, bool onHost, const double (&origin)[3], QueryItems& items);
  Aabb boundsOf(const Found& found, const double (&origin)[3]) const;

  QueryKind m_kind;
  ShapeReader m_shapes;
  std::vector<Found> m_device, m_host;
  QueryItems m_newItems;
  std::vector<CompoundChild> m_newChildren;
  std::vector<float4> m_newSpheres;
  std::map<const btCollisionShape*, Form> m_forms;  // of this read
  const btCollisionShape* m_lastShape = nullptr;
  const Form* m_lastForm = nullptr;
  QueryBounds m_bounds = QueryBounds::Broadphase;
  // Of Bullet's own broadphases; else null: it goes by the proxy.
  LeafOf m_leafOf = nullptr;
  QueryWorld m_world;
  FallbackList m_hostShares;
  std::vector<int> m_shapeOf;
  std::vector<std::pair<const btCollisionObject*, int>> m_positions;  // sorted by address
};

BTGPU_TRANSLATION_END
