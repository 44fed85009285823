// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of stage 47: closest points of a shape's core and of each triangle, every feature against every
// feature in double; of these the candidates of a pair. The kernel has up to four points a triangle, where faces lie on
// each other: the deepest one and the normal agree with the reference's within 1.2e-5 of the sizes at hand, the others
// lie on the triangle, within the threshold. Candidates are points of the triangles with their normals, the deepest
// last, none nearer to another than the threshold; where one more would be left there are four.
#pragma once

#include "40_cull_triangles_reference.h"

namespace btgpu {

// By hit.
std::vector<TriangleContacts> collideTrianglesReference(const TriangleInput& in, const TriangleHits& hits);
void checkTriangleContacts(Contract& contract, const TriangleInput& in, const TriangleHits& hits,
                           const std::vector<TriangleContacts>& device);

// Overwrites the contacts of the pairs in BUCKET_MESH.
void pickTouchesReference(const TriangleInput& in, const TriangleHits& hits,
                          const std::vector<TriangleContacts>& touches, std::vector<RawContacts>& contacts);
// `before`: the candidates that the stage found there, which other pairs keep.
void checkPickedTouches(Contract& contract, const TriangleInput& in, const TriangleHits& hits,
                        const std::vector<TriangleContacts>& touches, const std::vector<RawContacts>& before,
                        const std::vector<RawContacts>& device);

}  // namespace btgpu
