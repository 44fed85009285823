// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A small world in which every stage of the pipeline has something to do.
#pragma once

#include "tests/support/joint_scene.h"

namespace btgpu {

// A box, a ball, a capsule and a pyramid on a plane, each touched by another one of these. Bodies 1 to 8.
inline WorldInput mixedWorld() {
  WorldBuilder b;
  const int plane = b.plane({0, 1, 0, 0}, 0), ball = b.sphere(0.5f), box = b.box({0.5f, 0.5f, 0.5f, 0});
  const int capsule = b.capsule(0, 0.5f, 0.5f);
  const int pyramid = b.hull({{-0.5f, -0.5f, -0.5f, 0},
                              {0.5f, -0.5f, -0.5f, 0},
                              {0.5f, -0.5f, 0.5f, 0},
                              {-0.5f, -0.5f, 0.5f, 0},
                              {0, 0.5f, 0, 0}});
  b.add(plane, {0, 0, 0, 0}, 0);
  const int shapes[] = {box, box, ball, capsule, pyramid, box, capsule, ball};
  for (int i = 0; i < 8; ++i)
    b.add(shapes[i], {0.95f * float(i / 2), 0.49f + 0.97f * float(i % 2), 0.1f * float(i), 0});
  for (uint i = 1; i <= 8; ++i) b.forces(i).force = {0, -10, 0, 0};
  return b.finish();
}

// What else there is of shapes: a mesh of a few triangles and a compound of two balls, a cylinder, a cone, a ball and a
// box on it and on each other. Body 0 is the mesh, 1 the compound, its balls have the slots 2 and 3.
inline WorldInput otherShapesWorld() {
  WorldBuilder b;
  std::vector<float4> corners;
  for (const float x : {-4.0f, 0.0f, 4.0f}) {
    for (const float z : {-2.0f, 2.0f}) {
      const float4 a{x, 0, z - 2, 0}, c{x, 0, z + 2, 0}, d{x + 4, 0.1f * z, z - 2, 0}, e{x + 4, 0.1f * z, z + 2, 0};
      corners.insert(corners.end(), {a, c, d, d, c, e});
    }
  }
  const int mesh = b.mesh(corners), ball = b.sphere(0.4f), box = b.box({0.4f, 0.4f, 0.4f, 0});
  const int cylinder = b.cylinder(1, 0.36f, 0.36f), cone = b.cone(1, 0.36f, 0.36f),
            whole = b.compound({0.9f, 0.4f, 0.4f, 0});
  b.add(mesh, {0, 0, 0, 0}, 0);
  b.add(whole, {-1.5f, 0.39f, 0, 0});
  b.addChild(1, ball, {{-0.5f, 0, 0, 0}, kNoTurn});
  b.addChild(1, ball, {{0.5f, 0, 0, 0}, kNoTurn});
  const int shapes[] = {cylinder, cone, box, ball, cylinder, box, cone};
  for (int i = 0; i < 7; ++i) {
    const uint body = b.add(shapes[i], {0.5f + 0.8f * float(i / 2), 0.4f + 0.78f * float(i % 2), 0.05f * float(i), 0});
    b.forces(body).force = {0, -10, 0, 0};
  }
  const int plane = b.plane({0, 1, 0, 0}, -0.3f);
  b.add(plane, {0, 0, 0, 0}, 0);
  b.add(cylinder, {20, 0.09f, 0, 0});
  b.add(box, {22, 0.5f, 0, 0});
  b.add(box, {22.1f, 1.29f, 0, 0});
  b.forces(1).force = {0, -10, 0, 0};
  return b.finish();
}

// The same with what keeps substeps from running ahead: two joints, and a contact that the host found. `more` joints
// hold one body, which must wait for each other.
inline WorldInput mixedWorldWithJoints(uint more = 0) {
  JointScene scene;
  scene.add(1, 2);
  scene.addRow({1, 0, 0, 0}, {0, 0, 0.5f, 0}, {-1, 0, 0, 0}, {0, 0, 0.5f, 0});
  scene.add(3, NO_INDEX);
  scene.addRow({0, 1, 0, 0.1f}, {0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0});
  for (; more > 0; --more) {
    scene.add(5, NO_INDEX);
    scene.addRow({1, 0, 0, 0.01f}, {0, 0, 0, 0}, {0, 0, 0, 0}, {0, 0, 0, 0});
  }
  WorldInput input = scene.addTo(mixedWorld());
  Manifold contact{};
  contact.bodyA = 8;
  contact.pointCount = 1;
  contact.breakingThreshold = contact.processingThreshold = 0.02f;
  contact.points[0].localPointA = {0, -0.5f, 0, -0.01f};
  contact.points[0].normalWorldOnB = {0, 1, 0, 0};
  contact.points[0].combined = {0.5f, 0, 0, 0};
  input.hostManifolds = {contact};
  return input;
}

}  // namespace btgpu
