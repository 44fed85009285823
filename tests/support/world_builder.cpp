// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/support/world_builder.h"

#include <numeric>

#include "translation/hull_features.h"
#include "translation/mesh_tree.h"

namespace btgpu {
namespace {

// btBroadphaseProxy::CollisionFilterGroups, as btDiscreteDynamicsWorld::addRigidBody uses them.
constexpr int kDefaultGroup = 1, kStaticGroup = 2, kAllGroups = -1;
constexpr float kThreshold = 0.02f;  // gContactBreakingThreshold

template <typename T>
void markAllChanged(Tracked<T>& tracked) {
  tracked.changed.resize(tracked.values.size());
  std::iota(tracked.changed.begin(), tracked.changed.end(), 0u);
}

float inverse(float v) { return v != 0 ? 1 / v : 0; }

}  // namespace

float uniform(std::mt19937& random, float low, float high) {
  // Not std::uniform_real_distribution: its numbers differ between standard libraries.
  return low + (high - low) * static_cast<float>(random() >> 8) * (1.0f / 16777216.0f);
}

float4 uniform3(std::mt19937& random, float low, float high) {
  const float x = uniform(random, low, high), y = uniform(random, low, high), z = uniform(random, low, high);
  return {x, y, z, 0};
}

float4 randomTurn(std::mt19937& random) {
  while (true) {
    float4 q = uniform3(random, -1, 1);
    q.w = uniform(random, -1, 1);
    const float lengthSqr = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    if (lengthSqr < 1 && lengthSqr > 0.01f) return q / std::sqrt(lengthSqr);
  }
}

float4 turnAbout(float4 axis, float angle) {
  const float length = std::sqrt(axis.x * axis.x + axis.y * axis.y + axis.z * axis.z);
  const float s = std::sin(angle / 2) / length;
  return {axis.x * s, axis.y * s, axis.z * s, std::cos(angle / 2)};
}

float4 turnProduct(float4 a, float4 b) {
  return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z,
          a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

float4 turned(float4 q, float4 v) {
  const float4 r = turnProduct(turnProduct(q, {v.x, v.y, v.z, 0}), {-q.x, -q.y, -q.z, q.w});
  return {r.x, r.y, r.z, 0};
}

int WorldBuilder::addShape(Shape shape) {
  shape.breakingThreshold = kThreshold;
  m_input.shapes.values.push_back(shape);
  return static_cast<int>(m_input.shapes.values.size()) - 1;
}

namespace {

Shape shapeOf(int type, float margin, float4 extents) {
  Shape shape{};
  shape.type = type;
  shape.margin = margin;
  shape.extents = extents;
  return shape;
}

}  // namespace

int WorldBuilder::sphere(float radius) { return addShape(shapeOf(SHAPE_SPHERE, radius, {radius, 0, 0, 0})); }

int WorldBuilder::box(float4 halfExtents, float margin) {
  return addShape(shapeOf(SHAPE_BOX, margin, {halfExtents.x, halfExtents.y, halfExtents.z, 0}));
}

int WorldBuilder::plane(float4 normal, float constant) {
  return addShape(shapeOf(SHAPE_PLANE, 0, {normal.x, normal.y, normal.z, constant}));
}

int WorldBuilder::capsule(int axis, float radius, float halfLength) {
  return addShape(shapeOf(SHAPE_CAPSULE, radius,
                          {axis == 0 ? halfLength : 0, axis == 1 ? halfLength : 0, axis == 2 ? halfLength : 0, 0}));
}

int WorldBuilder::hull(const std::vector<float4>& points, float margin) {
  Shape shape = appendHull(makeHullFeatures(points), m_input.hulls);
  shape.type = SHAPE_HULL;
  shape.margin = margin;
  float4 lower = points.front(), upper = points.front();
  for (const float4& p : points) {
    lower = fmin(lower, p);
    upper = fmax(upper, p);
  }
  // btPolyhedralConvexAabbCachingShape: the margin twice.
  shape.extents = (upper - lower) * 0.5f + float4{2 * margin, 2 * margin, 2 * margin, 0};
  shape.centre = (upper + lower) * 0.5f;
  return addShape(shape);
}

int WorldBuilder::compound(float4 halfExtents) { return addShape(shapeOf(SHAPE_COMPOUND, 0.04f, halfExtents)); }

uint WorldBuilder::addChild(uint body, int shapeIndex, const BodyPose& pose) {
  const uint i = addSlot();
  info(body).flags |= BODY_COMPOUND;
  BodyInfo child = info(body);
  child.shapeIndex = shapeIndex;
  child.flags = (child.flags & ~(BODY_COMPOUND | BODY_INTEGRATED)) | BODY_CHILD;
  child.parent = body;
  child.depth = 1;
  info(i) = child;
  m_input.childPoses.values.resize(m_input.bodyCount, {{}, kNoTurn});
  m_input.childPoses.values[i] = pose;
  return i;
}

namespace {

Shape roundShape(int type, int axis, float radius, float halfLength, float margin) {
  const float across = radius + margin, length = std::fabs(halfLength) + margin;
  Shape shape =
      shapeOf(type, margin, {axis == 0 ? length : across, axis == 1 ? length : across, axis == 2 ? length : across, 0});
  shape.variant = axis;
  shape.radius = radius;
  shape.halfLength = halfLength;
  return shape;
}

}  // namespace

int WorldBuilder::cylinder(int axis, float radius, float halfLength, float margin) {
  return addShape(roundShape(SHAPE_CYLINDER, axis, radius, halfLength, margin));
}

int WorldBuilder::cone(int axis, float radius, float halfLength, float margin) {
  Shape shape = roundShape(SHAPE_CONE, axis, radius, halfLength, margin);
  shape.boundsMargins = 2;
  return addShape(shape);
}

int WorldBuilder::scaled(int shape) {
  Shape copy = m_input.shapes.values[static_cast<size_t>(shape)];
  copy.boundsMargins = 1;
  return addShape(copy);
}

int WorldBuilder::spheres(const std::vector<float4>& spheres, float margin, float4 stretch) {
  HullFeatures list;
  list.vertices = spheres;
  list.vertices.push_back(stretch);
  Shape shape = appendHull(list, m_input.hulls);
  shape.type = SHAPE_MULTI_SPHERE;
  shape.vertexCount -= 1;
  shape.margin = margin;
  float4 lower = spheres.front(), upper = spheres.front();
  for (const float4& s : spheres) {
    const float4 reach = stretch * s.w + float4{margin, margin, margin, 0};
    lower = fmin(lower, s - reach);
    upper = fmax(upper, s + reach);
  }
  shape.extents = (upper - lower) * 0.5f;
  shape.centre = (upper + lower) * 0.5f;
  shape.extents.w = shape.centre.w = 0;
  return addShape(shape);
}

int WorldBuilder::sum(const std::vector<float4>& spheres, int type, float4 turn, int axis, float radius,
                      float halfLength, float margin) {
  HullFeatures terms;
  terms.vertices = {{0.1f, -0.2f, 0.05f, 0}, kNoTurn, {float(SHAPE_MULTI_SPHERE), float(spheres.size()), 0, 0}};
  terms.vertices.insert(terms.vertices.end(), spheres.begin(), spheres.end());
  for (const float4& head : {float4{1, 1, 1, 0}, turn, float4{float(type), float(axis), radius, halfLength}}) {
    terms.vertices.push_back(head);
  }
  Shape shape = appendHull(terms, m_input.hulls);
  shape.type = SHAPE_SUM;
  shape.margin = margin;
  float reach = 0.25f + radius + std::fabs(halfLength) + margin;
  float most = 0;
  for (const float4& s : spheres) most = std::max(most, std::sqrt(s.x * s.x + s.y * s.y + s.z * s.z) + s.w);
  reach += most;
  shape.extents = {reach, reach, reach, 0};
  return addShape(shape);
}

int WorldBuilder::mesh(const std::vector<float4>& corners, float margin) {
  std::vector<MeshTriangle> triangles;
  for (size_t i = 0; i + 2 < corners.size(); i += 3) {
    triangles.push_back({corners[i], corners[i + 1], corners[i + 2], 7, static_cast<int>(i / 3), {0, 0}});
  }
  const MeshTree tree = makeMeshTree(std::move(triangles));
  Shape shape = shapeOf(SHAPE_MESH, margin, (tree.upper - tree.lower) * 0.5f + float4{margin, margin, margin, 0});
  shape.centre = (tree.upper + tree.lower) * 0.5f;
  shape.firstVertex = appendMesh(tree, m_input.meshes);
  return addShape(shape);
}

uint WorldBuilder::addSlot() {
  m_input.infos.values.push_back({});
  m_input.poses.values.push_back({{}, kNoTurn});
  m_input.velocities.values.push_back({});
  m_input.forces.values.push_back({});
  m_input.masses.values.push_back({});
  m_input.materials.values.push_back({});
  m_input.dampings.values.push_back({});
  m_input.activations.values.push_back({});
  return m_input.bodyCount++;
}

uint WorldBuilder::addFree() { return addSlot(); }

float4 WorldBuilder::inertia(const Shape& s, float mass) const {
  if (s.type == SHAPE_SPHERE) {
    const float i = 0.4f * mass * s.extents.x * s.extents.x;
    return {i, i, i, 0};
  }
  const float4 sqr = s.extents * s.extents * (mass / 3);
  return {sqr.y + sqr.z, sqr.x + sqr.z, sqr.x + sqr.y, 0};
}

uint WorldBuilder::add(int shapeIndex, float4 position, float mass, float4 orientation) {
  const uint i = addSlot();
  const bool isStatic = mass == 0;
  BodyInfo& b = info(i);
  b.shapeIndex = shapeIndex;
  b.flags = BODY_PRESENT | BODY_RIGID | (isStatic ? BODY_STATIC : BODY_INTEGRATED);
  b.filterGroup = isStatic ? kStaticGroup : kDefaultGroup;
  b.filterMask = isStatic ? kAllGroups ^ kStaticGroup : kAllGroups;
  b.uniqueId = static_cast<int>(i) + 1;
  pose(i) = {position, orientation};
  if (!isStatic) {
    const float4 moment = inertia(shape(shapeIndex), mass);
    this->mass(i).inverseInertiaLocal = {inverse(moment.x), inverse(moment.y), inverse(moment.z), 1 / mass};
  }
  this->mass(i).linearFactor = this->mass(i).angularFactor = {1, 1, 1, 0};
  material(i).friction = 0.5f;
  material(i).contactStiffness = 1e18f;
  material(i).contactDamping = 0.1f;
  material(i).contactProcessingThreshold = 1e18f;
  material(i).anisotropicFriction = {1, 1, 1, 0};
  damping(i).additionalFactor = 0.005f;
  damping(i).additionalLinearThresholdSqr = damping(i).additionalAngularThresholdSqr = 0.01f;
  damping(i).linearSleepingThreshold = 0.8f;
  damping(i).angularSleepingThreshold = 1;
  activation(i) = {isStatic ? STATE_SLEEPING : STATE_ACTIVE, 0};
  return i;
}

uint WorldBuilder::addKinematic(int shapeIndex, float4 position, float4 orientation) {
  const uint i = add(shapeIndex, position, 0, orientation);
  info(i).flags = BODY_PRESENT | BODY_RIGID | BODY_KINEMATIC;
  activation(i).state = STATE_DISABLE_DEACTIVATION;
  return i;
}

uint WorldBuilder::addObject(int shapeIndex, float4 position, float4 orientation) {
  const uint i = add(shapeIndex, position, 0, orientation);
  info(i).flags = BODY_PRESENT | BODY_STATIC;
  mass(i) = {};
  damping(i) = {};
  activation(i).state = STATE_ACTIVE;
  return i;
}

void WorldBuilder::addRandom(std::mt19937& random, const RandomWorld& what) {
  for (uint p = 0; p < what.planes; ++p) {
    const float4 tilt = uniform3(random, -0.3f, 0.3f);
    const float length = std::sqrt(tilt.x * tilt.x + 1 + tilt.z * tilt.z);
    add(plane({tilt.x / length, 1 / length, tilt.z / length, 0}, -what.extent), {}, 0);
  }
  for (uint n = 0; n < what.bodies; ++n) {
    if (uniform(random, 0, 1) < what.freeShare) addFree();
    const bool round = random() % 2 != 0;
    const float4 size = uniform3(random, what.minSize, what.maxSize);
    const int shapeIndex = round ? sphere(size.x) : box(size, 0.1f * std::fmin(size.x, std::fmin(size.y, size.z)));
    const float4 position = uniform3(random, -what.extent, what.extent), orientation = randomTurn(random);
    const float kind = uniform(random, 0, 1);
    uint i;
    if (kind < what.staticShare) {
      i = add(shapeIndex, position, 0, orientation);
    } else if (kind < what.staticShare + what.kinematicShare) {
      i = addKinematic(shapeIndex, position, orientation);
    } else {
      i = add(shapeIndex, position, uniform(random, 0.5f, 4), orientation);
    }
    if (info(i).flags & BODY_STATIC) continue;
    velocity(i) = {uniform3(random, -what.maxSpeed, what.maxSpeed), uniform3(random, -what.maxSpeed, what.maxSpeed)};
  }
}

WorldInput WorldBuilder::finish() const {
  WorldInput in = m_input;
  markAllChanged(in.infos);
  markAllChanged(in.poses);
  markAllChanged(in.velocities);
  markAllChanged(in.forces);
  markAllChanged(in.masses);
  markAllChanged(in.materials);
  markAllChanged(in.dampings);
  markAllChanged(in.activations);
  markAllChanged(in.shapes);
  if (!in.childPoses.values.empty()) in.childPoses.values.resize(in.bodyCount, {{}, kNoTurn});
  markAllChanged(in.childPoses);
  in.born = in.infos.changed;
  return in;
}

}  // namespace btgpu
