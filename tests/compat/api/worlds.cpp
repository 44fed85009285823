// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btCollisionWorld, btDynamicsWorld, btDiscreteDynamicsWorld, island manager and ghost objects.
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletDynamics/ConstraintSolver/btNNCGConstraintSolver.h>
#include <BulletWorldImporter/btBulletWorldImporter.h>

#include "tests/compat/api/api_case.h"

namespace btgpu::test::api {
namespace {

// A ball above the ground, one on it, and a box beside them.
struct Few {
  btRigidBody *ground, *ball, *resting, *box;
};
Few few(Lab& w) {
  w.world.setGravity(vector(0, -10, 0));
  Few f{};
  f.ground = w.objects.add(0, w.objects.plane(vector(0, 1, 0), 0), vector(0, 0, 0));
  f.ball = w.objects.add(1, w.objects.sphere(scalar(0.5)), vector(0, 3, 0));
  f.ball->setLinearVelocity(vector(1, 0, 0.5));
  f.resting = w.objects.add(1, w.objects.sphere(scalar(0.5)), vector(3, 0.49, 0));
  f.box = w.objects.add(2, w.objects.box(vector(0.5, 0.4, 0.3)), vector(0, 5, 3));
  f.box->setAngularVelocity(vector(1, 2, 0));
  return f;
}

// Logs that it was called; pushes its body.
class Push : public btActionInterface {
 public:
  Push(Lab& lab, btRigidBody& body, const std::string& name) : w(lab), m_body(body), m_name(name) {}
  void updateAction(btCollisionWorld* world, btScalar timeStep) override {
    LOG(m_name);
    LOG(timeStep);
    LOG(world == &w.world);
    LOG_NEAR(m_body.getWorldTransform());
    m_body.applyCentralImpulse(vector(0, 0.5, 0));
  }
  void debugDraw(btIDebugDraw*) override { w.log.note(m_name + " is drawn"); }

 private:
  Lab& w;
  btRigidBody& m_body;
  std::string m_name;
};

struct AllContacts : btCollisionWorld::ContactResultCallback {
  explicit AllContacts(Lab& lab) : w(lab) {}
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int partA, int indexA,
                           const btCollisionObjectWrapper* b, int partB, int indexB) override {
    const std::pair<int, int> pair(w.number(a->getCollisionObject()), w.number(b->getCollisionObject()));
    m_found[pair].push_back({point, partA + indexA + partB + indexB});
    return 0;
  }
  // Pair by pair: objects come in the order of the broadphase's tree.
  void logAll() {
    for (const auto& [pair, points] : m_found) {
      LOG(pair.first);
      LOG(pair.second);
      for (const auto& [point, parts] : points) {
        LOG(parts);
        LOG_NEAR(point.getDistance());
        LOG_NEAR(point.m_normalWorldOnB);
      }
    }
    m_found.clear();
  }

 private:
  Lab& w;
  std::map<std::pair<int, int>, std::vector<std::pair<btManifoldPoint, int>>> m_found;
};

Lab* tickLab = nullptr;
void tick(btDynamicsWorld* world, btScalar timeStep) {
  Lab& w = *tickLab;
  w.log.note("tick");
  LOG(timeStep);
  LOG(world->getWorldUserInfo() == &w);
  w.logBodies("in the tick");
  w.logContacts("in the tick");
}
void preTick(btDynamicsWorld* world, btScalar timeStep) {
  Lab& w = *tickLab;
  w.log.note("tick before");
  LOG(timeStep);
  LOG(world->getWorldUserInfo() == &w);
  w.logBodies("before the tick");
}

class State : public btMotionState {
 public:
  State(Lab& lab, const std::string& name, const btTransform& at) : w(lab), m_name(name), m_at(at) {}
  void getWorldTransform(btTransform& at) const override { at = m_at; }
  void setWorldTransform(const btTransform& at) override {
    LOG(m_name);
    LOG_NEAR(at);
  }

