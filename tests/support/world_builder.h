// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Builds a WorldInput body by body, with Bullet's defaults, or at random from a seed. No Bullet, no OpenCL.
#pragma once

#include <random>
#include <vector>

#include "gpu_engine/world_input.h"

namespace btgpu {

constexpr float4 kNoTurn{0, 0, 0, 1};

// The unit quaternion that turns by `angle` (radians) about `axis` (any length).
float4 turnAbout(float4 axis, float angle);

// Quaternion product: first b, then a. And v turned by q.
float4 turnProduct(float4 a, float4 b);
float4 turned(float4 q, float4 v);

// What a random world is made of. Sizes and positions are in length units.
struct RandomWorld {
  uint bodies = 100;                     // without the planes and the free slots
  float extent = 5;                      // positions lie in [-extent, extent] on each axis
  float minSize = 0.3f, maxSize = 0.8f;  // radius or half extent
  float maxSpeed = 3;                    // of each component of both velocities
  float staticShare = 0.1f, kinematicShare = 0.05f, freeShare = 0.05f;
  uint planes = 1;
};

class WorldBuilder {
 public:
  // ---- shapes: return the shape index
  // ------------------------------------------------------------------------
  int sphere(float radius);
  int box(float4 halfExtents, float margin = 0.04f);  // half extents include the margin, as on the device
  int plane(float4 normal, float constant);
  int capsule(int axis, float radius, float halfLength);
  int hull(const std::vector<float4>& points, float margin = 0.04f);
  // Of the core, which the margin surrounds.
  int cylinder(int axis, float radius, float halfLength, float margin = 0.04f);
  // The same shape, bounded by its farthest points.
  int scaled(int shape);
  int cone(int axis, float radius, float halfLength, float margin = 0.04f);
  // w: what their radii are larger than the margin.
  int spheres(const std::vector<float4>& spheres, float margin, float4 stretch = {1, 1, 1, 0});
  // The hull of such spheres and a cylinder or cone, turned, added to each other.
  int sum(const std::vector<float4>& spheres, int type, float4 turn, int axis, float radius, float halfLength,
          float margin);
  // Three corners a triangle. Part 7, and the index of the triangle, are what Bullet calls it.
  int mesh(const std::vector<float4>& corners, float margin = 0);

  // ---- bodies: return the body index; its uniqueId is the index + 1
  // ------------------------------------------ A rigid body; a mass of zero makes it static. Planes must be
  // static.
  uint add(int shapeIndex, float4 position, float mass = 1, float4 orientation = kNoTurn);
  // A kinematic rigid body without mass.
  uint addKinematic(int shapeIndex, float4 position, float4 orientation = kNoTurn);
  // A plain static btCollisionObject: no BODY_RIGID, active.
  uint addObject(int shapeIndex, float4 position, float4 orientation = kNoTurn);
  // One more shape of a body: from then on its own shape is a compound, as large as `halfExtents`. Returns the slot.
  uint addChild(uint body, int shapeIndex, const BodyPose& pose);
  int compound(float4 halfExtents);
  // A slot without a body.
  uint addFree();
  void addRandom(std::mt19937& random, const RandomWorld& what);

  // The record of a body, to change before finish().
  BodyInfo& info(uint body) { return m_input.infos.values[body]; }
  BodyPose& pose(uint body) { return m_input.poses.values[body]; }
  BodyVelocity& velocity(uint body) { return m_input.velocities.values[body]; }
  BodyForces& forces(uint body) { return m_input.forces.values[body]; }
  BodyMass& mass(uint body) { return m_input.masses.values[body]; }
  BodyMaterial& material(uint body) { return m_input.materials.values[body]; }
  BodyDamping& damping(uint body) { return m_input.dampings.values[body]; }
  BodyActivation& activation(uint body) { return m_input.activations.values[body]; }
  Shape& shape(int index) { return m_input.shapes.values[static_cast<size_t>(index)]; }
  const BodyInfo& info(uint body) const { return m_input.infos.values[body]; }
  const BodyPose& pose(uint body) const { return m_input.poses.values[body]; }
  const HullArrays& hulls() const { return m_input.hulls; }
  const MeshArrays& meshes() const { return m_input.meshes; }
  const Shape& shape(int index) const { return m_input.shapes.values[static_cast<size_t>(index)]; }
  uint bodyCount() const { return m_input.bodyCount; }

  // The world with everything listed as changed and every body as born.
  WorldInput finish() const;

 private:
  int addShape(Shape shape);
  uint addSlot();
  float4 inertia(const Shape& shape, float mass) const;

  WorldInput m_input;
};

// Uniform in [low, high); for float4 in each of x, y, z, w = 0.
float uniform(std::mt19937& random, float low, float high);
float4 uniform3(std::mt19937& random, float low, float high);
// A uniformly distributed unit quaternion.
float4 randomTurn(std::mt19937& random);

}  // namespace btgpu
