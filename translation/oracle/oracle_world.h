// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "../../gpu_engine/step_results.h"
#include "../../gpu_engine/world_input.h"
#include "../bullet.h"

BTGPU_TRANSLATION_BEGIN

// State of one body that a step starts from.
struct BodyState {
  btTransform transform = btTransform::getIdentity(), interpolation = btTransform::getIdentity();
  btVector3 linear{0, 0, 0}, angular{0, 0, 0}, interpolationLinear{0, 0, 0}, interpolationAngular{0, 0, 0};
  int activation = ISLAND_SLEEPING;
  btScalar deactivationTime = 0;
};

BodyState captureState(const btCollisionObject& object);
// What the application moves is where its motion states and callbacks put it in the step itself: `states` of the time
// before get that of kinematic bodies from what the device was given.
void takeKinematicStates(const btCollisionWorld& world, const WorldInput& input, std::vector<BodyState>& states);

// What of a joint lives from step to step, and what its motors are told to do.
struct JointState {
  bool enabled;
  btScalar accumulatedAngle;     // of a btHingeAccumulatedAngleConstraint
  std::vector<btScalar> motors;  // joint_motors.h
};

std::vector<JointState> captureJoints(const btDynamicsWorld& world);
// Motors get their targets in callbacks of the step itself: `states` of the time before get those of the time after.
void takeMotors(const btDynamicsWorld& world, std::vector<JointState>& states);

struct Velocity {
  btVector3 linear, angular;
};

class OracleWorld;

// Asks the world which pairs it leaves out, of the narrowphase or of sweeps.
class OracleDispatcher : public btCollisionDispatcher {
 public:
  OracleDispatcher(btCollisionConfiguration* configuration, const OracleWorld& world)
      : btCollisionDispatcher(configuration), m_world(world) {}
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override;

 private:
  const OracleWorld& m_world;
};

// Finds exactly the pairs whose boxes overlap, as btgpu and Bullet's other broadphases do; islands are merged over
// them. Bullet's own grows moving boxes by a margin, which is a global of the process.
class TightBroadphase : public btDbvtBroadphase {
 public:
  TightBroadphase() { m_cupdates = 100; }  // pairs that don't overlap any more go at once, not a percentage a step
  void setAabb(btBroadphaseProxy* proxy, const btVector3& lower, const btVector3& upper,
               btDispatcher* dispatcher) override;
};

// What a world needs and does not own.
struct OracleParts {
  explicit OracleParts(const OracleWorld& world) : dispatcher(&configuration, world) {}
  btDefaultCollisionConfiguration configuration;
  OracleDispatcher dispatcher;
  TightBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
};

// A stock world whose step is taken apart, so that each half can be given btgpu's own inputs: the state before the
// step and the manifold cache to the narrowphase, btgpu's contacts to the solver. Objects go by the device's slots.
class OracleWorld : private OracleParts, public btDiscreteDynamicsWorld {
 public:
  OracleWorld() : OracleParts(*this), btDiscreteDynamicsWorld(&dispatcher, &broadphase, &solver, &configuration) {}
  ~OracleWorld() override { releaseLoose(); }

  // The object of each slot, all in the world; null for a free slot.
  void setObjects(std::vector<btCollisionObject*> bySlot);
  size_t slotCount() const { return m_objects.size(); }
  btCollisionObject* object(size_t slot) const { return m_objects[slot]; }
  btRigidBody* body(size_t slot) const {  // null if there is none
    return slot < m_objects.size() && m_objects[slot] ? btRigidBody::upcast(m_objects[slot]) : nullptr;
  }
  uint slotOf(const btCollisionObject& object) const;  // NO_INDEX: not in the world

  // True for pairs that this world's narrowphase does not look at.
  virtual bool leavesOut(const btCollisionObject&, const btCollisionObject&) const { return false; }
  // True for pairs that must not collide and keep the contacts that they have. Of a pair that it has not seen collide
  // this world has none.
  virtual bool ignores(uint, uint) const { return false; }
  // True for pairs of which the one that is fast passes through the other.
  virtual bool passes(const btCollisionObject&, const btCollisionObject&) const { return false; }

  // Sets all bodies to `states` and the contact cache to `cache`: manifolds of the step before, of slots as
  // Engine::readManifolds has them. `input` tells which slots are shapes of compounds.
  void setState(const std::vector<BodyState>& states, const std::vector<Manifold>& cache, const WorldInput& input);
  // Stock's step up to the contacts.
  void findContacts(btScalar timeStep);
  // Makes `contacts` the dispatcher's contacts, so that the solver works on the very same ones as btgpu's. Those behind
  // the first `ofPairs` come from the host and may be several a pair, as those of compounds: each gets a manifold of
  // its own, until the next call. So do those of pairs that this world has not, or ignores, for which Bullet's
  // algorithms make none; if only those of this world's are wanted, they are left out.
  void replaceContacts(const std::vector<Manifold>& contacts, size_t ofPairs, bool ofThisWorldsOnly = false);
  // The manifold that holds contacts[i] of the last replaceContacts(); null if it has no points.
  const btPersistentManifold* replaced(size_t i) const { return m_replaced[i]; }
  // The bodies of a manifold with points, each with the number of its compound's shape that they name, or -1. Points on
  // triangles don't name the mesh: all meshes of a compound have this number.
  static constexpr int kMeshes = -2;
  using ShapePair = std::tuple<uint, int, uint, int>;
  ShapePair shapesOf(const btPersistentManifold& manifold) const;
  // The same number, of a slot.
  static int shapeNumber(const WorldInput& input, uint slot);
  // Of the last setState: false for two shapes of compounds, in either order, whose cache could not be filled, since
  // stock finds no new contact of theirs. Whether they keep the old one can't be told.
  bool isFilled(const ShapePair& shapes) const {
    const auto [a, childA, b, childB] = shapes;
    return m_notFilled.count(shapes) == 0 && m_notFilled.count({b, childB, a, childA}) == 0;
  }
  // Turns the order of the dispatcher's manifolds round, and with it the order of the solver's rows.
  void reverseContacts();
  // Islands and solver, as in stock's step; `iterations` < 0: the world's own number.
  void solve(btScalar timeStep, int iterations = -1);
  // The rest of stock's step, with the sweeps of fast bodies.
  void finish(btScalar timeStep);

  // By slot, as all lists of states and velocities.
  std::vector<BodyState> states() const;
  std::vector<Velocity> velocities() const;
  // Sets the joints, which are those of btgpu's world in the same order.
  void setJoints(const std::vector<JointState>& states);
  // Turns the order of the joints round, and with it the order of their rows.
  void reverseJoints();
  // Undoes solve(): everything that the solver and the islands changed.
  void restore(const std::vector<BodyState>& states);

 protected:
  // Gives the bodies the forces that they start the step with.
  virtual void setForces();
  btDbvtBroadphase& pairFinder() { return broadphase; }

 private:
  // Shapes of nested compounds may share a number.
  using ShapeManifolds = std::multimap<ShapePair, btPersistentManifold*>;
  ShapeManifolds findShapeManifolds();
  bool hasCompound(const Manifold& m) const;
  void releaseLoose();

  friend class OracleDispatcher;
  bool m_sweeps = false;  // the step is past the narrowphase
  std::set<ShapePair> m_notFilled;
  std::vector<btCollisionObject*> m_objects;
  std::vector<uint> m_slots;  // by the objects' position in the world
  std::vector<btPersistentManifold*> m_loose, m_replaced;
};

BTGPU_TRANSLATION_END