 private:
  Lab& w;
  std::string m_name;
  btTransform m_at;
};

struct Islands : btSimulationIslandManager::IslandCallback {
  explicit Islands(Lab& lab) : w(lab) {}
  void processIsland(btCollisionObject** bodies, int count, btPersistentManifold**, int manifolds, int) override {
    LOG(count);
    LOG(manifolds);
    for (int i = 0; i < count; ++i) LOG(w.number(bodies[i]));
  }
  Lab& w;
};

btTransform at(double x, double y, double z) { return btTransform(btQuaternion::getIdentity(), vector(x, y, z)); }

}  // namespace

// ---- what a world is, and its parts

API_CASE(World, Parts, OnDevice()) {
  few(w);
  const btDiscreteDynamicsWorld& read = w.world;
  LOG(static_cast<btCollisionWorld*>(&w.world) != nullptr);
  LOG(static_cast<btDynamicsWorld*>(&w.world) == &w.world);
  LOG(w.world.getWorldType());
  LOG(w.world.getWorldType() == BT_DISCRETE_DYNAMICS_WORLD);
  LOG(w.world.getBroadphase() == &w.broadphase);
  LOG(read.getBroadphase() == &w.broadphase);
  LOG(w.world.getPairCache() == w.broadphase.getOverlappingPairCache());
  LOG(w.world.getDispatcher() == &w.dispatcher);
  LOG(read.getDispatcher() == &w.dispatcher);
  LOG(w.world.getConstraintSolver() == &w.solver);
  LOG(w.world.getCollisionWorld() == &w.world);
  LOG(w.world.getSimulationIslandManager() == read.getSimulationIslandManager());
  LOG(&w.world.getDispatchInfo() == &read.getDispatchInfo());
  LOG(&w.world.getSolverInfo() == &read.getSolverInfo());
  LOG(sizeof(btDiscreteDynamicsWorld));
  w.world.setBroadphase(&w.broadphase);
  w.world.setNumTasks(4);
  w.step(2);
}

API_CASE(World, Gravity, OnDevice()) {
  const Few f = few(w);
  LOG(w.world.getGravity());
  w.step();
  w.world.setGravity(vector(2, 3, 1));
  LOG(w.world.getGravity());
  LOG(f.ball->getGravity());
  LOG(f.ground->getGravity());
  w.step();
  w.logBodies("gravity changed");
  btRigidBody* late = w.objects.add(1, w.objects.sphere(1), vector(9, 9, 0));
  LOG(late->getGravity());
  w.step();
}

API_CASE(World, ForcesAndGravity, OnDevice()) {
  const Few f = few(w);
  f.ball->applyCentralForce(vector(5, 0, 0));
  w.world.applyGravity();
  LOG(f.ball->getTotalForce());
  LOG(f.ground->getTotalForce());
  w.world.clearForces();
  LOG(f.ball->getTotalForce());
  w.step();
  f.ball->applyCentralForce(vector(5, 0, 0));
  w.step();
  LOG(f.ball->getTotalForce());
}

// ---- stepSimulation and motion states

API_CASE(World, StepSimulation, OnDevice()) {
  few(w);
  for (const auto& [time, most, fixed] : std::vector<std::tuple<double, int, double>>{{0.05, 4, 1.0 / 60},
                                                                                      {0.01, 1, 1.0 / 60},
                                                                                      {0.01, 2, 1.0 / 60},
                                                                                      {1.0 / 120, 0, 1.0 / 60},
                                                                                      {0.2, 2, 1.0 / 60},
                                                                                      {0, 1, 1.0 / 60},
                                                                                      {1.0 / 60, 1, 1.0 / 120}}) {
    const int done = w.world.stepSimulation(scalar(time), most, scalar(fixed));
    w.log.steps += std::max(done, 0);
    LOG(done);
    w.logBodies("after a call");
  }
}

