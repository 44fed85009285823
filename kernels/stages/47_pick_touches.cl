// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "../lib/contact_threshold.h"
#include "../lib/kernel.h"
#include "../lib/pick_touches.h"
#include "../lib/collide.h"
#include "../shared/body.h"

// The candidates of each pair with a mesh, out of its contacts with the single triangles: hits[] from
// hitFirst[k * groups] on are those of the pair at position k in BUCKET_MESH. The deepest comes last, so that no other
// candidate can push it out of a full manifold.
KERNEL pickTouches(CHECKS __global const StepCounters* counters, uint groups, __global const uint* bucketFirst,
                   __global const uint* items, __global const Pair* pairs, __global const BodyInfo* infos,
                   __global const Shape* shapes, __global const Manifold* oldManifolds, __global const Mesh* meshes,
                   __global const uint* found, __global const uint* hitFirst, __global const TriangleHit* hits,
                   __global const TriangleContacts* touches, __global RawContacts* contacts) {
  RETURN_ON_OVERFLOW(counters);
  const uint first = bucketFirst[BUCKET_MESH];
  FOR_EACH(k, bucketFirst[BUCKET_MESH + 1] - first) {
    const uint i = AT(items, first + k);
    const Pair pair = AT(pairs, i);
    const Shape b = AT(shapes, AT(infos, pair.bodyB).shapeIndex);
    const float threshold = contactThreshold(WITH_CHECKS pair, infos, shapes, oldManifolds);
    uint from = AT(hitFirst, k * groups), to = AT(hitFirst, (k + 1) * groups - 1) + AT(found, (k + 1) * groups - 1);
    // Most triangles are near and not touched.
    while (from < to && AT(touches, from).normal.w == 0.0f) ++from;
    while (to > from && AT(touches, to - 1).normal.w == 0.0f) --to;
    const int firstTriangle = AT(meshes, b.firstVertex).firstTriangle;
    TouchPicker picker = makeTouchPicker(threshold);
    do {
      for (uint h = from; h < to; ++h) {
        const float4 normal = AT(touches, h).normal;
        const int count = (int)normal.w;
        for (int n = 0; n < count; ++n) {
          offerTouch(&picker, AT(touches, h).points[n],
                     withW(normal, (float)((int)AT(hits, h).triangle - firstTriangle + 1)));
        }
      }
    } while (nextTouchPass(&picker));
    RawContacts raw = noContacts();
    UNROLL
    for (int n = MANIFOLD_POINTS - 1; n >= 0; --n) {
      if (n >= picker.count) continue;
      raw.points[picker.count - 1 - n] = picker.points[n];
      raw.points[MANIFOLD_POINTS + picker.count - 1 - n] = picker.normals[n];
    }
    raw.count = picker.count;
    if (raw.count > 0) raw.normal = xyz(picker.normals[0]);
    AT(contacts, i) = raw;
  }
}
