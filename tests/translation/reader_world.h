// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A Bullet world with the reader that translates it, and a stand-in for the device that knows only what was
// uploaded.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "translation/convert.h"
#include "translation/read_bodies.h"
#include "translation/read_world.h"

namespace btgpu::test {

inline btScalar s(double v) { return static_cast<btScalar>(v); }

using Slots = std::vector<std::uint32_t>;
using Upload = std::map<std::string, Slots>;  // by the array's name; arrays without changes are left out

template <typename T>
bool sameBytes(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

// Calls f(name, array of a, array of b) for every array that is tracked.
template <typename A, typename B, typename F>
void forEachArray(A& a, B& b, const F& f) {
  f("infos", a.infos, b.infos);
  f("poses", a.poses, b.poses);
  f("velocities", a.velocities, b.velocities);
  f("forces", a.forces, b.forces);
  f("masses", a.masses, b.masses);
  f("materials", a.materials, b.materials);
  f("dampings", a.dampings, b.dampings);
  f("activations", a.activations, b.activations);
  f("shapes", a.shapes, b.shapes);
}

inline Upload uploadOf(const WorldInput& input) {
  Upload upload;
  forEachArray(input, input, [&upload](const char* name, const auto& array, const auto&) {
    if (!array.changed.empty()) upload[name] = array.changed;
  });
  if (!input.born.empty()) upload["born"] = input.born;
  return upload;
}

class ReaderWorld {
 public:
  ReaderWorld() : dispatcher(&configuration), world(&dispatcher, &broadphase, &solver, &configuration) {
    world.setGravity(btVector3(0, 0, 0));
  }
  ~ReaderWorld() {
    while (world.getNumCollisionObjects() > 0) {
      btCollisionObject* object = world.getCollisionObjectArray()[0];
      if (btRigidBody* body = btRigidBody::upcast(object)) {
        world.removeRigidBody(body);
      } else {
        world.removeCollisionObject(object);
      }
    }
  }

  template <typename ShapeType, typename... Arguments>
  ShapeType* shape(Arguments&&... arguments) {
    auto made = std::make_unique<ShapeType>(std::forward<Arguments>(arguments)...);
    ShapeType* result = made.get();
    m_shapes.push_back(std::move(made));
    return result;
  }
  // A body that is not in the world yet.
  btRigidBody* make(double mass, btCollisionShape* shape, const btVector3& at) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) inertia = btVector3(s(mass), s(2 * mass), s(3 * mass));
    btRigidBody::btRigidBodyConstructionInfo info(s(mass), nullptr, shape, inertia);
    info.m_startWorldTransform.setOrigin(at);
    m_bodies.push_back(std::make_unique<btRigidBody>(info));
    return m_bodies.back().get();
  }
  btRigidBody* add(double mass, btCollisionShape* shape, const btVector3& at) {
    btRigidBody* body = make(mass, shape, at);
    world.addRigidBody(body);
    return body;
  }

  // The first half of a step, with everything that has to hold after any read. What the device then knows is
  // only what was uploaded. Returns the upload.
  Upload read() {
    missing.clear();
    notes.clear();
    world.applyGravity();
    reader.read(world, missing, notes);
    const WorldInput& input = reader.input();
    const Upload upload = uploadOf(input);
    for (const auto& [name, slots] : upload) {
      for (size_t i = 1; i < slots.size(); ++i) EXPECT_LT(slots[i - 1], slots[i]) << name << ": not ascending";
    }
    transfer(input);
    if (missing.empty()) expectCurrent();
    reader.input().clearChanges();
    return upload;
  }
  // The second half: nothing moved.
  void finish() {
    reader.acceptResults(unchangedResults());
    world.clearForces();
  }
  Upload step() {
    const Upload upload = read();
    finish();
    return upload;
  }
  StepResults unchangedResults() const {
    StepResults results;
    results.poses = reader.input().poses.values;
    results.velocities = reader.input().velocities.values;
    results.activations = reader.input().activations.values;
    return results;
  }

  std::uint32_t slot(const btCollisionObject* object) const { return reader.findSlot(object); }
  bool quarantined(const btCollisionObject* object) const {
    return (device.infos.values[slot(object)].flags & BODY_QUARANTINED) != 0;
  }
  std::string missingText() const {
    std::string text;
    for (const auto& entry : missing.entries()) text += entry.what + ": " + entry.reason + "\n";
    return text;
  }
  // Names of what the host has to collide, in order: a compound is read after what it holds.
  std::string hostText() const {
    std::set<std::string> names;
    for (const auto& entry : reader.hostShares().entries()) EXPECT_TRUE(names.insert(entry.what + "\n").second);
    std::string text;
    for (const std::string& name : names) text += name;
    return text;
  }

  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher;
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world;
  WorldReader reader;
  WorldInput device;  // values that the device has
  FallbackList missing, notes;

 private:
  void transfer(const WorldInput& input) {
    // The engine takes an array that grew as a whole (DeviceWorld::upload).
    forEachArray(device, input, [](const char*, auto& to, const auto& from) {
      if (to.values.size() != from.values.size()) to.values = from.values;
      for (const std::uint32_t i : from.changed) to.values.at(i) = from.values[i];
    });
    std::memcpy(device.regionOrigin, input.regionOrigin, sizeof device.regionOrigin);
  }