API_CASE(World, MotionStates, OnDevice()) {
  const Few f = few(w);
  f.ball->setMotionState(w.keep<State>(w, "ball", at(0, 3, 0)));
  f.box->setMotionState(w.keep<State>(w, "box", at(0, 5, 3)));
  f.ground->setMotionState(w.keep<State>(w, "ground", at(0, 0, 0)));
  for (int i = 0; i < 2; ++i) {
    w.log.steps += 2;  // at most
    LOG(w.world.stepSimulation(scalar(0.025), 3, scalar(1.0 / 60)));
  }
  w.log.note("by hand");
  w.world.synchronizeMotionStates();
  w.world.synchronizeSingleMotionState(f.box);
  LOG(w.world.getLatencyMotionStateInterpolation());
  w.world.setLatencyMotionStateInterpolation(false);
  LOG(w.world.getLatencyMotionStateInterpolation());
  w.log.steps += 2;  // at most
  LOG(w.world.stepSimulation(scalar(0.025), 3, scalar(1.0 / 60)));
  LOG(w.world.getSynchronizeAllMotionStates());
  w.world.setSynchronizeAllMotionStates(true);
  LOG(w.world.getSynchronizeAllMotionStates());
  w.log.note("all of them");
  w.log.steps += 2;  // at most
  LOG(w.world.stepSimulation(scalar(0.025), 3, scalar(1.0 / 60)));
  for (btRigidBody* body : {f.ball, f.box, f.ground}) body->setMotionState(nullptr);
}

API_CASE(World, TickCallbacks, OnDevice()) {
  few(w);
  tickLab = &w;
  w.world.setInternalTickCallback(tick, &w);
  LOG(w.world.getWorldUserInfo() == &w);
  w.log.steps = 3;  // by the last tick
  LOG(w.world.stepSimulation(scalar(0.0501), 4, scalar(1.0 / 60)));
  w.world.setInternalTickCallback(preTick, &w, true);
  w.log.steps = 6;
  LOG(w.world.stepSimulation(scalar(0.05), 4, scalar(1.0 / 60)));
  w.world.setInternalTickCallback(nullptr);
  LOG(w.world.getWorldUserInfo() == nullptr);
  w.world.setWorldUserInfo(&w);
  LOG(w.world.getWorldUserInfo() == &w);
  w.step();
  w.world.setInternalTickCallback(nullptr, nullptr, true);
}

// ---- actions, by all their names

API_CASE(World, Actions, Shares("actions")) {
  const Few f = few(w);
  Push action(w, *f.ball, "action"), vehicle(w, *f.box, "vehicle"), character(w, *f.resting, "character");
  w.world.addVehicle(&vehicle);
  w.world.addCharacter(&character);
  w.world.addAction(&action);
  w.step(2);
  w.log.note("by hand");
  w.world.updateVehicles(scalar(1.0 / 60));
  w.world.removeVehicle(&vehicle);
  w.step();
  w.world.removeCharacter(&character);
  w.step();
  w.world.removeAction(&action);
  w.log.note("none");
  w.step();
}

// ---- bodies, objects, joints

API_CASE(World, RigidBodies, OnDevice()) {
  const Few f = few(w);
  LOG(w.world.getNumCollisionObjects());
  LOG(w.world.getNonStaticRigidBodies().size());
  LOG(static_cast<const btDiscreteDynamicsWorld&>(w.world).getNonStaticRigidBodies().size());
  w.step();
  w.world.removeRigidBody(f.ball);
  LOG(f.ball->getWorldArrayIndex());
  LOG(w.number(f.box));
  w.step();
  w.world.addRigidBody(f.ball);
  LOG(w.number(f.ball));
  w.step();
  w.world.removeRigidBody(f.resting);
  w.world.addRigidBody(f.resting, btBroadphaseProxy::DebrisFilter, btBroadphaseProxy::DefaultFilter);
  LOG(f.resting->getBroadphaseHandle()->m_collisionFilterGroup);
  LOG(f.resting->getBroadphaseHandle()->m_collisionFilterMask);
  w.step(2);  // through the ground
  w.logContacts("then");
}

