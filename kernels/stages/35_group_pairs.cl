// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/bounds.h"
#include "../lib/kernel.h"
#include "../shared/contact.h"

// Which algorithm finds the contacts of two shapes. Low is the lower SHAPE_* constant.
static uint bucketOfShapes(int typeA, int typeB) {
  const int low = min(typeA, typeB), high = max(typeA, typeB);
  if (low == SHAPE_NONE) return BUCKET_NONE;
  if (high >= SHAPE_CYLINDER && high <= SHAPE_SUM) {
    return low == SHAPE_PLANE ? BUCKET_CURVED_PLANE : BUCKET_CURVED;
  }
  if (low == SHAPE_SPHERE && high == SHAPE_SPHERE) return BUCKET_SPHERE_SPHERE;
  if (low == SHAPE_SPHERE && high == SHAPE_BOX) return BUCKET_SPHERE_BOX;
  if (low == SHAPE_SPHERE && high == SHAPE_PLANE) return BUCKET_SPHERE_PLANE;
  if (low == SHAPE_SPHERE && high == SHAPE_CAPSULE) return BUCKET_CAPSULES;
  if (low == SHAPE_SPHERE && high == SHAPE_HULL) return BUCKET_SPHERE_HULL;
  if (low == SHAPE_BOX && high == SHAPE_BOX) return BUCKET_BOX_BOX;
  if (low == SHAPE_BOX && high == SHAPE_PLANE) return BUCKET_BOX_PLANE;
  if (low == SHAPE_BOX && high == SHAPE_CAPSULE) return BUCKET_CAPSULE_BOX;
  if (low == SHAPE_BOX && high == SHAPE_HULL) return BUCKET_BOX_HULL;
  if (low == SHAPE_PLANE && high == SHAPE_CAPSULE) return BUCKET_CAPSULE_PLANE;
  if (low == SHAPE_PLANE && high == SHAPE_HULL) return BUCKET_HULL_PLANE;
  if (low == SHAPE_CAPSULE && high == SHAPE_CAPSULE) return BUCKET_CAPSULES;
  if (low == SHAPE_CAPSULE && high == SHAPE_HULL) return BUCKET_CAPSULE_HULL;
  if (low == SHAPE_HULL && high == SHAPE_HULL) return BUCKET_HULL_HULL;
  if (high == SHAPE_MESH && low <= SHAPE_SUM && low != SHAPE_PLANE) return BUCKET_MESH;
  return BUCKET_NONE;
}

// Bullet's algorithms for planes and for meshes make their manifold with these last.
static int isAlwaysB(int shapeType) { return shapeType == SHAPE_PLANE || shapeType == SHAPE_MESH; }

// Index of the first of the sorted keys that is not below `key`.
static uint lowerBound(__global const ulong* keys, uint count, ulong key) {
  uint first = 0, last = count;
  while (first < last) {
    const uint middle = first + (last - first) / 2;
    if (keys[middle] < key) {
      first = middle + 1;
    } else {
      last = middle;
    }
  }
  return first;
}

// Index of `key` in the sorted keys, or NO_INDEX. `place` (NO_INDEX at first) is carried from key to key: on a CPU, where
// they ascend, the search goes on from there.
static uint findKey(__global const ulong* keys, uint count, ulong key, REF(uint) place) {
#ifdef BTGPU_SHAPE_CPU
  uint at = *place != NO_INDEX ? *place : lowerBound(keys, count, key);
  while (at < count && keys[at] < key) ++at;
#else
  const uint at = lowerBound(keys, count, key);
#endif
  *place = at;
  return at < count && keys[at] == key ? at : NO_INDEX;
}

#ifdef BTGPU_SHAPE_CPU
#define LISTED __global uint* tables
#else
#define LISTED __global uint* items
#endif

