// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A world that a random walk over Bullet's API goes through. Walkers that are given the same operations do the same to
// their worlds, whatever becomes of the bodies in them: an operation chooses by what was put in, never by where it is.
#pragma once

#include <BulletCollision/CollisionDispatch/btGhostObject.h>

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "compat/btGpuDynamicsWorld.h"
#include "samples/scenes/scene.h"
#include "tests/convex/shape_kinds.h"

namespace btgpu::test {

struct Operation {
  int kind;            // of operationKinds()
  std::uint32_t seed;  // of all that it chooses
  int index;           // in the walk that it was made for
};

// A shape with what it is made of; goes with the last object that has it.
struct WalkShape {
  ShapeStore store;
  btCollisionShape* shape = nullptr;
  btCompoundShape* compound = nullptr;  // it, if it is one that may be edited
  bool movable = true;
  std::string name;
  std::vector<std::shared_ptr<WalkShape>> parts;
};

struct WalkMotionState : btMotionState {
  void getWorldTransform(btTransform& t) const override { t = transform; }
  void setWorldTransform(const btTransform& t) override { transform = t; }
  btTransform transform = btTransform::getIdentity();
};

enum class WalkKind { Dynamic, Static, Kinematic, Ghost, Plain };

struct WalkObject {
  int id = 0;
  WalkKind kind = WalkKind::Dynamic;
  bool inWorld = false;
  int group = 0, mask = 0;
  std::shared_ptr<WalkShape> shape;
  std::unique_ptr<WalkMotionState> motionState;
  std::unique_ptr<btCollisionObject> object;
  btRigidBody* body() const { return btRigidBody::upcast(object.get()); }
};

struct WalkJoint {
  int id = 0, a = 0, b = 0;  // b: 0 for the world
  bool inWorld = false, apart = false;
  std::unique_ptr<btJointFeedback> feedback;
  btTypedConstraint* joint = nullptr;
};

// How often the application has been called; for one that is called after it has asked not to be.
struct WalkCalls {
  long added = 0, processed = 0, destroyed = 0, started = 0, ended = 0, ticks = 0, actions = 0, filters = 0;
};

class Walker {
 public:
  using Objects = std::map<int, WalkObject>;
  using Joints = std::map<int, WalkJoint>;
  enum class Broadphase { Dbvt, AxisSweep };

  // `gpu`: null for stock's world.
  Walker(const btGpuSettings* gpu, Broadphase broadphase);
  ~Walker();
  Walker(const Walker&) = delete;
  Walker& operator=(const Walker&) = delete;

  // Does it and the steps that belong to it; what it did, in words.
  std::string apply(const Operation& operation);
  void step(double time, int maxSubSteps = 0, double fixedTimeStep = 1.0 / 60);

  btDiscreteDynamicsWorld& world() { return *m_world; }
  btGpuDynamicsWorld* gpu() { return m_gpu; }
  btCollisionDispatcher& dispatcher() { return m_dispatcher; }
  Objects& objects() { return m_objects; }
  Joints& joints() { return m_joints; }
  const btGpuSettings& settings() const { return m_settings; }
  void configure(const btGpuSettings& settings);
  WalkCalls& calls() { return m_calls; }
  bool& stepsLater() { return m_stepsLater; }   // the operation has stepped itself
  std::string& problem() { return m_problem; }  // that an operation has found

  // ---- what operations are made of
  WalkObject& makeObject(WalkKind kind, std::shared_ptr<WalkShape> shape, const btTransform& at, btScalar mass);
  void add(WalkObject& object);
  void remove(WalkObject& object);  // with its joints
  void destroy(int id);             // with its shape, if no other has it
  WalkJoint& takeJoint(btTypedConstraint* joint, int a, int b);
  void removeJoint(int id);
  scenes::Objects& jointOwner() { return *m_jointOwner; }
  // What is called once in the next tick, before or after the step.
  std::function<void(Walker&)> beforeStep, afterStep;
  std::vector<std::unique_ptr<btActionInterface>>& actions() { return m_actions; }
  std::unique_ptr<btOverlapFilterCallback> filter;

  // Whose callbacks are called now.
  static Walker* current;

 private:
  static void preTick(btDynamicsWorld* world, btScalar);
  static void tick(btDynamicsWorld* world, btScalar);

  btDefaultCollisionConfiguration m_configuration;
  btCollisionDispatcher m_dispatcher;
  std::unique_ptr<btBroadphaseInterface> m_broadphase;
  btGhostPairCallback m_ghostPairs;
  btSequentialImpulseConstraintSolver m_solver;
  std::unique_ptr<btDiscreteDynamicsWorld> m_world;
  btGpuDynamicsWorld* m_gpu = nullptr;
  btGpuSettings m_settings;
  std::unique_ptr<scenes::Objects> m_jointOwner;
  std::vector<std::unique_ptr<btActionInterface>> m_actions;
  Objects m_objects;
  Joints m_joints;
  int m_nextId = 1;
  WalkCalls m_calls;
  bool m_stepsLater = false;
  std::string m_problem;
};

struct OperationKind {
  const char* name;
  int weight;
  // What it did, in words, the same in all walkers.
  std::function<std::string(Walker&, RandomSource&)> apply;
};
const std::vector<OperationKind>& operationKinds();

// `count` operations, the first ones adding bodies.
std::vector<Operation> makeWalk(std::uint32_t seed, int count);

// Shapes of all kinds: convex, concave, compound, of the host. Null if `which` is beyond the last.
std::shared_ptr<WalkShape> makeWalkShape(int which, RandomSource& random);
int walkShapeCount();
const std::vector<ShapeKind>& walkConvexKinds();  // the first of them

// Not zero, as Bullet has it for triangles: rolling friction of what can't turn is NaN in stock.
btVector3 inertiaOf(const btCollisionShape& shape, btScalar mass);

// Sets back what is the process's, not a world's: callbacks and the like.
void resetGlobals();

}  // namespace btgpu::test