API_CASE(World, CollisionObjects, OnDevice()) {
  const Few f = few(w);
  btCollisionObject wall;
  wall.setCollisionShape(w.objects.box(vector(0.2, 3, 3)));
  wall.setWorldTransform(at(0.75, 3, 0));
  w.world.addCollisionObject(&wall);
  LOG(wall.getBroadphaseHandle()->m_collisionFilterGroup);
  LOG(wall.getBroadphaseHandle()->m_collisionFilterMask);
  LOG(w.world.getCollisionObjectArray().size());
  LOG(static_cast<const btDiscreteDynamicsWorld&>(w.world).getCollisionObjectArray().size());
  w.step(3);
  w.logContacts("at the wall");
  wall.setWorldTransform(at(0, 0.2, 0));
  w.world.refreshBroadphaseProxy(&wall);
  w.step();
  w.world.removeCollisionObject(&wall);
  w.world.addCollisionObject(&wall, btBroadphaseProxy::SensorTrigger, btBroadphaseProxy::CharacterFilter);
  w.step();
  w.world.removeCollisionObject(&wall);
  w.world.removeCollisionObject(f.box);  // a rigid body: as removeRigidBody
  LOG(w.world.getNonStaticRigidBodies().size());
  w.step();
}

API_CASE(World, Filters, OnDevice()) {
  w.world.setGravity(vector(0, -10, 0));
  btRigidBody* ground = w.objects.add(0, w.objects.plane(vector(0, 1, 0), 0), vector(0, 0, 0));
  LOG(ground->getBroadphaseHandle()->m_collisionFilterGroup);
  LOG(ground->getBroadphaseHandle()->m_collisionFilterMask);
  btCollisionShape* ball = w.objects.sphere(scalar(0.5));
  const int all = btBroadphaseProxy::AllFilter;
  int place = 0;
  for (const auto& [group, mask] :
       std::vector<std::pair<int, int>>{{btBroadphaseProxy::DefaultFilter, all},
                                        {btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::StaticFilter},
                                        {btBroadphaseProxy::KinematicFilter, all},
                                        {btBroadphaseProxy::DebrisFilter, btBroadphaseProxy::DefaultFilter},
                                        {btBroadphaseProxy::SensorTrigger, all ^ btBroadphaseProxy::StaticFilter},
                                        {btBroadphaseProxy::CharacterFilter, btBroadphaseProxy::StaticFilter}}) {
    btRigidBody* body = w.objects.add(1, ball, vector(0, 0.49, 3 * place++));
    w.world.removeRigidBody(body);
    w.world.addRigidBody(body, group, mask);
  }
  w.step(3);
  w.logContacts("then");
}

API_CASE(World, Joints, Shares("joints")) {
  const Few f = few(w);
  btPoint2PointConstraint one(*f.ball, vector(0, 0.5, 0)), two(*f.ball, *f.box, vector(0, -0.5, 0), vector(0, 0.4, 0));
  w.world.addConstraint(&one);
  w.world.addConstraint(&two, true);
  LOG(w.world.getNumConstraints());
  LOG(w.world.getConstraint(1) == &two);
  LOG(static_cast<const btDiscreteDynamicsWorld&>(w.world).getConstraint(0) == &one);
  LOG(f.ball->getNumConstraintRefs());
  LOG(f.ball->checkCollideWith(f.box));
  w.step(2);
  w.world.removeConstraint(&one);
  LOG(w.world.getNumConstraints());
  w.step();
  w.world.removeConstraint(&two);
  LOG(f.ball->checkCollideWith(f.box));
  w.step();
}

API_CASE(World, OtherSolver, StockPath("constraint solver")) {
  few(w);
  auto* other = w.keep<btNNCGConstraintSolver>();
  w.world.setConstraintSolver(other);
  LOG(w.world.getConstraintSolver() == other);
  w.step(3);
  w.world.setConstraintSolver(&w.solver);
}

// A class's own call for its bodies and manifolds, outside a step: stock's solver on the host's state.
API_CASE(World, SolveConstraints, OnDevice()) {
  const Few f = few(w);
  w.step(2);
  w.log.note("by hand");
  btSimulationIslandManager& islands = *w.world.getSimulationIslandManager();
  islands.updateActivationState(&w.world, &w.dispatcher);
  islands.storeIslandActivationState(&w.world);
  LOG(f.ball->getIslandTag() >= 0);
  w.world.solveConstraints(w.world.getSolverInfo());
  LOG(f.ground->getActivationState());
}

