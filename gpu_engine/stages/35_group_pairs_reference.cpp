// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "35_group_pairs_reference.h"

#include <algorithm>

namespace btgpu {
namespace {

bool isActive(int state) {  // btCollisionObject::isActive
  return state != STATE_SLEEPING && state != STATE_DISABLE_SIMULATION && state != STATE_FIXED_BASE;
}

uint bucketOf(int typeA, int typeB) {
  struct Row {
    int a, b;
    uint bucket;
  };
  static const Row kTable[] = {{SHAPE_SPHERE, SHAPE_SPHERE, BUCKET_SPHERE_SPHERE},
                               {SHAPE_SPHERE, SHAPE_PLANE, BUCKET_SPHERE_PLANE},
                               {SHAPE_BOX, SHAPE_PLANE, BUCKET_BOX_PLANE},
                               {SHAPE_SPHERE, SHAPE_BOX, BUCKET_SPHERE_BOX},
                               {SHAPE_BOX, SHAPE_BOX, BUCKET_BOX_BOX},
                               {SHAPE_SPHERE, SHAPE_CAPSULE, BUCKET_CAPSULES},
                               {SHAPE_CAPSULE, SHAPE_CAPSULE, BUCKET_CAPSULES},
                               {SHAPE_CAPSULE, SHAPE_PLANE, BUCKET_CAPSULE_PLANE},
                               {SHAPE_HULL, SHAPE_PLANE, BUCKET_HULL_PLANE},
                               {SHAPE_CAPSULE, SHAPE_BOX, BUCKET_CAPSULE_BOX},
                               {SHAPE_SPHERE, SHAPE_HULL, BUCKET_SPHERE_HULL},
                               {SHAPE_CAPSULE, SHAPE_HULL, BUCKET_CAPSULE_HULL},
                               {SHAPE_BOX, SHAPE_HULL, BUCKET_BOX_HULL},
                               {SHAPE_HULL, SHAPE_HULL, BUCKET_HULL_HULL},
                               {SHAPE_SPHERE, SHAPE_MESH, BUCKET_MESH},
                               {SHAPE_BOX, SHAPE_MESH, BUCKET_MESH},
                               {SHAPE_CAPSULE, SHAPE_MESH, BUCKET_MESH},
                               {SHAPE_HULL, SHAPE_MESH, BUCKET_MESH}};
  for (const int curved : {SHAPE_CYLINDER, SHAPE_CONE, SHAPE_MULTI_SPHERE, SHAPE_SUM}) {
    if (typeA != curved && typeB != curved) continue;
    const int other = typeA == curved ? typeB : typeA;
    if (other == SHAPE_MESH) return BUCKET_MESH;
    if (other == SHAPE_NONE || other > SHAPE_SUM) return BUCKET_NONE;
    return other == SHAPE_PLANE ? BUCKET_CURVED_PLANE : BUCKET_CURVED;
  }
  for (const Row& r : kTable) {
    if ((r.a == typeA && r.b == typeB) || (r.a == typeB && r.b == typeA)) return r.bucket;
  }
  return BUCKET_NONE;
}

}  // namespace

GroupedPairs groupPairsReference(const std::vector<ulong>& keys, const std::vector<ulong>& oldKeys,
                                 const std::vector<BodyInfo>& infos, const std::vector<Shape>& shapes,
                                 const std::vector<BodyActivation>& activations, const std::vector<uint>& born,
                                 const std::vector<ulong>& listed, bool onlyListed) {
  const auto typeOf = [&](uint body) { return shapes[static_cast<size_t>(infos[body].shapeIndex)].type; };
  GroupedPairs out;
  for (const ulong key : keys) {
    const uint first = static_cast<uint>(key >> 32), second = static_cast<uint>(key);
    uint a = first, b = second;
    const auto old = std::find(oldKeys.begin(), oldKeys.end(), key);
    const bool known = old != oldKeys.end() && !born[a] && !born[b];
    const bool carried = !isActive(activations[a].state) && !isActive(activations[b].state);
    // btBroadphasePair orders by proxy id; btConvexPlaneCollisionAlgorithm makes its manifold with the plane
    // last, btConvexConcaveCollisionAlgorithm with the mesh; btCompoundCollisionAlgorithm makes the compound the first,
    // btCompoundCompoundCollisionAlgorithm opens both.
    const bool childA = infos[a].flags & BODY_CHILD, childB = infos[b].flags & BODY_CHILD;
    const int depthA = infos[a].depth, depthB = infos[b].depth;
    if (depthA == depthB ? infos[b].uniqueId < infos[a].uniqueId : depthB > depthA) std::swap(a, b);
    const auto isLast = [&](uint body) { return typeOf(body) == SHAPE_PLANE || typeOf(body) == SHAPE_MESH; };
    if (isLast(a) && !isLast(b)) std::swap(a, b);
    const auto onHost = [&](uint body) {
      return typeOf(body) == SHAPE_HOST || (infos[body].flags & BODY_HOST_CONTACTS);
    };
    const ulong bodies = pairKeyOf(childA ? infos[first].parent : first, childB ? infos[second].parent : second);
    const bool isListed = std::find(listed.begin(), listed.end(), bodies) != listed.end();
    const bool mayCollide = isListed == onlyListed;
    if (!mayCollide) {
      // btCollisionDispatcher::defaultNearCallback leaves such a pair as it is, its manifold too.
      // A pair that is not in its pair cache has none.
      const ulong kept = bodies | PAIR_KEEPS_CONTACTS;
      const bool inCache = !onlyListed || std::find(listed.begin(), listed.end(), kept) != listed.end();
      const bool keeps = inCache && known && !onHost(a) && !onHost(b);
      const uint bucket = keeps ? BUCKET_CARRY : BUCKET_NONE;
      out.pairs.push_back({a, b, keeps ? static_cast<uint>(old - oldKeys.begin()) : NO_INDEX, bucket});
      continue;
    }
    if (onHost(a) || onHost(b)) {
      out.pairs.push_back({a, b, NO_INDEX, BUCKET_HOST});
      continue;
    }
    out.pairs.push_back({a, b, known ? static_cast<uint>(old - oldKeys.begin()) : NO_INDEX,
                         carried ? BUCKET_CARRY : bucketOf(typeOf(a), typeOf(b))});
  }
  for (uint bucket = 0; bucket <= BUCKET_COUNT; ++bucket) {
    out.bucketFirst.push_back(static_cast<uint>(out.items.size()));
    for (uint i = 0; i < out.pairs.size(); ++i) {
      if (out.pairs[i].bucket == bucket) out.items.push_back(i);
    }
  }
  return out;
}

}  // namespace btgpu
