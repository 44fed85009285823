// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Joints and vehicles.
#include <algorithm>
#include <cmath>

#include "landscape.h"
#include "parts.h"

namespace scenes {
namespace {

void buildRagdoll(Objects& o, Size n) {
  addFloor(o);
  std::mt19937 random(2);
  for (int y = 0; y < n.y; ++y) {
    for (int x = 0; x < n.x; ++x) {
      for (int z = 0; z < n.z; ++z) {
        const btVector3 at(s(2.2 * (x - n.x / 2)), s(0.6 + 2.2 * y), s(2.2 * (z - n.z / 2)));
        addRagdoll(o, at, randomRotation(random), Limbs::Boxes);
      }
    }
  }
}

// Low hills with room for X cars side by side that drive along the z axis, and for what rolls off the sides.
Landscape road(Size n) {
  const int corners = static_cast<int>(std::max(12.0 * n.x + 40, 3.0 * n.z + 80)) + 1;
  return {corners, 1, [](double x, double z) {
            return 0.5 * std::sin(0.2 * x) * std::cos(0.15 * z) + 0.1 * std::sin(0.7 * x + 0.9 * z);
          }};
}

// X cars drive a curve over hills, through rows of Z stacks of crates.
void buildVehicle(Objects& o, Size n) {
  o.world().setGravity(kGravity);
  const Landscape land = road(n);
  addHeightField(o, land);
  btBoxShape* body = o.box(btVector3(1, s(0.5), 2));
  btBoxShape* crate = o.box(btVector3(s(0.4), s(0.4), s(0.4)));
  const auto placedOver = [&land](double x, double over, double z) {
    return btVector3(s(x), s(land.heightAt(x, z) + over), s(z));
  };
  for (int x = 0; x < n.x; ++x) {
    const double left = 12.0 * (x - 0.5 * (n.x - 1)), start = 20 - land.side() / 2;
    btRigidBody* chassis = o.add(800, body, placedOver(left, 1.7, start));
    chassis->setActivationState(DISABLE_DEACTIVATION);
    btRaycastVehicle* vehicle = o.vehicle(chassis, s(0.9));
    for (int wheel = 2; wheel < 4; ++wheel) vehicle->applyEngineForce(s(1500), wheel);
    for (int wheel = 0; wheel < 2; ++wheel) vehicle->setSteeringValue(s(0.03 * (x + 1)), wheel);
    for (int z = 0; z < n.z; ++z) {
      for (int y = 0; y < n.y; ++y) {
        o.add(20, crate, placedOver(left + 1.2 * (z % 3), 0.45 + 0.8 * y, start + 8 + 3.0 * z));
      }
    }
  }
}

}  // namespace

std::vector<Scene> machineScenes() {
  return {
      // Boxes that slide and tumble have old points in their manifolds. Of the new ones on top Bullet keeps those that
      // span the largest area together with the old ones, which it then drops: the deepest may be lost, in either
      // world, and which one depends on the order of the points. 0.2 to 0.9 % of the pairs in these two scenes, all in
      // motion.
      {"ragdoll",
       "ragdolls of boxes, spheres, cone twist joints and hinges, dropped on the ground",
       {3, 2, 3},
       400,
       kStep,
       {10, 0, Rest::AsStock, 0.05, 0.01, {"joints"}},
       buildRagdoll,
       {{8, 4, 8}, 120, nullptr}},
      {"vehicle",
       "X raycast vehicles that drive over a height field, through Z stacks of Y crates",
       {2, 2, 4},
       240,
       kStep,
       {10, -1, Rest::No, 0, 0.01, {"actions"}},
       buildVehicle,
       {{4, 8, 12}, 120, nullptr}},
  };
}

}  // namespace scenes