API_CASE(World, SpeculativeRestitution, Shares("continuous collision detection (CCD)")) {
  const Few f = few(w);
  f.ball->setRestitution(1);
  f.ground->setRestitution(1);
  f.ball->setCcdMotionThreshold(scalar(0.1));
  f.ball->setCcdSweptSphereRadius(scalar(0.4));
  f.ball->setLinearVelocity(vector(0, -40, 0));
  f.ball->setWorldTransform(at(0, 0.9, 0));
  w.start();
  LOG(w.world.getApplySpeculativeContactRestitution());
  w.probe("without");
  w.world.setApplySpeculativeContactRestitution(true);
  LOG(w.world.getApplySpeculativeContactRestitution());
  w.probe("setApplySpeculativeContactRestitution");
}

// ---- collision detection by hand

API_CASE(CollisionWorld, Aabbs, OnDevice()) {
  const Few f = few(w);
  btCollisionObject still;
  still.setCollisionShape(w.objects.box(vector(1, 1, 1)));
  still.setWorldTransform(at(20, 0, 0));
  w.world.addCollisionObject(&still);
  LOG(w.world.getForceUpdateAllAabbs());
  const auto logAabbs = [&w, &still, &f](const std::string& when) {
    for (const btCollisionObject* o :
         {static_cast<const btCollisionObject*>(&still), static_cast<const btCollisionObject*>(f.resting)}) {
      w.log.near(when, o->getBroadphaseHandle()->m_aabbMin);
      w.log.near(when, o->getBroadphaseHandle()->m_aabbMax);
    }
    w.log.exact(when, w.world.getPairCache()->getNumOverlappingPairs());
  };
  logAabbs("as added");
  still.setWorldTransform(at(3, 0, 0));
  f.resting->setActivationState(ISLAND_SLEEPING);
  w.world.setForceUpdateAllAabbs(false);
  LOG(w.world.getForceUpdateAllAabbs());
  w.world.updateAabbs();
  logAabbs("updateAabbs of active ones");
  w.world.setForceUpdateAllAabbs(true);
  w.world.updateAabbs();
  logAabbs("updateAabbs");
  still.setWorldTransform(at(-20, 0, 0));
  w.world.updateSingleAabb(&still);
  w.world.computeOverlappingPairs();
  logAabbs("updateSingleAabb");
  w.step(2);
  logAabbs("after steps");
  w.world.removeCollisionObject(&still);
}

API_CASE(CollisionWorld, DiscreteDetection, OnDevice()) {
  few(w);
  w.world.performDiscreteCollisionDetection();
  w.logContacts("by hand");
  w.step();
  w.logContacts("after a step", false);  // contacts found by hand are found anew by the device's first step
  w.world.performDiscreteCollisionDetection();
  w.logContacts("by hand", false);
}

