// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Structures of boxes for benchmarks: the pyramids of Box3D's, rebuilt from their description, and larger ones.
#include <algorithm>
#include <cmath>

#include "parts.h"

namespace scenes {
namespace {

constexpr double kTurn = 6.283185307179586;

// Boxes of edge 1 in a flat pyramid on `base` boxes, which touch each other.
void addPyramid(Objects& o, btBoxShape* box, int base, double x, double z) {
  for (int row = 0; row < base; ++row) {
    for (int i = 0; i < base - row; ++i) {
      o.add(1, box, btVector3(s(x + i - 0.5 * (base - row - 1)), s(0.5 + row), s(z)));
    }
  }
}

btBoxShape* unitBox(Objects& o) { return o.box(btVector3(s(0.5), s(0.5), s(0.5))); }

void buildLargePyramid(Objects& o, Size n) {
  addFloor(o, n.x + 20.0, 3.0 * n.z + 20);
  btBoxShape* box = unitBox(o);
  for (int z = 0; z < n.z; ++z) addPyramid(o, box, n.x, 0, 3.0 * (z - 0.5 * (n.z - 1)));
}

void buildManyPyramids(Objects& o, Size n) {
  const double pitchX = n.y + 1.0, pitchZ = 3.0;
  addFloor(o, pitchX * n.x / 2 + 20, pitchZ * n.z / 2 + 20);
  btBoxShape* box = unitBox(o);
  for (int z = 0; z < n.z; ++z) {
    for (int x = 0; x < n.x; ++x) {
      addPyramid(o, box, n.y, pitchX * (x - 0.5 * (n.x - 1)), pitchZ * (z - 0.5 * (n.z - 1)));
    }
  }
}

// Each ring is as far out as its bricks need: their inner edges are 1 cm apart.
double innermostRadius(int bricks) { return 0.505 / std::tan(kTurn / (2 * bricks)) + 0.25; }

void buildRing(Objects& o, Size n) {
  const double outermost = innermostRadius(n.x) + 4.0 * (n.z - 1);
  addFloor(o, outermost + 40, outermost + 40);
  btBoxShape* brick = o.box(btVector3(s(0.25), s(0.25), s(0.5)));  // its x axis points outwards
  for (int z = 0; z < n.z; ++z) {
    const double radius = innermostRadius(n.x) + 4.0 * z;
    for (int y = 0; y < n.y; ++y) {
      for (int x = 0; x < n.x; ++x) {
        const double angle = kTurn * (x + 0.5 * (y % 2)) / n.x;
        const btQuaternion turn(btVector3(0, 1, 0), s(-angle));
        const btVector3 at(s(radius * std::cos(angle)), s(0.25 + 0.5 * y), s(radius * std::sin(angle)));
        o.add(1, brick, btTransform(turn, at));
      }
    }
  }
}

void buildColumns(Objects& o, Size n) {
  addFloor(o, 1.0 * n.x + 20, 1.0 * n.z + 20);
  btBoxShape* box = unitBox(o);
  for (int x = 0; x < n.x; ++x) {
    for (int z = 0; z < n.z; ++z) {
      for (int y = 0; y < n.y; ++y) {
        o.add(1, box, btVector3(s(2.0 * (x - 0.5 * (n.x - 1))), s(0.5 + y), s(2.0 * (z - 0.5 * (n.z - 1)))));
      }
    }
  }
}

// Four beams a storey, side by side; the next storey's lie across them.
void addTower(Objects& o, btBoxShape* beam, int storeys, double x, double z) {
  const btQuaternion across(btVector3(0, 1, 0), s(kTurn / 4));
  for (int y = 0; y < storeys; ++y) {
    for (int i = 0; i < 4; ++i) {
      const double side = 0.55 * (i - 1.5);
      const bool odd = y % 2 != 0;
      const btVector3 at(s(x + (odd ? 0.0 : side)), s(0.25 + 0.5 * y), s(z + (odd ? side : 0.0)));
      o.add(1, beam, btTransform(odd ? across : btQuaternion::getIdentity(), at));
    }
  }
}

void buildCity(Objects& o, Size n) {
  constexpr double kPitch = 4;
  addFloor(o, kPitch * n.x / 2 + 20, kPitch * n.z / 2 + 20);
  btBoxShape* beam = o.box(btVector3(s(0.25), s(0.25), s(1.1)));
  for (int x = 0; x < n.x; ++x) {
    for (int z = 0; z < n.z; ++z) {
      addTower(o, beam, n.y, kPitch * (x - 0.5 * (n.x - 1)), kPitch * (z - 0.5 * (n.z - 1)));
    }
  }
}

// Of the pyramid with about so many boxes.
int baseOf(int boxes) { return std::max(1, static_cast<int>(std::lround(std::sqrt(2.0 * boxes + 0.25) - 0.5))); }

}  // namespace

std::vector<Scene> bigBoxScenes() {
  return {
      // 100 boxes at the base are 5,050 in all. Ten iterations can't hold that: stock's falls by step 200.
      {"large_pyramid",
       "pyramids of X boxes at the base, Z of them, whose boxes touch",
       {12, 1, 1},
       200,
       kStep,
       {10, 0, Rest::Yes},
       buildLargePyramid,
       {{100, 1, 1},
        40,
        [](int n) {
          return Size{baseOf(n), 1, 1};
        }}},
      {"many_pyramids",
       "X by Z pyramids of Y boxes at the base",
       {2, 6, 3},
       200,
       kStep,
       {10, 0, Rest::Yes},
       buildManyPyramids,
       {{14, 10, 14},
        40,
        [](int n) {
          return Size{root(n / 55.0, 2), 10, root(n / 55.0, 2)};
        }}},
      {"ring",
       "Z walls of Y courses around each other, each a ring of X bricks",
       {24, 5, 1},
       200,
       kStep,
       {10, 0, Rest::Yes},
       buildRing,
       {{2200, 50, 1},
        120,
        [](int n) {
          const int y = std::min(50, root(n / 4.0, 2));
          return Size{std::max(8, n / y), y, 1};
        }}},
      {"columns",
       "X by Z columns of Y boxes",
       {4, 8, 4},
       200,
       kStep,
       {10, 0, Rest::Yes},
       buildColumns,
       {{100, 10, 100},
        120,
        [](int n) {
          return Size{root(n / 10.0, 2), 10, root(n / 10.0, 2)};
        }}},
      {"city",
       "X by Z towers of Y storeys, each of four beams laid crosswise",
       {2, 8, 2},
       200,
       kStep,
       {10, 0, Rest::Yes},
       buildCity,
       {{125, 16, 125},
        60,
        [](int n) {
          return Size{root(n / 64.0, 2), 16, root(n / 64.0, 2)};
        }}},
  };
}

}  // namespace scenes
