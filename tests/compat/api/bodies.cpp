// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btCollisionObject and btRigidBody.
#include "tests/compat/api/api_case.h"

namespace btgpu::test::api {
namespace {

// Balls on a plane that roll and slide, far from each other and alike, but for one thing each.
struct Alike {
  explicit Alike(Lab& lab, double height = 0.49) : w(lab), y(height) {
    w.world.setGravity(vector(0, -10, 0));
    ground = w.objects.add(0, w.objects.plane(vector(0, 1, 0), 0), vector(0, 0, 0));
    ball = w.objects.sphere(scalar(0.5));
    add("the first");
  }
  btRigidBody* add(const std::string& name) {
    // All at the same place along x, where their numbers round alike.
    btRigidBody* body = w.objects.add(1, ball, vector(0, y, 4 * double(bodies.size())));
    body->setLinearVelocity(vector(2, -1.5, 0.5));
    body->setAngularVelocity(vector(1, 2, -1));
    bodies.push_back(body);
    names.push_back(name);
    return body;
  }
  void finish(int steps) {
    w.step(steps);
    w.logContacts("then");
    w.expectEachDiffers(bodies, names);
  }
  Lab& w;
  double y;
  btRigidBody* ground;
  btCollisionShape* ball;
  std::vector<btRigidBody*> bodies;
  std::vector<std::string> names;
};

// One free body that turns, and one beside it.
btRigidBody* freeBody(Lab& w) {
  w.world.setGravity(vector(0, -10, 0));
  btRigidBody* body = w.objects.add(2, w.objects.box(vector(0.3, 0.4, 0.5)), vector(0.1, 5, -0.2));
  body->setLinearVelocity(vector(1, -0.5, 0.3));
  body->setAngularVelocity(vector(0.5, 2, -1));
  w.objects.add(1, w.objects.sphere(scalar(0.5)), vector(5, 5, 0));
  w.start();
  return body;
}

}  // namespace

// ---- btCollisionObject: what it says of itself

API_CASE(CollisionObject, Kinds, OnDevice()) {
  btCollisionShape* shape = w.objects.box(vector(0.5, 0.5, 0.5));
  btCollisionObject plain;
  LOG(plain.getInternalType());
  LOG(plain.getInternalType() == btCollisionObject::CO_COLLISION_OBJECT);
  plain.setCollisionShape(shape);
  LOG(plain.getCollisionShape() == shape);
  LOG(static_cast<const btCollisionObject&>(plain).getCollisionShape() == shape);
  plain.setWorldTransform(turnedAt(vector(0, 1, 0)));
  w.world.addCollisionObject(&plain);
  btRigidBody* body = freeBody(w);
  LOG(body->getInternalType() == btCollisionObject::CO_RIGID_BODY);
  btRigidBody* fixed = w.objects.add(0, shape, vector(0, -3, 0));
  btRigidBody* moved = w.objects.addKinematic(shape, btTransform(btQuaternion::getIdentity(), vector(9, 0, 0)));
  for (const btCollisionObject* o :
       {static_cast<const btCollisionObject*>(body), static_cast<const btCollisionObject*>(fixed),
        static_cast<const btCollisionObject*>(moved), const_cast<const btCollisionObject*>(&plain)}) {
    LOG(o->isStaticObject());
    LOG(o->isKinematicObject());
    LOG(o->isStaticOrKinematicObject());
    LOG(o->hasContactResponse());
    LOG(o->mergesSimulationIslands());
    LOG(o->isActive());
    LOG(o->getCollisionFlags());
    LOG(o->getCollisionFlags() == btCollisionObject::CF_DYNAMIC_OBJECT);
    LOG(o->getCollisionFlags() & btCollisionObject::CF_STATIC_OBJECT);
    LOG(o->getCollisionFlags() & btCollisionObject::CF_KINEMATIC_OBJECT);
  }
  w.step(2);
  LOG(plain.getWorldArrayIndex());
  w.world.removeCollisionObject(&plain);
  LOG(plain.getWorldArrayIndex());
  plain.setWorldArrayIndex(-1);
}

// What is the application's own comes through steps as it was.
API_CASE(CollisionObject, UserData, OnDevice()) {
  btRigidBody* body = freeBody(w);
  int own = 0;
  body->setUserPointer(&own);
  body->setUserIndex(5);
  body->setUserIndex2(6);
  body->setUserIndex3(7);
  body->internalSetExtensionPointer(&own);
  body->setCustomDebugColor(vector(0.1, 0.2, 0.3));
  body->setHitFraction(scalar(0.75));
  const int kept = 1 << 20;  // a bit of the application's own
  body->setCollisionFlags(body->getCollisionFlags() | kept | btCollisionObject::CF_HAS_COLLISION_SOUND_TRIGGER |
                          btCollisionObject::CF_DISABLE_SPU_COLLISION_PROCESSING |
                          btCollisionObject::CF_CHARACTER_OBJECT | btCollisionObject::CF_DISABLE_VISUALIZE_OBJECT);
  w.step(2);
  LOG(body->getUserPointer() == &own);
  LOG(body->getUserIndex());
  LOG(body->getUserIndex2());
  LOG(body->getUserIndex3());
  LOG(body->internalGetExtensionPointer() == &own);
  btVector3 colour(0, 0, 0);
  LOG(body->getCustomDebugColor(colour));
  LOG(colour);
  LOG(body->getCollisionFlags() & btCollisionObject::CF_HAS_CUSTOM_DEBUG_RENDERING_COLOR);
  body->removeCustomDebugColor();
  LOG(body->getCustomDebugColor(colour));
  LOG(body->getCollisionFlags());
  LOG(body->getHitFraction());
}

API_CASE(CollisionObject, BroadphaseHandle, OnDevice()) {
  btRigidBody* body = freeBody(w);
  const btCollisionObject& read = *body;
  btBroadphaseProxy* proxy = body->getBroadphaseHandle();
  LOG(read.getBroadphaseHandle() == proxy);
  LOG(body->getBroadphaseProxy() == proxy);
  LOG(static_cast<const btRigidBody*>(body)->getBroadphaseProxy() == proxy);
  LOG(body->isInWorld());
  body->setBroadphaseHandle(proxy);
  body->setNewBroadphaseProxy(proxy);
  w.step(2);
  LOG(body->getBroadphaseHandle() == proxy);
  w.world.removeRigidBody(body);
  LOG(body->isInWorld());
  LOG(body->getBroadphaseHandle() == nullptr);
  w.step();
  w.world.addRigidBody(body);
  w.step();
}

// Stock writes tags in each step; btgpu leaves them as the application set them.
API_CASE(CollisionObject, IslandTags, NoStep()) {
  btRigidBody* body = freeBody(w);
  LOG(body->getIslandTag());
  LOG(body->getCompanionId());
  body->setIslandTag(3);
  body->setCompanionId(4);
  LOG(body->getIslandTag());
  LOG(body->getCompanionId());
}

API_CASE(CollisionObject, Revision, OnDevice()) {
  btRigidBody* body = freeBody(w);
  const int before = body->getUpdateRevisionInternal();
  body->setFriction(scalar(0.3));
  body->setRestitution(scalar(0.4));
  body->setRollingFriction(scalar(0.1));
  LOG(body->getUpdateRevisionInternal() - before);
  w.step();
}

// ---- transforms

API_CASE(CollisionObject, Transforms, OnDevice()) {
  btRigidBody* body = freeBody(w);
  const btCollisionObject& read = *body;
  w.probe("as made");
  body->setWorldTransform(turnedAt(vector(1, 2, 3)));
  LOG(read.getWorldTransform());
  w.step();
  LOG_NEAR(read.getWorldTransform());
  body->getWorldTransform().setOrigin(vector(-1, 3, 2));
  w.step();
  LOG_NEAR(body->getWorldTransform());
  LOG_NEAR(body->getInterpolationWorldTransform());
  body->setInterpolationWorldTransform(turnedAt(vector(1, 2, 3)));
  body->setInterpolationLinearVelocity(vector(1, 0, 0));
  body->setInterpolationAngularVelocity(vector(0, 1, 0));
  LOG(read.getInterpolationWorldTransform());
  LOG(read.getInterpolationLinearVelocity());
  LOG(read.getInterpolationAngularVelocity());
  w.step();
  LOG_NEAR(read.getInterpolationWorldTransform());
  LOG_NEAR(read.getInterpolationLinearVelocity());
  LOG_NEAR(read.getInterpolationAngularVelocity());
  body->setCollisionShape(w.objects.sphere(scalar(0.7)));
  w.step();
}

// A kinematic body's interpolation transform is where it came from: setCollisionFlags turns a body into one.
API_CASE(CollisionObject, Kinematic, OnDevice()) {
  btRigidBody* body =
      w.objects.addKinematic(w.objects.box(vector(1, 1, 1)), btTransform(btQuaternion::getIdentity(), vector(0, 0, 0)));
  btRigidBody* rider = w.objects.add(1, w.objects.sphere(scalar(0.5)), vector(0, 1.49, 0));
  w.step();
  body->setWorldTransform(btTransform(btQuaternion::getIdentity(), vector(0.1, 0.05, 0)));
  w.step();
  LOG_NEAR(body->getLinearVelocity());
  LOG_NEAR(rider->getLinearVelocity());
  body->saveKinematicState(scalar(1.0 / 60));
  LOG_NEAR(body->getLinearVelocity());
  w.world.removeRigidBody(body);
  body->setCollisionFlags(btCollisionObject::CF_STATIC_OBJECT);
  w.world.addRigidBody(body);
  w.step();
  LOG(body->isKinematicObject());
}

// ---- contacts

API_CASE(CollisionObject, Friction, OnDevice()) {
  Alike a(w);
  a.add("setFriction")->setFriction(scalar(1.2));
  LOG(a.bodies.back()->getFriction());
  a.add("setRollingFriction")->setRollingFriction(scalar(0.4));
  LOG(a.bodies.back()->getRollingFriction());
  a.add("setSpinningFriction")->setSpinningFriction(scalar(0.4));
  LOG(a.bodies.back()->getSpinningFriction());
  btRigidBody* body = a.add("setAnisotropicFriction");
  body->setAnisotropicFriction(vector(1, 1, 0.1));
  LOG(body->getAnisotropicFriction());
  LOG(body->hasAnisotropicFriction(btCollisionObject::CF_ANISOTROPIC_FRICTION));
  a.add("of rolling")->setRollingFriction(scalar(0.4));
  a.bodies.back()->setAnisotropicFriction(vector(1, 0.2, 0.1), btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION);
  LOG(a.bodies.back()->hasAnisotropicFriction(btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION));
  LOG(a.bodies[0]->hasAnisotropicFriction(btCollisionObject::CF_ANISOTROPIC_FRICTION));
  body = w.objects.add(1, a.ball, vector(9, 9, 0));
  body->setAnisotropicFriction(vector(1, 1, 0.1), btCollisionObject::CF_ANISOTROPIC_FRICTION_DISABLED);
  LOG(body->hasAnisotropicFriction());
  a.ground->setRollingFriction(scalar(0.3));
  a.ground->setSpinningFriction(scalar(0.3));
  a.finish(3);
}

API_CASE(CollisionObject, Contact, OnDevice()) {
  Alike a(w);
  a.ground->setRestitution(scalar(0.8));
  a.add("setRestitution")->setRestitution(scalar(0.9));
  LOG(a.bodies.back()->getRestitution());
  btRigidBody* soft = a.add("setContactStiffnessAndDamping");
  soft->setContactStiffnessAndDamping(scalar(300), scalar(10));
  LOG(soft->getContactStiffness());
  LOG(soft->getContactDamping());
  LOG(soft->getCollisionFlags() & btCollisionObject::CF_HAS_CONTACT_STIFFNESS_DAMPING);
  btRigidBody* ghostly = a.add("CF_NO_CONTACT_RESPONSE");
  ghostly->setCollisionFlags(ghostly->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  LOG(ghostly->hasContactResponse());
  LOG(ghostly->mergesSimulationIslands());
  btRigidBody* picky = a.add("setContactProcessingThreshold");
  picky->setContactProcessingThreshold(scalar(-0.5));
  LOG(picky->getContactProcessingThreshold());
  a.finish(3);
}

API_CASE(CollisionObject, IgnoreCollisionCheck, OnDevice()) {
  Alike a(w);
  btRigidBody* body = a.add("setIgnoreCollisionCheck");
  body->setIgnoreCollisionCheck(a.ground, true);
  LOG(body->getNumObjectsWithoutCollision());
  LOG(w.number(body->getObjectWithoutCollision(0)));
  LOG(body->checkCollideWith(a.ground));
  LOG(body->checkCollideWithOverride(a.ground));
  LOG(body->checkCollideWith(a.bodies[0]));
  a.finish(2);
  body->setIgnoreCollisionCheck(a.ground, false);
  LOG(body->checkCollideWith(a.ground));
  LOG(body->getNumObjectsWithoutCollision());
}

API_CASE(CollisionObject, CcdIsOnlyForFastOnes, Shares("continuous collision detection (CCD)")) {
  btRigidBody* body = freeBody(w);
  body->setCcdMotionThreshold(5);
  body->setCcdSweptSphereRadius(scalar(0.2));
  LOG(body->getCcdMotionThreshold());
  LOG(body->getCcdSquareMotionThreshold());
  LOG(body->getCcdSweptSphereRadius());
  w.step(2);
}

API_CASE(CollisionObject, Ccd, Shares("continuous collision detection (CCD)")) {
  w.world.setGravity(vector(0, 0, 0));
  w.objects.add(0, w.objects.box(vector(0.05, 3, 3)), vector(2, 0, 0));
  btRigidBody* bullet = w.objects.add(1, w.objects.sphere(scalar(0.1)), vector(1.6, 0.1, 0));
  bullet->setLinearVelocity(vector(30, 0, 0));
  bullet->setCcdMotionThreshold(scalar(0.1));
  bullet->setCcdSweptSphereRadius(scalar(0.08));
  // Three times the speed; and a ball of 0.1 turns by 1 / (0.4 r), 25 times what rounds in a contact's friction.
  w.scale = 75;
  w.step(1);
  LOG(bullet->getWorldTransform().getOrigin().x() < 2);
  w.step(2);
  LOG(bullet->getWorldTransform().getOrigin().x() < 2);
}

API_CASE(CollisionObject, FrictionAnchor, OnDevice()) {
  Alike a(w);
  a.add("anchored")->setCollisionFlags(btCollisionObject::CF_HAS_FRICTION_ANCHOR);
  w.step(3);
  w.world.getSolverInfo().m_frictionERP = scalar(0.4);
  w.world.getSolverInfo().m_frictionCFM = scalar(0.01);
  w.step(2);
  for (int i = 0; i < w.dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *w.dispatcher.getManifoldByIndexInternal(i);
    if (manifold.getNumContacts() > 0)
      LOG(manifold.getContactPoint(0).m_contactPointFlags & BT_CONTACT_FLAG_FRICTION_ANCHOR);
  }
  w.logContacts("then");
}

// ---- sleeping

API_CASE(CollisionObject, Activation, OnDevice()) {
  Alike a(w, 2);
  for (const int state : {ISLAND_SLEEPING, DISABLE_SIMULATION}) {
    btRigidBody* body = a.add("state " + std::to_string(state));
    body->setActivationState(state);
    LOG(body->getActivationState());
    LOG(body->isActive());
  }
  a.finish(2);
  btRigidBody* sleeper = a.bodies[1];
  sleeper->activate();
  LOG(sleeper->getActivationState());
  LOG(sleeper->getActivationState() == ACTIVE_TAG);
  w.step();
  btRigidBody* disabled = a.bodies[2];
  disabled->setActivationState(ACTIVE_TAG);  // not that easily
  LOG(disabled->getActivationState());
  disabled->forceActivationState(ACTIVE_TAG);
  LOG(disabled->getActivationState());
  w.step();
  disabled->forceActivationState(DISABLE_DEACTIVATION);
  disabled->activate(true);
  LOG(disabled->getActivationState());
  a.ground->activate();
  LOG(a.ground->getActivationState());
  LOG(a.ground->isActive());
}

// Bullet's own multi bodies have it; a step leaves it alone.
API_CASE(CollisionObject, FixedBase, OnDevice()) {
  freeBody(w);
  btRigidBody* fixed = w.objects.add(0, w.objects.box(vector(1, 1, 1)), vector(0, -3, 0));
  fixed->forceActivationState(FIXED_BASE_MULTI_BODY);
  LOG(fixed->isActive());
  w.step(2);
  LOG(fixed->getActivationState());
}

API_CASE(CollisionObject, Deactivation, OnDevice()) {
  Alike a(w);
  btRigidBody* still = w.objects.add(1, a.ball, vector(8, 0.5, 0));
  btRigidBody* tired = w.objects.add(1, a.ball, vector(16, 0.5, 0));
  btRigidBody* awake = w.objects.add(1, a.ball, vector(24, 0.5, 0));
  tired->setDeactivationTime(scalar(1.99));
  LOG(tired->getDeactivationTime());
  awake->setActivationState(DISABLE_DEACTIVATION);
  awake->setDeactivationTime(5);
  for (int i = 0; i < 3; ++i) {
    w.step();
    for (const btRigidBody* body : {still, tired, awake, a.bodies[0]}) {
      LOG(body->getActivationState());
      LOG_NEAR(body->getDeactivationTime());
    }
  }
  btRigidBody* wants = w.objects.add(1, a.ball, vector(32, 0.5, 0));
  wants->setActivationState(WANTS_DEACTIVATION);
  w.step();
  LOG(wants->getActivationState());
  w.step();
  LOG(wants->getActivationState());
  LOG(wants->wantsSleeping());
}

// ---- btRigidBody: how it is made

API_CASE(RigidBody, ConstructionInfo, OnDevice()) {
  btCollisionShape* shape = w.objects.box(vector(0.5, 0.4, 0.3));
  btVector3 inertia(0, 0, 0);
  shape->calculateLocalInertia(2, inertia);
  auto* state = w.keep<btDefaultMotionState>(turnedAt(vector(0, 3, 0)));
  btRigidBody::btRigidBodyConstructionInfo info(2, state, shape, inertia);
  LOG(info.m_startWorldTransform);
  LOG(info.m_mass);
  LOG(info.m_localInertia);
  LOG(info.m_motionState == state);
  LOG(info.m_collisionShape == shape);
  info.m_linearDamping = scalar(0.1);
  info.m_angularDamping = scalar(0.2);
  info.m_friction = scalar(0.7);
  info.m_rollingFriction = scalar(0.05);
  info.m_spinningFriction = scalar(0.06);
  info.m_restitution = scalar(0.3);
  info.m_linearSleepingThreshold = scalar(0.9);
  info.m_angularSleepingThreshold = scalar(1.1);
  auto* body = w.keep<btRigidBody>(info);
  w.world.addRigidBody(body);
  LOG(body->getLinearDamping());
  LOG(body->getFriction());
  LOG(body->getAngularSleepingThreshold());
  auto* other = w.keep<btRigidBody>(scalar(1), nullptr, w.objects.sphere(scalar(0.5)), vector(0.1, 0.1, 0.1));
  other->setWorldTransform(turnedAt(vector(5, 3, 0)));
  w.world.addRigidBody(other);
  w.step(2);
  btTransform seen;
  state->getWorldTransform(seen);
  LOG_NEAR(seen);
  w.logBodies("then");
  w.world.removeRigidBody(body);
  w.world.removeRigidBody(other);
}

API_CASE(RigidBody, AdditionalDamping, OnDevice()) {
  w.world.setGravity(vector(0, 0, 0));
  btCollisionShape* shape = w.objects.sphere(scalar(0.5));
  for (const bool on : {false, true}) {
    btRigidBody::btRigidBodyConstructionInfo info(1, nullptr, shape, vector(0.1, 0.1, 0.1));
    info.m_startWorldTransform = turnedAt(vector(on ? 5 : 0, 3, 0));
    info.m_additionalDamping = on;
    info.m_additionalDampingFactor = scalar(0.1);
    info.m_additionalLinearDampingThresholdSqr = scalar(0.5);
    info.m_additionalAngularDampingThresholdSqr = scalar(0.6);
    info.m_additionalAngularDampingFactor = scalar(0.2);
    auto* body = w.keep<btRigidBody>(info);
    body->setLinearVelocity(vector(0.3, 0, 0.2));
    body->setAngularVelocity(vector(0.3, 0.1, 0.2));
    w.world.addRigidBody(body);
  }
  w.step(2);
  w.logBodies("damped");
  for (int i = w.world.getNumCollisionObjects(); i-- > 0;) {
    w.world.removeCollisionObject(w.world.getCollisionObjectArray()[i]);
  }
}

API_CASE(RigidBody, Upcast, OnDevice()) {
  btRigidBody* body = freeBody(w);
  btCollisionObject plain;
  LOG(btRigidBody::upcast(static_cast<btCollisionObject*>(body)) == body);
  LOG(btRigidBody::upcast(&plain) == nullptr);
  LOG(btRigidBody::upcast(static_cast<const btCollisionObject*>(&plain)) == nullptr);
  LOG(body->getCollisionShape()->getShapeType());
  LOG(static_cast<const btRigidBody*>(body)->getCollisionShape()->getShapeType());
  body->m_contactSolverType = 0;  // of solvers before 2.76
  body->m_frictionSolverType = 0;
  w.step();
}

// ---- mass, damping, factors

API_CASE(RigidBody, Mass, OnDevice()) {
  btRigidBody* body = freeBody(w);
  LOG(body->getMass());
  LOG(body->getInvMass());
  LOG(body->getLocalInertia());
  LOG(body->getInvInertiaDiagLocal());
  LOG(body->getInvInertiaTensorWorld());
  body->applyTorque(vector(1, 2, 3));
  w.probe("as made");
  body->setMassProps(5, vector(0.5, 0.6, 0.7));
  body->updateInertiaTensor();
  LOG(body->getInvInertiaTensorWorld());
  LOG(body->getMass());
  w.probe("setMassProps");
  body->setInvInertiaDiagLocal(vector(3, 1, 2));
  body->updateInertiaTensor();
  LOG(body->getInvInertiaDiagLocal());
  w.probe("setInvInertiaDiagLocal");
}

API_CASE(RigidBody, Factors, OnDevice()) {
  btRigidBody* body = freeBody(w);
  LOG(body->getLinearFactor());
  LOG(body->getAngularFactor());
  w.probe("as made");
  body->setLinearFactor(vector(1, 0, 0.5));
  LOG(body->getLinearFactor());
  body->setGravity(vector(0, -10, 0));  // the factor counts when forces are applied
  w.probe("setLinearFactor");
  body->setFlags(0);
  body->setAngularFactor(vector(1, 0, 0.5));
  LOG(body->getAngularFactor());
  body->applyTorque(vector(5, 5, 5));
  LOG(body->getTotalTorque());
  w.step();
  body->setAngularFactor(scalar(0.3));
  LOG(body->getAngularFactor());
  body->applyTorque(vector(5, 5, 5));
  w.step();
}

API_CASE(RigidBody, Damping, OnDevice()) {
  btRigidBody* body = freeBody(w);
  w.probe("as made");
  body->setDamping(scalar(0.3), scalar(0.6));
  LOG(body->getLinearDamping());
  LOG(body->getAngularDamping());
  w.probe("setDamping");
  body->applyDamping(scalar(1.0 / 60));
  LOG(body->getLinearVelocity());
  w.step();
}

API_CASE(RigidBody, Gravity, OnDevice()) {
  btRigidBody* body = freeBody(w);
  LOG(body->getGravity());
  w.probe("as made");
  body->setGravity(vector(3, 2, 1));
  LOG(body->getGravity());
  w.probe("setGravity");
  body->applyGravity();
  LOG(body->getTotalForce());
  w.step();
  body->clearGravity();
  LOG(body->getTotalForce());
  w.step();
  body->setFlags(body->getFlags() | BT_DISABLE_WORLD_GRAVITY);
  w.world.setGravity(vector(0, 5, 0));
  LOG(body->getGravity());
  w.step();
}

API_CASE(RigidBody, Gyroscopic, OnDevice()) {
  btRigidBody* body = freeBody(w);
  body->setAngularVelocity(vector(8, 3, -5));
  w.start();
  LOG(body->getFlags());
  LOG(body->computeGyroscopicImpulseImplicit_World(scalar(1.0 / 60)));
  LOG(body->computeGyroscopicImpulseImplicit_Body(scalar(1.0 / 60)));
  LOG(body->computeGyroscopicForceExplicit(100));
  w.probe("as made: BT_ENABLE_GYROPSCOPIC_FORCE");
  LOG(body->getFlags() == BT_ENABLE_GYROPSCOPIC_FORCE);
  body->setFlags(0);
  w.probe("none");
  body->setFlags(BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT);
  w.probe("explicit");
  body->setFlags(BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD);
  w.probe("implicit, in the world");
  body->setFlags(BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY);
  LOG(body->getFlags());
  w.probe("implicit, in the body");
}

// ---- forces, impulses, velocities

API_CASE(RigidBody, Forces, OnDevice()) {
  btRigidBody* body = freeBody(w);
  body->applyCentralForce(vector(10, 5, 0));
  LOG(body->getTotalForce());
  w.step();
  body->applyForce(vector(0, 30, 0), vector(0.3, 0, 0.1));
  LOG(body->getTotalForce());
  LOG(body->getTotalTorque());
  w.step();
  LOG_NEAR(body->getTotalForce());
  body->applyTorque(vector(3, 0, 1));
  LOG(body->getTotalTorque());
  w.step();
  body->applyCentralForce(vector(100, 0, 0));
  body->clearForces();
  LOG(body->getTotalForce());
  w.step();
}

API_CASE(RigidBody, Impulses, OnDevice()) {
  btRigidBody* body = freeBody(w);
  body->applyCentralImpulse(vector(1, 2, 0));
  LOG(body->getLinearVelocity());
  w.step();
  body->applyTorqueImpulse(vector(0.2, 0, 0.1));
  LOG_NEAR(body->getAngularVelocity());
  w.step();
  body->applyImpulse(vector(0, 1, 0), vector(0.3, 0, 0.1));
  w.step();
}

API_CASE(RigidBody, PushVelocity, OnDevice()) {
  btRigidBody* body = freeBody(w);
  body->setPushVelocity(vector(0, 0, 0));
  body->setTurnVelocity(vector(0, 0, 0));
  body->applyCentralPushImpulse(vector(1, 0, 0));
  body->applyTorqueTurnImpulse(vector(0, 1, 0));
  body->applyPushImpulse(vector(0, 1, 0), vector(0.3, 0, 0));
  LOG(body->getPushVelocity());
  LOG(body->getTurnVelocity());
  LOG(body->getPushVelocityInLocalPoint(vector(1, 0, 0)));
  w.step();  // of deformables' solver: they move no rigid body
}

API_CASE(RigidBody, Velocities, OnDevice()) {
  btRigidBody* body = freeBody(w);
  body->setLinearVelocity(vector(1, 2, 3));
  body->setAngularVelocity(vector(-1, 2, -3));
  LOG(body->getLinearVelocity());
  LOG(body->getAngularVelocity());
  LOG(body->getVelocityInLocalPoint(vector(0.1, 0.2, 0.3)));
  w.step();
  LOG_NEAR(body->getLinearVelocity());
  LOG_NEAR(body->getAngularVelocity());
  LOG_NEAR(body->getVelocityInLocalPoint(vector(0.1, 0.2, 0.3)));
  LOG_NEAR(body->computeImpulseDenominator(vector(1, 5, 0), vector(0, 1, 0)));
  LOG_NEAR(body->computeAngularImpulseDenominator(vector(0, 1, 0)));
  body->integrateVelocities(scalar(1.0 / 60));
  LOG_NEAR(body->getLinearVelocity());
}

API_CASE(RigidBody, Pose, OnDevice()) {
  btRigidBody* body = freeBody(w);
  LOG(body->getCenterOfMassPosition());
  LOG(body->getOrientation());
  LOG(body->getCenterOfMassTransform());
  btTransform predicted;
  body->predictIntegratedTransform(scalar(0.1), predicted);
  LOG(predicted);
  w.step();
  LOG_NEAR(body->getCenterOfMassPosition());
  LOG_NEAR(body->getOrientation());
  LOG_NEAR(body->getInvInertiaTensorWorld());
  body->translate(vector(1, 0, 0));
  w.step();
  body->setCenterOfMassTransform(turnedAt(vector(0, 4, 0)));
  LOG(body->getCenterOfMassTransform());
  w.step();
  body->proceedToTransform(turnedAt(vector(1, 4, 0)));
  w.step();
  btVector3 low(0, 0, 0), high(0, 0, 0);
  body->getAabb(low, high);
  LOG_NEAR(low);
  LOG_NEAR(high);
}

API_CASE(RigidBody, Sleeping, OnDevice()) {
  btRigidBody* body = freeBody(w);
  LOG(body->getLinearSleepingThreshold());
  LOG(body->getAngularSleepingThreshold());
  body->setSleepingThresholds(20, 20);
  LOG(body->getLinearSleepingThreshold());
  LOG(body->getAngularSleepingThreshold());
  w.step(2);
  LOG_NEAR(body->getDeactivationTime());
  body->updateDeactivation(scalar(1.9));
  LOG_NEAR(body->getDeactivationTime());
  LOG(body->wantsSleeping());
  w.step(4);
  LOG(body->getActivationState());
  LOG(body->wantsSleeping());
}

API_CASE(RigidBody, MotionState, OnDevice()) {
  btRigidBody* body = freeBody(w);
  auto* state = w.keep<btDefaultMotionState>(turnedAt(vector(2, 6, 0)));
  body->setMotionState(state);
  LOG(body->getMotionState() == state);
  LOG(static_cast<const btRigidBody*>(body)->getMotionState() == state);
  LOG(body->getWorldTransform());
  w.step(2);
  btTransform seen;
  state->getWorldTransform(seen);
  LOG_NEAR(seen);
  body->setMotionState(nullptr);
  w.step();
  state->getWorldTransform(seen);
  LOG_NEAR(seen);
}

API_CASE(RigidBody, ConstraintRefs, Shares("joints")) {
  btRigidBody* body = freeBody(w);
  auto* joint = w.objects.joint<btPoint2PointConstraint>(true, *body, vector(0, 0.4, 0));
  LOG(body->getNumConstraintRefs());
  LOG(body->getConstraintRef(0) == joint);
  w.step();
  body->removeConstraintRef(joint);
  LOG(body->getNumConstraintRefs());
  body->addConstraintRef(joint);
  LOG(body->getNumConstraintRefs());
  w.step();
}

API_CASE(RigidBody, Serialized, OnDevice()) {
  btRigidBody* body = freeBody(w);
  const btCollisionObject& object = *body;
  std::vector<char> record(size_t(body->calculateSerializeBufferSize()));
  btDefaultSerializer serializer;
  LOG(object.calculateSerializeBufferSize());
  LOG(body->serialize(record.data(), &serializer));
  LOG(hexOf(record.data(), record.size()));
  btDefaultSerializer file;
  file.startSerialization();
  body->serializeSingleObject(&file);
  object.serializeSingleObject(&file);
  file.finishSerialization();
  LOG(file.getCurrentBufferSize());
  btCollisionObject plain;
  plain.setCollisionShape(body->getCollisionShape());
  std::vector<char> own(size_t(plain.calculateSerializeBufferSize()));
  LOG(plain.serialize(own.data(), &serializer));
  LOG(hexOf(own.data(), own.size()));
  btDefaultSerializer another;
  another.startSerialization();
  plain.serializeSingleObject(&another);
  LOG(another.getCurrentBufferSize());
  w.step();
}

}  // namespace btgpu::test::api