API_CASE(CollisionWorld, Rays, OnDevice()) {
  const Few f = few(w);
  w.step(2);
  const btVector3 from = vector(3, 9, 0), to = vector(3.1, -9, 0);
  btCollisionWorld::ClosestRayResultCallback closest(from, to);
  LOG(closest.m_rayFromWorld);
  LOG(closest.m_rayToWorld);
  LOG(closest.m_flags);
  w.world.rayTest(from, to, closest);
  LOG(closest.hasHit());
  LOG(w.number(closest.m_collisionObject));
  LOG_NEAR(closest.m_closestHitFraction);
  LOG_NEAR(closest.m_hitPointWorld);
  LOG_NEAR(closest.m_hitNormalWorld);
  btCollisionWorld::AllHitsRayResultCallback all(from, to);
  w.world.rayTest(from, to, all);
  LOG(all.m_collisionObjects.size());
  std::map<int, int> byNumber;  // they come in the order of the broadphase's tree
  for (int i = 0; i < all.m_collisionObjects.size(); ++i) byNumber[w.number(all.m_collisionObjects[i])] = i;
  for (const auto& [number, i] : byNumber) {
    LOG(number);
    LOG_NEAR(all.m_hitFractions[i]);
    LOG_NEAR(all.m_hitPointWorld[i]);
    LOG_NEAR(all.m_hitNormalWorld[i]);
  }
  LOG(all.m_rayFromWorld);
  LOG(all.m_rayToWorld);
  btCollisionWorld::ClosestRayResultCallback picky(from, to);
  picky.m_collisionFilterGroup = btBroadphaseProxy::DebrisFilter;
  picky.m_collisionFilterMask = btBroadphaseProxy::StaticFilter;
  LOG(picky.needsCollision(f.ground->getBroadphaseHandle()));
  LOG(picky.needsCollision(f.ball->getBroadphaseHandle()));
  w.world.rayTest(from, to, picky);
  LOG(w.number(picky.m_collisionObject));
  btCollisionWorld::ClosestRayResultCallback single(from, to), inner(from, to);
  btCollisionWorld::rayTestSingle(at(3, 9, 0), at(3.1, -9, 0), f.resting, f.resting->getCollisionShape(),
                                  f.resting->getWorldTransform(), single);
  LOG_NEAR(single.m_closestHitFraction);
  const btCollisionObjectWrapper wrapper(nullptr, f.resting->getCollisionShape(), f.resting,
                                         f.resting->getWorldTransform(), -1, -1);
  btCollisionWorld::rayTestSingleInternal(at(3, 9, 0), at(3.1, -9, 0), &wrapper, inner);
  LOG_NEAR(inner.m_closestHitFraction);
  // What a callback is told.
  btCollisionWorld::LocalShapeInfo info{};
  info.m_shapePart = 1;
  info.m_triangleIndex = 2;
  btCollisionWorld::LocalRayResult result(f.resting, &info, vector(0, 1, 0), scalar(0.25));
  LOG(result.m_collisionObject == f.resting && result.m_localShapeInfo == &info);
  LOG(result.m_hitNormalLocal);
  LOG(result.m_hitFraction);
  struct Any : btCollisionWorld::RayResultCallback {
    btScalar addSingleResult(btCollisionWorld::LocalRayResult& r, bool) override { return r.m_hitFraction; }
  } any;
  LOG(static_cast<btCollisionWorld::RayResultCallback&>(any).addSingleResult(result, true));
}

API_CASE(CollisionWorld, Sweeps, OnDevice()) {
  const Few f = few(w);
  w.step(2);
  btSphereShape probe(scalar(0.3));
  btCollisionWorld::ClosestConvexResultCallback closest(vector(3.2, 9, 0), vector(3.2, -9, 0));
  LOG(closest.m_convexFromWorld);
  LOG(closest.m_convexToWorld);
  w.world.convexSweepTest(&probe, at(3.2, 9, 0), at(3.2, -9, 0), closest);
  LOG(closest.hasHit());
  LOG(w.number(closest.m_hitCollisionObject));
  // A sweep ends within 0.001 of the surface, by steps whose number may depend on a rounding.
  w.log.near("fraction", closest.m_closestHitFraction, 60);
  w.log.near("point", closest.m_hitPointWorld, 60);
  w.log.near("normal", closest.m_hitNormalWorld, 60);
  btCollisionWorld::ClosestConvexResultCallback picky(vector(3.2, 9, 0), vector(3.2, -9, 0));
  picky.m_collisionFilterGroup = btBroadphaseProxy::DebrisFilter;
  picky.m_collisionFilterMask = btBroadphaseProxy::StaticFilter;
  LOG(picky.needsCollision(f.ground->getBroadphaseHandle()));
  LOG(picky.needsCollision(f.resting->getBroadphaseHandle()));
  btCollisionWorld::ClosestConvexResultCallback single(vector(3.2, 9, 0), vector(3.2, -9, 0)), inner(single);
  btCollisionWorld::objectQuerySingle(&probe, at(3.2, 9, 0), at(3.2, -9, 0), f.resting, f.resting->getCollisionShape(),
                                      f.resting->getWorldTransform(), single, 0);
  w.log.near("fraction", single.m_closestHitFraction, 60);
  const btCollisionObjectWrapper wrapper(nullptr, f.resting->getCollisionShape(), f.resting,
                                         f.resting->getWorldTransform(), -1, -1);
  btCollisionWorld::objectQuerySingleInternal(&probe, at(3.2, 9, 0), at(3.2, -9, 0), &wrapper, inner, 0);
  w.log.near("fraction", inner.m_closestHitFraction, 60);
  btCollisionWorld::LocalConvexResult result(f.resting, nullptr, vector(0, 1, 0), vector(3, 1, 0), scalar(0.5));
  LOG(result.m_hitCollisionObject == f.resting && result.m_localShapeInfo == nullptr);
  LOG(result.m_hitNormalLocal);
  LOG(result.m_hitPointLocal);
  LOG(result.m_hitFraction);
  struct Any : btCollisionWorld::ConvexResultCallback {
    btScalar addSingleResult(btCollisionWorld::LocalConvexResult& r, bool) override { return r.m_hitFraction; }
  } any;
  LOG(static_cast<btCollisionWorld::ConvexResultCallback&>(any).addSingleResult(result, true));
}

