// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "landscape.h"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>

#include <algorithm>
#include <cmath>

namespace scenes {

Landscape rollingLandscape(Size n) {
  const int corners = 2 * std::max(n.x, n.z) + 21;
  const double half = (corners - 1) / 2.0;
  return {corners, 1, [half](double x, double z) {
            const double rim = std::max(std::fabs(x), std::fabs(z)) - (half - 6);
            return 0.8 * std::sin(0.35 * x) * std::cos(0.27 * z) + 0.3 * std::sin(0.9 * x + 0.4 * z) +
                   (rim > 0 ? 0.25 * rim * rim : 0);
          }};
}

btRigidBody* addMesh(Objects& o, const Landscape& land) {
  auto* mesh = o.keep(std::make_unique<btTriangleMesh>());
  const auto corner = [&land](int i, int j) { return btVector3(s(land.at(i)), s(land.height(i, j)), s(land.at(j))); };
  for (int i = 0; i + 1 < land.corners; ++i) {
    for (int j = 0; j + 1 < land.corners; ++j) {
      mesh->addTriangle(corner(i, j), corner(i, j + 1), corner(i + 1, j));
      mesh->addTriangle(corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1));
    }
  }
  btRigidBody* ground = o.add(0, o.shape<btBvhTriangleMeshShape>(mesh, true), btVector3(0, 0, 0));
  ground->setFriction(s(0.8));
  return ground;
}

btRigidBody* addHeightField(Objects& o, const Landscape& land) {
  auto* heights = o.keep(std::make_unique<std::vector<float>>());
  double lowest = 1e30, highest = -1e30;
  for (int j = 0; j < land.corners; ++j) {
    for (int i = 0; i < land.corners; ++i) {
      heights->push_back(static_cast<float>(land.height(i, j)));
      lowest = std::min(lowest, land.height(i, j));
      highest = std::max(highest, land.height(i, j));
    }
  }
  auto shape = std::make_unique<btHeightfieldTerrainShape>(land.corners, land.corners, heights->data(), s(lowest),
                                                           s(highest), 1, false);
  shape->setLocalScaling(btVector3(s(land.pitch), 1, s(land.pitch)));
  shape->setUseDiamondSubdivision(true);
  // Bullet puts the middle between the two heights at the origin.
  btRigidBody* ground = o.add(0, o.own(std::move(shape)), btVector3(0, s((lowest + highest) / 2), 0));
  ground->setFriction(s(0.8));
  return ground;
}

void addMeshGround(Objects& o, Size n) { addMesh(o, rollingLandscape(n)); }

void addHeightFieldGround(Objects& o, Size n) { addHeightField(o, rollingLandscape(n)); }

}  // namespace scenes
