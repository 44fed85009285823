// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the builders of scenes have in common.
#pragma once

#include <random>
#include <vector>

#include "scene.h"

namespace scenes {

inline btScalar s(double v) { return static_cast<btScalar>(v); }

constexpr double kStep = 1.0 / 60.0;
inline const btVector3 kGravity(0, -10, 0);

void addGround(Objects& o);
// For small bodies: the size of a ground box takes digits from its contacts' depths.
void addFloor(Objects& o);
void addPlane(Objects& o);
// A floor of these half extents, for scenes that grow wide.
void addFloor(Objects& o, double halfX, double halfZ);

btQuaternion randomRotation(std::mt19937& random);
// Points on an ellipsoid, so that all of them are corners, with the centre of mass at their mean.
std::vector<btVector3> randomHull(std::mt19937& random, int count, const btVector3& half);

// Bodies of the large piles share this many shapes, so that a million of them fit.
constexpr int kShapes = 64;
// An irregular hull.
btConvexHullShape* rock(Objects& o, std::mt19937& random);
// A grid of bodies, turned at random, above `bottom` and around the y axis.
void pile(Objects& o, Size n, double pitch, double bottom, const std::vector<btCollisionShape*>& shapes,
          std::mt19937& random);
// Static walls around the y axis, as thick as a large body, up to this height.
void addWalls(Objects& o, double halfX, double halfZ, double height);

// A rolling landscape, higher around its rim, so that nothing rolls off it: of triangles, or a height field. Where a
// grid of this size has room.
void addMeshGround(Objects& o, Size n);
void addHeightFieldGround(Objects& o, Size n);
constexpr double kLowestGround = -1.2;

// Compounds: two balls on a bar, three crossed capsules, an L of boxes around its centre of mass, and a table, whose
// legs are a compound of their own.
btCollisionShape* dumbbell(Objects& o);
btCollisionShape* jack(Objects& o);
btCollisionShape* angle(Objects& o);
btCollisionShape* table(Objects& o);

// Not turned.
btTransform placedAt(double x, double y, double z);

// The pose of a body's frame that is `world` now.
btTransform inFrameOf(const btRigidBody& body, const btTransform& world);
// A frame whose axis `from` points along `axis`: a cone twists about its x axis, a hinge turns about its z axis.
btTransform frameAlong(const btVector3& from, const btVector3& axis, const btVector3& at);
// A hinge about the z axis of a frame; the bodies it links don't collide.
btHingeConstraint* addHinge(Objects& o, btRigidBody& a, btRigidBody& b, const btTransform& frame);

enum class Limbs { Boxes, Capsules };
// One figure of eleven bodies and ten joints, 1.7 high, upright at `at` (between its feet), then turned by `turn`.
void addRagdoll(Objects& o, const btVector3& at, const btQuaternion& turn, Limbs limbs);  // ragdoll.cpp

// Calls place(random, x + y + z, pose) for each place of a grid over the ground, the lowest `lift` above it: somewhat
// off, and turned at random.
template <typename Place>
void scatter(Size n, double lift, const Place& place) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter(-0.2, 0.2);
  for (int y = 0; y < n.y; ++y) {
    for (int x = 0; x < n.x; ++x) {
      for (int z = 0; z < n.z; ++z) {
        const double atX = 2.0 * (x - n.x / 2) + jitter(random), atZ = 2.0 * (z - n.z / 2) + jitter(random);
        const btQuaternion rotation = randomRotation(random);
        place(random, x + y + z, btTransform(rotation, btVector3(s(atX), s(lift + 2.0 * y), s(atZ))));
      }
    }
  }
}

// The whole number whose power `exponent` is nearest to n; at least 1.
int root(double n, int exponent);
// The cube that is nearest to n.
inline Size cube(int n) { return {root(n, 3), root(n, 3), root(n, 3)}; }
// The square that is nearest to n.
inline Size square(int n) { return {root(n, 2), 1, root(n, 2)}; }

// The families of scenes, a file each.
std::vector<Scene> boxScenes();       // boxes.cpp
std::vector<Scene> rainScenes();      // rain.cpp
std::vector<Scene> compoundScenes();  // compounds.cpp
std::vector<Scene> shapeScenes();     // shapes.cpp
std::vector<Scene> terrainScenes();   // terrain.cpp
std::vector<Scene> machineScenes();   // machines.cpp
std::vector<Scene> jointScenes();     // joints.cpp
std::vector<Scene> walkerScenes();    // walkers.cpp
std::vector<Scene> classicScenes();   // classic.cpp
std::vector<Scene> bigJointScenes();  // joints.cpp
std::vector<Scene> bigBoxScenes();    // big_boxes.cpp
std::vector<Scene> bigPileScenes();   // big_piles.cpp
std::vector<Scene> junkyardScenes();  // junkyard.cpp
std::vector<Scene> washerScenes();    // washer.cpp

}  // namespace scenes