API_CASE(CollisionWorld, ContactTests, OnDevice()) {
  const Few f = few(w);
  w.step(2);
  btSphereShape shape(scalar(0.6));
  btCollisionObject probe;
  probe.setCollisionShape(&shape);
  probe.setWorldTransform(at(3.8, 0.5, 0));
  AllContacts all(w);
  LOG(all.m_closestDistanceThreshold);
  w.world.contactTest(&probe, all);
  w.world.contactPairTest(f.ground, f.resting, all);
  w.world.contactPairTest(f.ball, f.box, all);
  all.logAll();
  all.m_collisionFilterMask = btBroadphaseProxy::StaticFilter;
  all.m_collisionFilterGroup = btBroadphaseProxy::DefaultFilter;
  LOG(all.needsCollision(f.ground->getBroadphaseHandle()));
  LOG(all.needsCollision(f.ball->getBroadphaseHandle()));
  w.log.note("static ones");
  w.world.contactTest(&probe, all);
  all.logAll();
  struct Near : btCollisionWorld::ContactResultCallback {
    int count = 0;
    btScalar addSingleResult(btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) override {
      ++count;
      return 0;
    }
  } near;
  near.m_closestDistanceThreshold = 1;
  w.world.contactPairTest(f.ground, f.resting, near);
  LOG(near.count);
  w.step();
}

// ---- serialization

// The same file but for the rounding of poses: before a step to the byte.
API_CASE(World, Serialized, Shares("joints")) {
  const Few f = few(w);
  w.objects.joint<btPoint2PointConstraint>(false, *f.ball, *f.box, vector(0, -0.5, 0), vector(0, 0.4, 0));
  const std::string file = serialized(w.world);
  LOG(file.size());
  LOG(hexOf(file.data(), std::min<size_t>(file.size(), 12)));
  btDefaultSerializer plain;
  w.world.btCollisionWorld::serialize(&plain);
  LOG(plain.getCurrentBufferSize());
  w.step();
  LOG(serialized(w.world).size());
}

// Stock's importer makes a world of it.
API_CASE(World, SerializedLoads, OnDevice()) {
  const Few f = few(w);
  w.step(3);
  std::string file = serialized(w.world);
  WorldOf<btDiscreteDynamicsWorld> loaded;
  btBulletWorldImporter importer(&loaded.world);
  LOG(importer.loadFileFromMemory(file.data(), static_cast<int>(file.size())));
  LOG(importer.getNumRigidBodies());
  LOG(loaded.world.getGravity());
  for (int i = 0; i < importer.getNumRigidBodies(); ++i) {
    const btRigidBody* body = btRigidBody::upcast(importer.getRigidBodyByIndex(i));
    LOG(body->getCollisionShape()->getShapeType());
    LOG(body->getInvMass());
    LOG_NEAR(body->getWorldTransform());
    LOG_NEAR(body->getLinearVelocity());
  }
  LOG(f.ball->isActive());
  importer.deleteAllData();
}

// ---- islands

API_CASE(IslandManager, ByHand, OnDevice()) {
  const Few f = few(w);
  w.step();
  btSimulationIslandManager own;
  own.initUnionFind(4);
  LOG(own.getUnionFind().getNumElements());
  LOG(own.getSplitIslands());
  w.world.performDiscreteCollisionDetection();
  own.updateActivationState(&w.world, &w.dispatcher);
  own.findUnions(&w.dispatcher, &w.world);
  own.storeIslandActivationState(&w.world);
  LOG(f.ball->getIslandTag());
  Islands islands(w);
  own.buildAndProcessIslands(&w.dispatcher, &w.world, &islands);
  own.updateActivationState(&w.world, &w.dispatcher);
  own.storeIslandActivationState(&w.world);
  own.buildIslands(&w.dispatcher, &w.world);
  own.processIslands(&w.dispatcher, &w.world, &islands);
  w.step();
}

