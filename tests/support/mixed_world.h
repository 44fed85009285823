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
