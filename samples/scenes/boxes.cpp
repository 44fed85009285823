// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Boxes alone.
#include <algorithm>
#include <cmath>

#include "parts.h"

namespace scenes {
namespace {

// The paper's demo: layers of boxes with half extent 1, every second layer shifted by half a box.
void buildStack(Objects& o, Size n) {
  addGround(o);
  btBoxShape* box = o.box(btVector3(1, 1, 1));
  for (int y = 0; y < n.y; ++y) {
    const btScalar shift = y % 2 ? s(1) : s(0);
    for (int x = 0; x < n.x; ++x) {
      for (int z = 0; z < n.z; ++z) {
        o.add(1, box, btVector3(s(2.2 * (x - n.x / 2)) + shift, s(1 + 2.2 * y), s(2.2 * (z - n.z / 2)) + shift));
      }
    }
  }
}

void buildPyramid(Objects& o, Size n) {
  addGround(o);
  btBoxShape* box = o.box(btVector3(s(0.5), s(0.5), s(0.5)));
  for (int z = 0; z < n.z; ++z) {
    for (int row = 0; row < n.x; ++row) {
      for (int i = 0; i < n.x - row; ++i) {
        o.add(1, box, btVector3(s(1.05 * (i - 0.5 * (n.x - row))), s(0.5 + 1.0 * row), s(3.0 * z)));
      }
    }
  }
}

void buildWall(Objects& o, Size n) {
  addGround(o);
  btBoxShape* brick = o.box(btVector3(1, s(0.5), s(0.5)));
  for (int z = 0; z < n.z; ++z) {
    for (int y = 0; y < n.y; ++y) {
      for (int x = 0; x < n.x; ++x) {
        o.add(1, brick, btVector3(s(2.02 * x + (y % 2 ? 1.0 : 0.0)), s(0.5 + 1.0 * y), s(4.0 * z)));
      }
    }
  }
}

void buildSlope(Objects& o, Size n) {
  o.world().setGravity(kGravity);
  const btQuaternion tilt(btVector3(0, 0, 1), s(-std::atan(0.5)));
  btRigidBody* ground = o.add(0, o.box(btVector3(100, 1, 100)), btTransform(tilt, btVector3(0, 0, 0)));
  ground->setFriction(1);
  btBoxShape* slab = o.box(btVector3(s(0.5), s(0.1), s(0.5)));
  for (int x = 0; x < n.x; ++x) {
    for (int z = 0; z < n.z; ++z) {
      const btVector3 local(s(-40 + 3.0 * x), s(1.1), s(2.0 * (z - n.z / 2)));
      btRigidBody* body = o.add(1, slab, btTransform(tilt, btTransform(tilt) * local));
      body->setFriction(s(1.0 * (z + 1) / n.z));
    }
  }
}

void buildSpin(Objects& o, Size n) {
  o.world().setGravity(btVector3(0, 0, 0));
  btBoxShape* box = o.box(btVector3(s(0.3), s(0.6), s(1.0)));
  const int flags[] = {0, BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT, BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD,
                       BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY};
  for (int x = 0; x < n.x; ++x) {
    for (int z = 0; z < n.z; ++z) {
      btRigidBody* body = o.add(1, box, btVector3(s(5.0 * x), 0, s(5.0 * z)));
      body->setFlags(flags[z % 4]);
      body->setAngularVelocity(btVector3(s(0.1), s(1.0 + x), s(0.05)));
      body->setActivationState(DISABLE_DEACTIVATION);
    }
  }
}

void buildDomino(Objects& o, Size n) {
  addPlane(o);
  btBoxShape* tile = o.box(btVector3(s(0.1), s(1.0), s(0.5)));
  for (int z = 0; z < n.z; ++z) {
    for (int x = 0; x < n.x; ++x) {
      btRigidBody* body = o.add(1, tile, btVector3(s(1.0 * x), 1, s(4.0 * z)));
      if (x == 0) body->setAngularVelocity(btVector3(0, 0, s(-2.0)));
    }
  }
}

}  // namespace

std::vector<Scene> boxScenes() {
  return {
      {"stack",
       "layers of boxes, every second one shifted (the paper's demo)",
       {8, 8, 8},
       300,
       kStep,
       {8, 0, Rest::Yes},
       buildStack,
       {{16, 16, 16}, 120, cube}},
      {"pyramid",
       "pyramids of X boxes at the base, Z of them",
       {12, 1, 2},
       300,
       kStep,
       {10, 0, Rest::Yes},
       buildPyramid,
       {{24, 1, 14},
        120,
        [](int n) {
          const int x = root(2.0 * n, 3);
          return Size{x, 1, std::max(1, 2 * n / (x * (x + 1)))};
        }}},
      {"wall",
       "Z walls of X by Y bricks",
       {12, 8, 2},
       300,
       kStep,
       {10, 0, Rest::Yes},
       buildWall,
       {{40, 20, 5}, 120, cube}},
      {"slope",
       "slabs of friction up to 1 on a slope of 1 in 2",
       {6, 1, 10},
       300,
       kStep,
       {40, -1e30, Rest::No},
       buildSlope,
       {{40, 1, 90}, 120, nullptr}},
      {"spin",
       "boxes with three different edges spinning freely, one row for each gyroscopic flag",
       {6, 1, 8},
       600,
       kStep,
       {600, -1e30, Rest::No},
       buildSpin,
       {{64, 1, 64}, 120, square}},
      {"domino",
       "Z rows of X dominoes, the first of each pushed",
       {30, 1, 3},
       600,
       kStep,
       {30, 0, Rest::Yes},
       buildDomino,
       {{64, 1, 64}, 240, square}},
  };
}

}  // namespace scenes