  // The device knows each object as it is now, and nothing else as present.
  void expectCurrent() {
    std::set<std::uint32_t> used;
    for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
      const btCollisionObject& object = *world.getCollisionObjectArray()[i];
      const std::uint32_t at = slot(&object);
      ASSERT_LT(at, reader.input().bodyCount);
      EXPECT_TRUE(used.insert(at).second) << "two objects in slot " << at;
      EXPECT_EQ(reader.slots()[at].object, &object);
      if (!quarantined(&object)) expectCurrent(object, at);
    }
    for (std::uint32_t at = 0; at < reader.input().bodyCount; ++at) {
      if (!used.count(at)) { EXPECT_EQ(device.infos.values[at].flags, 0u) << "free slot " << at; }
    }
  }
  void expectCurrent(const btCollisionObject& object, std::uint32_t at) {
    const bool integrated =
        world.getNonStaticRigidBodies().findLinearSearch(const_cast<btRigidBody*>(btRigidBody::upcast(&object))) <
        world.getNonStaticRigidBodies().size();
    const int shapeIndex = device.infos.values[at].shapeIndex;
    const BodyRecord record = readBody(object, shapeIndex, integrated);
    EXPECT_TRUE(sameBytes(record.info, device.infos.values[at])) << "info " << at;
    EXPECT_TRUE(sameBytes(record.velocity, device.velocities.values[at])) << "velocity " << at;
    EXPECT_TRUE(sameBytes(record.forces, device.forces.values[at])) << "forces " << at;
    EXPECT_TRUE(sameBytes(record.mass, device.masses.values[at])) << "mass " << at;
    EXPECT_TRUE(sameBytes(record.material, device.materials.values[at])) << "material " << at;
    EXPECT_TRUE(sameBytes(record.damping, device.dampings.values[at])) << "damping " << at;
    EXPECT_TRUE(sameBytes(record.activation, device.activations.values[at])) << "activation " << at;
    expectPose(object, device.poses.values[at], at);
    const Shape& shape = device.shapes.values.at(static_cast<size_t>(shapeIndex));
    const float expected = shape.type == SHAPE_HOST ? 0 : sizeOf(*object.getCollisionShape());
    EXPECT_EQ(shape.extents.x, expected) << "shape of " << at;
  }
  // A pose on the device is a float relative to the region origin: half a unit of it, plus, far from the
  // origin of the world, of the double.
  void expectPose(const btCollisionObject& object, const BodyPose& pose, std::uint32_t at) {
    const btVector3& p = object.getWorldTransform().getOrigin();
    const float local[3] = {pose.position.x, pose.position.y, pose.position.z};
    for (int k = 0; k < 3; ++k) {
      const double error = double(local[k]) + device.regionOrigin[k] - double(p[k]);
      const double bound = std::ldexp(std::fabs(double(local[k])), -24) + std::ldexp(std::fabs(double(p[k])), -52);
      EXPECT_LE(std::fabs(error), bound) << "position " << at << " axis " << k;
    }
    // Bullet keeps a matrix: about eight roundings on the way there and back.
    const btQuaternion q = object.getWorldTransform().getRotation();
    const double bound = std::ldexp(8.0, -24);
    EXPECT_NEAR(double(pose.orientation.x), double(q.x()), bound) << at;
    EXPECT_NEAR(double(pose.orientation.y), double(q.y()), bound) << at;
    EXPECT_NEAR(double(pose.orientation.z), double(q.z()), bound) << at;
    EXPECT_NEAR(double(pose.orientation.w), double(q.w()), bound) << at;
  }
  // The number that the tests tell shapes apart by: extents.x.
  static float sizeOf(const btCollisionShape& shape) {
    if (const auto* box = dynamic_cast<const btBoxShape*>(&shape)) {
      return static_cast<float>(box->getHalfExtentsWithMargin().x());
    }
    if (const auto* sphere = dynamic_cast<const btSphereShape*>(&shape)) {
      return static_cast<float>(sphere->getRadius());
    }
    if (const auto* capsule = dynamic_cast<const btCapsuleShape*>(&shape)) {
      return capsule->getUpAxis() == 0 ? static_cast<float>(capsule->getHalfHeight()) : 0;
    }
    if (const auto* plane = dynamic_cast<const btStaticPlaneShape*>(&shape)) {
      return static_cast<float>(plane->getPlaneNormal().x());
    }
    if (dynamic_cast<const btEmptyShape*>(&shape)) return 0;
    btVector3 lower, upper;
    shape.getAabb(btTransform::getIdentity(), lower, upper);
    return static_cast<float>((upper.x() - lower.x()) * btScalar(0.5));
  }

  std::vector<std::unique_ptr<btCollisionShape>> m_shapes;
  std::vector<std::unique_ptr<btRigidBody>> m_bodies;
};

// Three boxes with one shape between them and a ball, read once: slots 0 to 3, shapes 0 and 1.
struct FourBodies : ReaderWorld {
  FourBodies() {
    for (int i = 0; i < 3; ++i) bodies.push_back(add(1, box, btVector3(s(3 * i), 0, 0)));
    bodies.push_back(add(1, ball, btVector3(9, 0, 0)));
    first = step();
  }
  btBoxShape* box = shape<btBoxShape>(btVector3(s(0.5), s(0.5), s(0.5)));
  btSphereShape* ball = shape<btSphereShape>(s(0.25));
  std::vector<btRigidBody*> bodies;
  Upload first;
};

}  // namespace btgpu::test
