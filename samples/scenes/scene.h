// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Scenes written against btDiscreteDynamicsWorld&, so that tests, tools and benchmarks run the same one on stock
// Bullet and on btgpu. Everything is deterministic: two worlds built with the same size hold the same objects in
// the same order.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

class btKinematicCharacterController;

namespace scenes {

struct Size {
  int x, y, z;
};

// Owns the shapes, bodies, joints, vehicles and characters that were put into a world; takes them out again when it
// goes.
class Objects {
 public:
  explicit Objects(btDiscreteDynamicsWorld& world);
  ~Objects();
  Objects(const Objects&) = delete;
  Objects& operator=(const Objects&) = delete;

  btDiscreteDynamicsWorld& world() { return m_world; }
  const std::vector<btRigidBody*>& bodies() const { return m_bodies; }  // in the order they were added

  btBoxShape* box(const btVector3& halfExtents);
  btSphereShape* sphere(btScalar radius);
  btStaticPlaneShape* plane(const btVector3& normal, btScalar constant);
  btCapsuleShape* capsule(btScalar radius, btScalar height);
  btConvexHullShape* hull(const std::vector<btVector3>& points);
  // Any other shape.
  template <typename Shape, typename... Args>
  Shape* shape(Args&&... args) {
    return own(std::make_unique<Shape>(std::forward<Args>(args)...));
  }
  // Takes a shape that a scene made itself; `keep`: what such a shape is made from.
  template <typename S>
  S* own(std::unique_ptr<S> shape) {
    S* raw = shape.get();
    m_shapes.push_back(std::move(shape));
    return raw;
  }
  template <typename T>
  T* keep(std::unique_ptr<T> data) {
    T* raw = data.get();
    m_kept.push_back(std::shared_ptr<T>(std::move(data)));
    return raw;
  }
  // Adds a body; mass 0 makes it static.
  btRigidBody* add(btScalar mass, btCollisionShape* shape, const btTransform& at);
  btRigidBody* add(btScalar mass, btCollisionShape* shape, const btVector3& at);
  // Adds a kinematic body, which nothing but `beforeSubsteps` moves.
  btRigidBody* addKinematic(btCollisionShape* shape, const btTransform& at);
  // Has it called before each substep, with the time that this takes. The world's pre-tick callback and its user info
  // are then in use.
  void beforeSubsteps(std::function<void(btScalar timeStep)> call);

  // Adds a joint; `apart`: the linked bodies don't collide.
  template <typename Joint, typename... Args>
  Joint* joint(bool apart, Args&&... args) {
    auto* made = new Joint(std::forward<Args>(args)...);
    m_joints.emplace_back(made);
    m_world.addConstraint(made, apart);
    return made;
  }
  // Takes a joint out of the world and destroys it.
  void remove(btTypedConstraint* joint);
  // A vehicle on four wheels, the two in front (0 and 1) at the chassis's +z end, `halfTrack` to either side of its
  // middle.
  btRaycastVehicle* vehicle(btRigidBody* chassis, btScalar halfTrack);
  // A character that climbs steps up to this height: a ghost, which only Bullet's controller moves, as an action. What
  // it walks into feels it as a fixed object.
  btKinematicCharacterController* character(btConvexShape* shape, double stepHeight, const btVector3& at);
  // How far the rays of the last substep got, as fractions, in scenes that cast some.
  std::vector<btScalar>& seen() { return m_seen; }

 private:
  struct Character;

  static void preTick(btDynamicsWorld* world, btScalar timeStep);
  btRigidBody* addToWorld(btRigidBody* body);

  btDiscreteDynamicsWorld& m_world;
  std::vector<std::function<void(btScalar)>> m_beforeSubsteps;
  std::vector<std::shared_ptr<void>> m_kept;  // goes after the shapes
  std::vector<std::unique_ptr<btCollisionShape>> m_shapes;
  std::vector<btRigidBody*> m_bodies;
  std::vector<std::unique_ptr<btTypedConstraint>> m_joints;
  std::vector<std::unique_ptr<btVehicleRaycaster>> m_raycasters;
  std::vector<std::unique_ptr<btRaycastVehicle>> m_vehicles;
  std::unique_ptr<btOverlappingPairCallback> m_ghostPairs;
  std::vector<std::unique_ptr<Character>> m_characters;
  std::vector<btScalar> m_seen;
};

// Corners of a regular prism that stands upright around the origin.
std::vector<btVector3> prism(int sides, double radius, double halfHeight);

enum class Rest { Yes, No, AsStock };

// What a comparison with stock may expect of a scene.
struct Expectations {
  // Steps for which single bodies can be held against stock's; later, chaos separates two right simulations.
  int comparableSteps = 0;
  // Nothing may sink below this height; minus infinity where there is no ground.
  double groundHeight = -1e30;
  // Energy and height settle: the end of the run is compared as a resting state.
  Rest comesToRest = Rest::Yes;
  // Mean height at the end may differ from stock's by this share, where 0.5 % is too strict (reason at the scene).
  double heightTolerance = 0;
  // Share of pairs whose deepest point may be another than stock's, where 0.1 % is too strict (reason at the scene).
  double otherDepths = 0;
  // What the CPU does inside the device's steps, by the names of btGpuDynamicsWorld::fallbackReport().
  std::vector<std::string> cpuShares = {};
  // Few bodies, each of which comes to rest by itself, on one of its sides, in one of the hollows: the mean of their
  // heights may differ as means of so many independent ones do, and rare events are few enough for chance to count.
  bool scattered = false;
};

// How `btgpu bench` runs a scene, unless told otherwise.
struct Benchmark {
  Size size;
  int steps;  // the second half is measured
  // The size with about so many bodies; null where the scene has no room to grow.
  std::function<Size(int bodies)> sizeFor;
};

struct Scene {
  std::string name, description;
  Size size;  // default; `btgpu compare` takes seconds
  int steps;  // default
  double timeStep;
  Expectations expectations;
  std::function<void(Objects&, Size)> build;
  Benchmark benchmark;
};

// What the tests go through, scene by scene.
const std::vector<Scene>& all();
// The scenes that others measure their engines with, and larger ones. Tests go through them once, at small sizes.
const std::vector<Scene>& big();
// A rain of each shape that the device has on each ground, and the same thrown over it: rain_cone_on_mesh,
// roll_cone_on_mesh.
const std::vector<Scene>& ofShapes();
std::vector<std::string> shapeNames();   // what comes first in such a name
std::vector<std::string> groundNames();  // and what after `on`
// In one of the lists; underscores may be left out. Null if there is none of that name.
const Scene* find(const std::string& name);

}  // namespace scenes