// Turns each sorted key into a pair: manifold order, algorithm, and where its manifold of the last step is.
// The keys of the last step belong to manifolds[] of the last step, index by index; a manifold is taken over
// only if its two bodies are still the ones that it was made for (bodyBirth). Pairs that must not collide get no
// algorithm; contacts that they had before stay as they are, as in Bullet. These are the listed ones; with LISTED_ONLY in
// listedCount those listed with PAIR_KEEPS_CONTACTS. Then what is not listed at all is no pair of Bullet's, and forgets
// its contacts.
// On a GPU the pairs are then sorted by their buckets. On a CPU each work item counts those of its share, bucket by bucket,
// in tables[], and listPairs goes on from there.
KERNEL describePairs(CHECKS uint pairCapacity, __global const StepCounters* counters, uint oldCapacity,
                     __global const uint* oldCount, __global const ulong* keys, __global const ulong* oldKeys,
                     __global const BodyInfo* infos, __global const Shape* shapes,
                     __global const BodyActivation* activations, __global const uint* bodyBorn, uint listedCount,
                     __global const ulong* listed, __global Pair* pairs, __global uint* buckets, LISTED) {
  RETURN_ON_OVERFLOW(counters);
#ifdef BTGPU_SHAPE_CPU
  __global uint* table = tables + get_global_id(0) * BUCKET_COUNT;
  for (uint b = 0; b < BUCKET_COUNT; ++b) table[b] = 0;
#endif
  const uint pairCount = itemCount(pairCapacity, &counters->pairCount);
  const uint pairsListed = listedCount & ~LISTED_ONLY;
  const int onlyListed = (listedCount & LISTED_ONLY) != 0;
  uint oldPlace = NO_INDEX, listedPlace = NO_INDEX;
  FOR_EACH(i, pairCount) {
    const uint low = (uint)(keys[i] >> 32), high = (uint)keys[i];
    ASSERT(low < high, low, high);
    const BodyInfo lowInfo = AT(infos, low), highInfo = AT(infos, high);
    const int lowType = AT(shapes, lowInfo.shapeIndex).type, highType = AT(shapes, highInfo.shapeIndex).type;
    const uint children = (lowInfo.flags | highInfo.flags) & BODY_CHILD;
    int lowIsA = lowInfo.uniqueId < highInfo.uniqueId;
    // Bullet opens two compounds together, and a compound that is left alone becomes the first of the two.
    if (lowInfo.depth != highInfo.depth) lowIsA = lowInfo.depth > highInfo.depth;
    if (isAlwaysB(lowType) != isAlwaysB(highType)) lowIsA = isAlwaysB(highType);
    Pair pair;
    pair.bodyA = lowIsA ? low : high;
    pair.bodyB = lowIsA ? high : low;
    pair.bucket = bucketOfShapes(lowType, highType);
    pair.oldManifold = NO_INDEX;
    if (!AT(bodyBorn, low) && !AT(bodyBorn, high)) {
      pair.oldManifold = findKey(oldKeys, itemCount(oldCapacity, oldCount), keys[i], &oldPlace);
    }
    if (!isActiveState(AT(activations, low).state) && !isActiveState(AT(activations, high).state))
      pair.bucket = BUCKET_CARRY;
    if (lowType == SHAPE_HOST || highType == SHAPE_HOST || ((lowInfo.flags | highInfo.flags) & BODY_HOST_CONTACTS)) {
      pair.bucket = BUCKET_HOST;
      pair.oldManifold = NO_INDEX;
    }
    ulong bodies = keys[i];
    if (children) {  // whose bodies are in no order
      bodies = pairKeyOf(ownerOf(lowInfo, low), ownerOf(highInfo, high));
      listedPlace = NO_INDEX;
    }
    const int isListed = pairsListed && findKey(listed, pairsListed, bodies, &listedPlace) != NO_INDEX;
    if (onlyListed && !isListed && pair.oldManifold != NO_INDEX) {
      uint place = NO_INDEX;
      const int keeps = pairsListed && findKey(listed, pairsListed, bodies | PAIR_KEEPS_CONTACTS, &place) != NO_INDEX;
      if (!keeps) pair.oldManifold = NO_INDEX;
    }
    if (isListed != onlyListed) {
      pair.bucket = pair.oldManifold != NO_INDEX ? BUCKET_CARRY : BUCKET_NONE;
    }
    if (children) listedPlace = NO_INDEX;
    AT(pairs, i) = pair;
    AT(buckets, i) = pair.bucket;
#ifdef BTGPU_SHAPE_CPU
    table[pair.bucket] += 1;
#else
    AT(items, i) = i;
#endif
  }
}

#ifdef BTGPU_SHAPE_CPU
// The pairs bucket by bucket, ascending within, and where each bucket begins. On the grid of describePairs, and so with
// the same shares.
KERNEL listPairs(CHECKS uint pairCapacity, __global const StepCounters* counters, __global const uint* buckets,
                 __global const uint* tables, __global uint* items, __global uint* bucketFirst) {
  RETURN_ON_OVERFLOW(counters);
  uint next[BUCKET_COUNT], first = 0;  // where this share's pairs of each bucket go
  for (uint b = 0; b < BUCKET_COUNT; ++b) {
    if (get_global_id(0) == 0) bucketFirst[b] = first;
    for (uint g = 0; g < get_global_size(0); ++g) {
      if (g == get_global_id(0)) next[b] = first;
      first += tables[g * BUCKET_COUNT + b];
    }
  }
  if (get_global_id(0) == 0) bucketFirst[BUCKET_COUNT] = first;
  FOR_EACH(i, itemCount(pairCapacity, &counters->pairCount)) {
    const uint bucket = AT(buckets, i);
    ASSERT(bucket < BUCKET_COUNT, bucket, i);
    AT(items, next[bucket]) = i;
    next[bucket] += 1;
  }
}
#endif