API_CASE(IslandManager, NotSplit, OnDevice()) {
  few(w);
  w.world.getSimulationIslandManager()->setSplitIslands(false);
  LOG(w.world.getSimulationIslandManager()->getSplitIslands());
  w.step(3);
}

// ---- ghosts

API_CASE(Ghost, Overlaps, OnDevice()) {
  const Few f = few(w);
  w.broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(w.keep<btGhostPairCallback>());
  btSphereShape shape(1);
  btGhostObject ghost;
  LOG(ghost.getInternalType() == btCollisionObject::CO_GHOST_OBJECT);
  ghost.setCollisionShape(&shape);
  ghost.setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
  ghost.setWorldTransform(at(0, 2.5, 0));
  w.world.addCollisionObject(&ghost, btBroadphaseProxy::SensorTrigger,
                             btBroadphaseProxy::AllFilter & ~btBroadphaseProxy::SensorTrigger);
  LOG(btGhostObject::upcast(static_cast<btCollisionObject*>(&ghost)) == &ghost);
  LOG(btGhostObject::upcast(static_cast<const btCollisionObject*>(f.ball)) == nullptr);
  for (int i = 0; i < 3; ++i) {
    w.step();
    const btGhostObject& read = ghost;
    LOG(ghost.getNumOverlappingObjects());
    LOG(ghost.getOverlappingPairs().size());
    LOG(read.getOverlappingPairs().size());
    std::vector<int> numbers;  // in the order in which the broadphase's tree gave them
    for (int k = 0; k < ghost.getNumOverlappingObjects(); ++k) {
      numbers.push_back(w.number(ghost.getOverlappingObject(k)));
      LOG(ghost.getOverlappingObject(k) == read.getOverlappingObject(k));
    }
    std::sort(numbers.begin(), numbers.end());
    for (const int number : numbers) LOG(number);
  }
  btCollisionWorld::ClosestRayResultCallback ray(vector(0, 9, 0), vector(0, -9, 0));
  ghost.rayTest(ray.m_rayFromWorld, ray.m_rayToWorld, ray);
  LOG(ray.hasHit());
  btSphereShape probe(scalar(0.2));
  btCollisionWorld::ClosestConvexResultCallback sweep(vector(0, 9, 0), vector(0, -9, 0));
  ghost.convexSweepTest(&probe, at(0, 9, 0), at(0, -9, 0), sweep);
  LOG(sweep.hasHit());
  ghost.removeOverlappingObjectInternal(f.ball->getBroadphaseHandle(), &w.dispatcher);
  LOG(ghost.getNumOverlappingObjects());
  ghost.addOverlappingObjectInternal(f.ball->getBroadphaseHandle());
  LOG(ghost.getNumOverlappingObjects());
  w.world.removeCollisionObject(&ghost);
}

API_CASE(Ghost, PairCaching, OnDevice()) {
  const Few f = few(w);
  w.broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(w.keep<btGhostPairCallback>());
  btSphereShape shape(1);
  btPairCachingGhostObject ghost;
  ghost.setCollisionShape(&shape);
  ghost.setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
  ghost.setWorldTransform(at(3, 1, 0));
  w.world.addCollisionObject(&ghost, btBroadphaseProxy::SensorTrigger, btBroadphaseProxy::AllFilter);
  w.step(2);
  LOG(ghost.getOverlappingPairCache()->getNumOverlappingPairs());
  ghost.removeOverlappingObjectInternal(f.resting->getBroadphaseHandle(), &w.dispatcher, ghost.getBroadphaseHandle());
  LOG(ghost.getOverlappingPairCache()->getNumOverlappingPairs());
  ghost.addOverlappingObjectInternal(f.resting->getBroadphaseHandle(), ghost.getBroadphaseHandle());
  LOG(ghost.getOverlappingPairCache()->getNumOverlappingPairs());
  w.world.removeCollisionObject(&ghost);
  w.step();
}

}  // namespace btgpu::test::api
