// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <cstdarg>
#include <cstdio>

#include "tests/support/joints.h"
#include "walker.h"

namespace btgpu::test {
namespace {

constexpr int kMost = 36;  // objects

btScalar s(double v) { return static_cast<btScalar>(v); }
bool chance(RandomSource& random, int oneIn) { return random() % static_cast<unsigned>(oneIn) == 0; }
btVector3 vectorIn(RandomSource& random, double size) {
  const btScalar x = scalarIn(random, -size, size), y = scalarIn(random, -size, size),
                 z = scalarIn(random, -size, size);
  return {x, y, z};
}

std::string text(const char* format, ...) {
  char line[300];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  return line;
}

btTransform placeIn(RandomSource& random, double low = 1.5, double high = 6) {
  const btVector3 at(scalarIn(random, -6, 6), scalarIn(random, low, high), scalarIn(random, -6, 6));
  return btTransform(btQuaternion(halfExtents(random, 1).normalized(), scalarIn(random, -3, 3)), at);
}

bool isKind(const WalkObject& o, std::initializer_list<WalkKind> kinds) {
  return std::find(kinds.begin(), kinds.end(), o.kind) != kinds.end();
}

// One of those that `fits`, or null.
template <typename Map, typename Fits>
typename Map::mapped_type* pick(Map& map, RandomSource& random, const Fits& fits) {
  std::vector<typename Map::mapped_type*> found;
  for (auto& [id, entry] : map) {
    if (fits(entry)) found.push_back(&entry);
  }
  return found.empty() ? nullptr : found[random() % found.size()];
}

bool isMoving(const WalkObject& o) { return o.inWorld && o.kind == WalkKind::Dynamic; }
bool isHere(const WalkObject& o) { return o.inWorld && o.id != 1; }  // the floor stays

const char* nameOf(WalkKind kind) {
  switch (kind) {
    case WalkKind::Dynamic:
      return "dynamic";
    case WalkKind::Static:
      return "static";
    case WalkKind::Kinematic:
      return "kinematic";
    case WalkKind::Ghost:
      return "ghost";
    default:
      return "plain";
  }
}

int countHere(Walker& w) {
  int count = 0;
  for (const auto& [id, o] : w.objects()) count += o.inWorld;
  return count;
}

// ---- objects come and go

std::string removeSome(Walker& w, RandomSource& random);

void addFloor(Walker& w) {
  auto floor = std::make_shared<WalkShape>();
  floor->shape = floor->store.make<btStaticPlaneShape>(btVector3(0, 1, 0), s(0));
  w.add(w.makeObject(WalkKind::Static, floor, btTransform::getIdentity(), 0));
}

std::string addObject(Walker& w, RandomSource& random) {
  if (w.objects().empty()) addFloor(w);
  if (countHere(w) >= kMost) return removeSome(w, random);
  std::shared_ptr<WalkShape> shape;
  if (chance(random, 3)) {  // that of another object
    const auto* other = pick(w.objects(), random, [](const WalkObject& o) { return o.id != 1; });
    if (other) shape = other->shape;
  }
  if (!shape) shape = makeWalkShape(static_cast<int>(random() % static_cast<unsigned>(walkShapeCount())), random);
  const unsigned roll = random() % 16;
  WalkKind kind = roll < 11   ? WalkKind::Dynamic
                  : roll < 13 ? WalkKind::Static
                  : roll < 14 ? WalkKind::Kinematic
                  : roll < 15 ? WalkKind::Ghost
                              : WalkKind::Plain;
  const btScalar mass = scalarIn(random, 0.5, 4);
  btTransform at = placeIn(random);
  if (!shape->movable) {
    if (kind == WalkKind::Dynamic || kind == WalkKind::Ghost) kind = WalkKind::Static;
    if (shape->shape->isInfinite() || shape->shape->isConcave()) at.setRotation(btQuaternion::getIdentity());
    at.getOrigin().setY(scalarIn(random, -0.5, 0.8));
  }
  WalkObject& made = w.makeObject(kind, shape, at, mass);
  w.add(made);
  if (isMoving(made)) {
    made.object->setFriction(scalarIn(random, 0, 1));
    made.object->setRestitution(chance(random, 3) ? scalarIn(random, 0, 0.9) : s(0));
    made.body()->setLinearVelocity(vectorIn(random, 2));
    made.body()->setAngularVelocity(vectorIn(random, 2));
  }
  return text("%d, %s, %s", made.id, nameOf(kind), shape->name.c_str());
}

std::string removeSome(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, isHere);
  if (!o) return "none";
  const int id = o->id;
  const bool forGood = chance(random, 2);
  if (forGood) {
    w.destroy(id);
  } else {
    w.remove(*o);
  }
  return text("%d%s", id, forGood ? ", destroyed with its shape" : "");
}

std::string removeAsleep(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, isMoving);
  if (!o) return "none";
  const int id = o->id;
  o->body()->forceActivationState(ISLAND_SLEEPING);
  w.step(1.0 / 60);
  if (chance(random, 2)) {
    w.remove(*o);
    return text("%d", id);
  }
  w.destroy(id);
  return text("%d, destroyed", id);
}

std::string removeInTick(Walker& w, RandomSource& random) {
  const WalkObject* o = pick(w.objects(), random, isHere);
  if (!o) return "none";
  const int id = o->id;
  const bool before = chance(random, 2), forGood = chance(random, 2);
  (before ? w.beforeStep : w.afterStep) = [id, forGood](Walker& walker) {
    if (forGood) {
      walker.destroy(id);
    } else {
      walker.remove(walker.objects().at(id));
    }
  };
  return text("%d%s%s", id, before ? " before the step" : " after it", forGood ? ", destroyed" : "");
}

std::string addInTick(Walker& w, RandomSource& random) {
  const auto seed = static_cast<std::uint32_t>(random());
  const bool before = chance(random, 2);
  (before ? w.beforeStep : w.afterStep) = [seed](Walker& walker) {
    RandomSource own(seed);
    addObject(walker, own);
  };
  return before ? "before the step" : "after it";
}

std::string addAgain(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, [](const WalkObject& x) { return !x.inWorld; });
  if (!o) return addObject(w, random);
  if (countHere(w) >= kMost) return removeSome(w, random);
  const btTransform at = placeIn(random);
  const bool moved = chance(random, 2) && o->shape->movable;
  if (moved) o->object->setWorldTransform(at);
  w.add(*o);
  return text("%d", o->id);
}

std::string removeAndAdd(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, isHere);
  if (!o) return "none";
  w.remove(*o);
  if (chance(random, 2)) std::swap(o->group, o->mask);
  if (o->group == 0) o->group = o->mask = btBroadphaseProxy::AllFilter;
  w.add(*o);
  return text("%d", o->id);
}

std::string clearWorld(Walker& w, RandomSource& random) {
  const bool forGood = chance(random, 2);
  std::vector<int> ids;
  for (const auto& [id, o] : w.objects()) {
    if (isHere(o)) ids.push_back(id);
  }
  for (const int id : ids) {
    if (forGood) {
      w.destroy(id);
    } else {
      w.remove(w.objects().at(id));
    }
  }
  return forGood ? "for good" : "";
}

// ---- and move

std::string teleport(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, [](const WalkObject& x) { return isHere(x) && x.shape->movable; });
  const btTransform at = placeIn(random);
  if (!o) return "none";
  if (o->motionState) o->motionState->transform = at;
  const unsigned way = random() % 3;
  if (way == 0 && o->body()) {
    o->body()->setCenterOfMassTransform(at);
  } else {
    o->object->setWorldTransform(at);
    if (way == 1) o->object->setInterpolationWorldTransform(at);
  }
  if (chance(random, 2)) o->object->activate();
  return text("%d, way %u", o->id, way);
}

// What has left the place comes back.
std::string gather(Walker& w, RandomSource& random) {
  for (auto& [id, o] : w.objects()) {
    const btTransform at = placeIn(random, 2, 12);
    if (!isMoving(o)) continue;
    const btVector3& p = o.object->getWorldTransform().getOrigin();
    if (p.y() > s(-3) && p.length() < s(25)) continue;
    o.body()->setCenterOfMassTransform(at);
    o.body()->setLinearVelocity(btVector3(0, 0, 0));
    o.body()->setAngularVelocity(btVector3(0, 0, 0));
    o.object->activate(true);
  }
  return "";
}

std::string setVelocity(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, isMoving);
  const btVector3 linear = vectorIn(random, 6), angular = vectorIn(random, 6);
  if (!o) return "none";
  o->body()->setLinearVelocity(linear);
  o->body()->setAngularVelocity(angular);
  if (!chance(random, 4)) o->object->activate();
  return text("%d", o->id);
}

std::string push(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, isMoving);
  const btVector3 by = vectorIn(random, 4), at = vectorIn(random, 0.3);
  if (!o) return "none";
  btRigidBody& body = *o->body();
  const unsigned way = random() % 5;
  if (!chance(random, 4)) body.activate();
  if (way == 0) body.applyCentralForce(by * 20);
  if (way == 1) body.applyForce(by * 20, at);
  if (way == 2) body.applyImpulse(by, at);
  if (way == 3) body.applyTorque(by * 5);
  if (way == 4) body.applyTorqueImpulse(by * s(0.2));
  return text("%d, way %u", o->id, way);
}

std::string moveKinematic(Walker& w, RandomSource& random) {
  WalkObject* o =
      pick(w.objects(), random, [](const WalkObject& x) { return isHere(x) && x.kind == WalkKind::Kinematic; });
  const btVector3 by = vectorIn(random, 0.1);
  if (!o) return "none";
  btTransform at = o->object->getWorldTransform();
  at.setOrigin(at.getOrigin() + by);
  if (o->motionState) {
    o->motionState->transform = at;
  } else {
    o->object->setWorldTransform(at);
  }
  o->object->activate(true);
  return text("%d", o->id);
}

std::string setActivation(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, isMoving);
  const int states[] = {ACTIVE_TAG, ISLAND_SLEEPING, WANTS_DEACTIVATION, DISABLE_DEACTIVATION, DISABLE_SIMULATION};
  const int state = states[random() % 5];
  if (!o) return "none";
  const bool force = chance(random, 2);
  if (force) {
    o->object->forceActivationState(state);
  } else {
    o->object->setActivationState(state);
  }
  if (chance(random, 3)) o->object->setDeactivationTime(s(1.9));
  return text("%d, %s %d", o->id, force ? "force" : "set", state);
}

std::string wakeAll(Walker& w, RandomSource&) {
  for (auto& [id, o] : w.objects()) {
    if (isMoving(o)) o.object->forceActivationState(ACTIVE_TAG);
  }
  return "";
}

// ---- what they are like

std::string setMaterial(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, isHere);
  const btScalar a = scalarIn(random, 0, 1), b = scalarIn(random, 0, 1);
  if (!o) return "none";
  const unsigned what = random() % 7;
  btCollisionObject& object = *o->object;
  if (what == 0) object.setFriction(a * 2);
  if (what == 1) object.setRestitution(a);
  if (what == 2) object.setRollingFriction(a * s(0.2));
  if (what == 3) object.setSpinningFriction(a * s(0.2));
  if (what == 4) object.setAnisotropicFriction(btVector3(a, b, 1), 1 + static_cast<int>(random() % 2));
  if (what == 5) object.setContactStiffnessAndDamping(1000 * (a + s(0.1)), 50 * b);
  if (what == 6) object.setContactProcessingThreshold(chance(random, 2) ? a * s(0.1) : BT_LARGE_FLOAT);
  return text("%d, %u", o->id, what);
}

std::string setMass(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, isMoving);
  const btScalar mass = scalarIn(random, 0.3, 8);
  if (!o) return "none";
  o->body()->setMassProps(mass, inertiaOf(*o->shape->shape, mass));
  if (chance(random, 2)) o->body()->updateInertiaTensor();
  return text("%d", o->id);
}

std::string setMotion(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, isMoving);
  const btScalar a = scalarIn(random, 0, 1), b = scalarIn(random, 0, 1);
  if (!o) return "none";
  btRigidBody& body = *o->body();
  const unsigned what = random() % 8;
  const int gyroscopic[] = {0, BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT, BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD,
                            BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY};
  if (what == 0) body.setDamping(a * s(0.5), b * s(0.5));
  if (what == 1) body.setLinearFactor(btVector3(1, s(chance(random, 2)), s(chance(random, 2))));
  if (what == 2) body.setAngularFactor(btVector3(s(chance(random, 2)), 1, s(chance(random, 2))));
  if (what == 3) body.setFlags(gyroscopic[random() % 4]);
  if (what == 4) body.setSleepingThresholds(a * 2, b * 2);
  if (what == 5) body.setGravity(btVector3(a, -10 * b, 0));
  if (what == 6) body.setCcdMotionThreshold(chance(random, 2) ? s(0) : s(0.05));
  if (what == 6) body.setCcdSweptSphereRadius(s(0.1));
  if (what == 7) body.setFlags(body.getFlags() ^ BT_DISABLE_WORLD_GRAVITY);
  return text("%d, %u", o->id, what);
}

std::string setFlags(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, [](const WalkObject& x) {
    return isHere(x) && isKind(x, {WalkKind::Dynamic, WalkKind::Static});
  });
  if (!o) return "none";
  btCollisionObject& object = *o->object;
  if (chance(random, 3)) {
    object.setCollisionFlags(object.getCollisionFlags() ^ btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    return text("%d, custom material", o->id);
  }
  object.setCollisionFlags(object.getCollisionFlags() ^ btCollisionObject::CF_NO_CONTACT_RESPONSE);
  return text("%d, response", o->id);
}

std::string becomeKinematic(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, [](const WalkObject& x) {
    return isHere(x) && x.shape->movable && isKind(x, {WalkKind::Dynamic, WalkKind::Kinematic});
  });
  const btScalar mass = scalarIn(random, 0.5, 4);
  if (!o) return "none";
  w.remove(*o);
  const bool kinematic = o->kind == WalkKind::Dynamic;
  o->kind = kinematic ? WalkKind::Kinematic : WalkKind::Dynamic;
  o->object->setCollisionFlags(o->object->getCollisionFlags() ^ btCollisionObject::CF_KINEMATIC_OBJECT);
  if (!kinematic) {
    o->body()->setMassProps(mass, inertiaOf(*o->shape->shape, mass));
    o->body()->updateInertiaTensor();
    o->body()->forceActivationState(ACTIVE_TAG);
  } else {
    o->body()->setLinearVelocity(btVector3(0, 0, 0));
    o->body()->setAngularVelocity(btVector3(0, 0, 0));
    if (o->motionState) o->motionState->transform = o->object->getWorldTransform();
    o->body()->forceActivationState(DISABLE_DEACTIVATION);
  }
  o->group = kinematic ? btBroadphaseProxy::StaticFilter : btBroadphaseProxy::DefaultFilter;
  o->mask = kinematic ? btBroadphaseProxy::AllFilter ^ btBroadphaseProxy::StaticFilter : btBroadphaseProxy::AllFilter;
  w.add(*o);
  return text("%d, %s", o->id, nameOf(o->kind));
}

std::string setFilter(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, isHere);
  const unsigned mask = random();
  if (!o) return "none";
  btBroadphaseProxy& proxy = *o->object->getBroadphaseHandle();
  proxy.m_collisionFilterMask = chance(random, 2) ? int(btBroadphaseProxy::AllFilter) : int(mask & 0x3f) | 2;
  if (chance(random, 2)) w.world().refreshBroadphaseProxy(o->object.get());
  return text("%d", o->id);
}

std::string ignorePair(Walker& w, RandomSource& random) {
  WalkObject* a = pick(w.objects(), random, isHere);
  WalkObject* b = pick(w.objects(), random, isHere);
  if (!a || a == b) return "none";
  const bool ignore = !chance(random, 3);
  a->object->setIgnoreCollisionCheck(b->object.get(), ignore);
  return text("%d %d %d", a->id, b->id, ignore);
}

// Bullet's algorithms know the types of their shapes: whoever changes a shape cleans the pairs.
std::string setShape(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, [](const WalkObject& x) { return isMoving(x); });
  auto shape = makeWalkShape(static_cast<int>(random() % walkConvexKinds().size()), random);
  if (!o) return "none";
  const bool outside = chance(random, 2);
  if (outside) {
    w.remove(*o);
  } else {
    w.world().getPairCache()->cleanProxyFromPairs(o->object->getBroadphaseHandle(), &w.dispatcher());
  }
  o->object->setCollisionShape(shape->shape);
  o->shape = shape;  // the old one is gone, if it was its alone
  if (outside) w.add(*o);
  return text("%d, %s", o->id, shape->name.c_str());
}

std::string scaleShape(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, [](const WalkObject& x) {
    const int type = x.shape->shape->getShapeType();
    return isMoving(x) &&
           (type == BOX_SHAPE_PROXYTYPE || type == SPHERE_SHAPE_PROXYTYPE || type == CONVEX_HULL_SHAPE_PROXYTYPE);
  });
  const btScalar by = scalarIn(random, 0.6, 1.4);
  if (!o) return "none";
  o->shape->shape->setLocalScaling(btVector3(by, by, by));
  return text("%d", o->id);
}

std::string editCompound(Walker& w, RandomSource& random) {
  WalkObject* o = pick(w.objects(), random, [](const WalkObject& x) { return isHere(x) && x.shape->compound; });
  if (!o) return addObject(w, random);
  WalkShape& shape = *o->shape;
  const btTransform at(btQuaternion(halfExtents(random, 1).normalized(), scalarIn(random, -3, 3)),
                       vectorIn(random, 0.5));
  const int children = shape.compound->getNumChildShapes();
  const unsigned what = random() % 3;
  if (what == 0 && children < 4) {
    shape.parts.push_back(makeWalkShape(static_cast<int>(random() % walkConvexKinds().size()), random));
    shape.compound->addChildShape(at, shape.parts.back()->shape);
  } else if (what == 1 && children > 1) {
    // Child algorithms go by index: without this they hold a shape that is gone.
    for (auto& [id, other] : w.objects()) {
      if (!other.inWorld) continue;
      w.world().getPairCache()->cleanProxyFromPairs(other.object->getBroadphaseHandle(), &w.dispatcher());
    }
    shape.compound->removeChildShapeByIndex(static_cast<int>(random() % static_cast<unsigned>(children)));
  } else if (children > 0) {
    shape.compound->updateChildTransform(static_cast<int>(random() % static_cast<unsigned>(children)), at);
  }
  if (chance(random, 2)) shape.compound->recalculateLocalAabb();
  return text("%d, %u of %d", o->id, what, children);
}

// ---- joints

std::string addJoint(Walker& w, RandomSource& random) {
  WalkObject* a = pick(w.objects(), random, isMoving);
  WalkObject* b = pick(w.objects(), random, isMoving);
  static const std::vector<JointKind> kinds = jointKinds();
  const auto which = random() % (kinds.size() + 1);
  if (!a || a == b || w.joints().size() >= 12) return "none";
  WalkJoint* joint;
  if (which == kinds.size()) {
    joint =
        &w.takeJoint(w.jointOwner().joint<btPoint2PointConstraint>(false, *a->body(), btVector3(0, 1, 0)), a->id, 0);
  } else {
    // Where they are they would be torn apart.
    btTransform near = a->object->getWorldTransform();
    near.setOrigin(near.getOrigin() + btVector3(s(1.3), s(0.2), 0));
    b->body()->setCenterOfMassTransform(near);
    joint = &w.takeJoint(kinds[which].make(w.jointOwner(), *a->body(), *b->body()), a->id, b->id);
  }
  a->object->activate(true);
  b->object->activate(true);
  if (chance(random, 2)) {
    joint->apart = true;
    w.world().removeConstraint(joint->joint);
    w.world().addConstraint(joint->joint, true);
  }
  if (chance(random, 3)) {
    joint->feedback = std::make_unique<btJointFeedback>();
    joint->joint->setJointFeedback(joint->feedback.get());
  }
  if (chance(random, 4)) joint->joint->setBreakingImpulseThreshold(scalarIn(random, 0.1, 3));
  if (chance(random, 4)) joint->joint->setOverrideNumSolverIterations(1 + static_cast<int>(random() % 30));
  return text("%d, %s, %d %d", joint->id, which == kinds.size() ? "to the world" : kinds[which].name.c_str(), joint->a,
              joint->b);
}

std::string changeJoint(Walker& w, RandomSource& random) {
  WalkJoint* joint = pick(w.joints(), random, [](const WalkJoint&) { return true; });
  if (!joint) return "none";
  const int id = joint->id;
  const unsigned what = random() % 5;
  if (what == 0) joint->joint->setEnabled(chance(random, 2));
  if (what == 1) joint->joint->setBreakingImpulseThreshold(chance(random, 2) ? BT_LARGE_FLOAT : s(0.5));
  if (what == 2) w.removeJoint(id);
  if (what == 3) {
    if (joint->inWorld) {
      w.world().removeConstraint(joint->joint);
    } else {
      w.world().addConstraint(joint->joint, chance(random, 2));
    }
    joint->inWorld = !joint->inWorld;
  }
  if (what == 4) joint->joint->setOverrideNumSolverIterations(-1);
  return text("%d, %u", id, what);
}

// ---- the world

std::string setGravity(Walker& w, RandomSource& random) {
  const btVector3 g = chance(random, 2) ? btVector3(0, -10, 0) : vectorIn(random, 2) + btVector3(0, -6, 0);
  w.world().setGravity(g);
  return "";
}

std::string setSolver(Walker& w, RandomSource& random) {
  btContactSolverInfo& info = w.world().getSolverInfo();
  const unsigned what = random() % 9;
  const int modes[] = {SOLVER_USE_WARMSTARTING, SOLVER_USE_2_FRICTION_DIRECTIONS,
                       SOLVER_ENABLE_FRICTION_DIRECTION_CACHING, SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION,
                       SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS};
  if (what == 0) info.m_numIterations = 4 + static_cast<int>(random() % 12);
  if (what == 1) info.m_splitImpulse = chance(random, 2);
  if (what == 2) info.m_erp2 = scalarIn(random, 0.1, 0.4);
  if (what == 3) info.m_erp = scalarIn(random, 0.1, 0.4);
  if (what == 4) info.m_globalCfm = chance(random, 2) ? s(0) : s(1e-4);
  if (what == 5) info.m_solverMode ^= modes[random() % 5];
  if (what == 6) info.m_linearSlop = chance(random, 2) ? s(0) : s(0.005);
  if (what == 7) info.m_warmstartingFactor = scalarIn(random, 0.5, 0.9);
  if (what == 8) info.m_restitutionVelocityThreshold = scalarIn(random, 0, 0.5);
  return text("%u", what);
}

std::string setWorld(Walker& w, RandomSource& random) {
  const unsigned what = random() % 4;
  if (what == 0) w.world().setForceUpdateAllAabbs(chance(random, 2));
  if (what == 1) w.world().getDispatchInfo().m_useContinuous = chance(random, 2);
  if (what == 2) w.world().getDispatchInfo().m_deterministicOverlappingPairs = chance(random, 2);
  if (what == 3) w.world().setSynchronizeAllMotionStates(chance(random, 2));
  return text("%u", what);
}

std::string configure(Walker& w, RandomSource& random) {
  btGpuSettings settings = w.settings();
  const bool contacts = !chance(random, 3), queries = !chance(random, 3);
  settings.m_contacts = contacts;
  settings.m_hostQueries = queries;
  w.configure(settings);
  return text("contacts %d, host queries %d", contacts, queries);
}

// ---- callbacks

Walker* walkerOf(const btCollisionObject* object) { return static_cast<Walker*>(object->getUserPointer()); }
Walker* walkerOf(const btPersistentManifold* manifold) { return walkerOf(manifold->getBody0()); }

bool onAdded(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int, const btCollisionObjectWrapper*, int,
             int) {
  // The oracle's copies of the bodies have no user pointer.
  if (Walker* walker = walkerOf(a->getCollisionObject())) ++walker->calls().added;
  point.m_combinedFriction *= s(0.5);
  return true;
}
bool onProcessed(btManifoldPoint&, void* a, void*) {
  if (Walker* walker = walkerOf(static_cast<btCollisionObject*>(a))) ++walker->calls().processed;
  return false;
}
void onStarted(btPersistentManifold* const& manifold) {
  if (Walker* walker = walkerOf(manifold)) ++walker->calls().started;
}
void onEnded(btPersistentManifold* const& manifold) {
  if (Walker* walker = walkerOf(manifold)) ++walker->calls().ended;
}
bool onDestroyed(void* data) {
  delete static_cast<int*>(data);
  if (Walker::current) ++Walker::current->calls().destroyed;
  return true;
}
btScalar averageFriction(const btCollisionObject* a, const btCollisionObject* b) {
  return (a->getFriction() + b->getFriction()) / 2;
}

std::string setCallbacks(Walker&, RandomSource& random) {
  const unsigned what = random() % 5;
  const bool on = chance(random, 2);
  if (what == 0) gContactAddedCallback = on ? onAdded : nullptr;
  if (what == 1) gContactProcessedCallback = on ? onProcessed : nullptr;
  if (what == 2) gContactStartedCallback = on ? onStarted : nullptr;
  if (what == 3) gContactEndedCallback = on ? onEnded : nullptr;
  if (what == 4) {
    gCalculateCombinedFrictionCallback = on ? averageFriction : &btManifoldResult::calculateCombinedFriction;
  }
  return text("%u %d", what, on);
}

// Data of the application's in contact points, which comes back to it once.
std::string markContacts(Walker& w, RandomSource&) {
  gContactDestroyedCallback = onDestroyed;
  for (int i = 0; i < w.dispatcher().getNumManifolds(); ++i) {
    btPersistentManifold& m = *w.dispatcher().getManifoldByIndexInternal(i);
    for (int k = 0; k < m.getNumContacts(); ++k) {
      if (!m.getContactPoint(k).m_userPersistentData) m.getContactPoint(k).m_userPersistentData = new int(1);
    }
  }
  return "";
}

struct Pusher : btActionInterface {
  explicit Pusher(Walker& walker) : m_walker(walker) {}
  void updateAction(btCollisionWorld* world, btScalar) override {
    ++m_walker.calls().actions;
    for (int i = 0; i < world->getNumCollisionObjects(); ++i) {
      btRigidBody* body = btRigidBody::upcast(world->getCollisionObjectArray()[i]);
      if (body && !body->isStaticOrKinematicObject() && body->isActive() && body->getUserIndex() % 5 == 0) {
        body->applyCentralImpulse(btVector3(s(0.01), 0, 0));
      }
    }
  }
  void debugDraw(btIDebugDraw*) override {}
  Walker& m_walker;
};

std::string setAction(Walker& w, RandomSource&) {
  if (!w.actions().empty()) {
    w.world().removeAction(w.actions().back().get());
    w.actions().pop_back();
    return "removed";
  }
  w.actions().push_back(std::make_unique<Pusher>(w));
  w.world().addAction(w.actions().back().get());
  return "added";
}

struct OddFilter : btOverlapFilterCallback {
  explicit OddFilter(Walker& walker) : m_walker(walker) {}
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
    ++m_walker.calls().filters;
    const auto id = [](const btBroadphaseProxy* p) {
      return static_cast<const btCollisionObject*>(p->m_clientObject)->getUserIndex();
    };
    return id(a) == 1 || id(b) == 1 || (id(a) + id(b)) % 4 != 0;
  }
  Walker& m_walker;
};

std::string setFilterCallback(Walker& w, RandomSource&) {
  const bool on = !w.filter;
  w.filter = on ? std::make_unique<OddFilter>(w) : nullptr;
  w.world().getPairCache()->setOverlapFilterCallback(w.filter.get());
  return on ? "on" : "off";
}

// ---- queries

std::string castRays(Walker& w, RandomSource& random) {
  std::vector<btGpuRay> rays(4);
  for (btGpuRay& ray : rays) {
    ray.m_from = btVector3(scalarIn(random, -8, 8), s(10), scalarIn(random, -8, 8));
    ray.m_to = btVector3(scalarIn(random, -8, 8), s(-2), scalarIn(random, -8, 8));
  }
  std::vector<btGpuRayHit> batch;
  if (w.gpu()) w.gpu()->rayTestBatch(rays, batch);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    btCollisionWorld::ClosestRayResultCallback hit(rays[i].m_from, rays[i].m_to);
    w.world().rayTest(rays[i].m_from, rays[i].m_to, hit);
    if (hit.hasHit() && walkerOf(hit.m_collisionObject) != &w) w.problem() = "a ray hit what is not in the world";
    if (!w.gpu() || !w.settings().m_hostQueries) continue;
    // Objects that touch within rounding may come in either order.
    if (std::abs(double(batch[i].m_closestHitFraction - hit.m_closestHitFraction)) > 1e-4) {
      w.problem() =
          text("ray %d: batch %g, object %d; rayTest %g, object %d", int(i), double(batch[i].m_closestHitFraction),
               batch[i].m_collisionObject ? batch[i].m_collisionObject->getUserIndex() : 0,
               double(hit.m_closestHitFraction), hit.hasHit() ? hit.m_collisionObject->getUserIndex() : 0);
    }
  }
  return "";
}

std::string sweep(Walker& w, RandomSource& random) {
  const btVector3 from(scalarIn(random, -8, 8), s(9), scalarIn(random, -8, 8));
  const btVector3 to(scalarIn(random, -8, 8), s(0.5), scalarIn(random, -8, 8));
  const btSphereShape ball(s(0.3));
  const btTransform start(btQuaternion::getIdentity(), from), end(btQuaternion::getIdentity(), to);
  btCollisionWorld::ClosestConvexResultCallback hit(from, to);
  w.world().convexSweepTest(&ball, start, end, hit);
  if (hit.hasHit() && walkerOf(hit.m_hitCollisionObject) != &w) w.problem() = "a sweep hit what is not in the world";
  if (w.gpu()) {
    btGpuSweep query;
    query.m_shape = &ball;
    query.m_from = start;
    query.m_to = end;
    std::vector<btGpuSweepHit> hits;
    w.gpu()->convexSweepBatch({query}, hits);
  }
  return "";
}

std::string testContacts(Walker& w, RandomSource& random) {
  struct Any : btCollisionWorld::ContactResultCallback {
    btScalar addSingleResult(btManifoldPoint&, const btCollisionObjectWrapper* a, int, int,
                             const btCollisionObjectWrapper* b, int, int) override {
      if (walkerOf(a->getCollisionObject()) != walker || walkerOf(b->getCollisionObject()) != walker) strange = true;
      return 0;
    }
    Walker* walker = nullptr;
    bool strange = false;
  } any;
  any.walker = &w;
  WalkObject* a = pick(w.objects(), random, isHere);
  if (!a) return "none";
  w.world().contactTest(a->object.get(), any);
  if (any.strange) w.problem() = "contactTest found what is not in the world";
  return text("%d", a->id);
}

std::string serialize(Walker& w, RandomSource&) {
  btDefaultSerializer serializer;
  w.world().serialize(&serializer);
  if (serializer.getCurrentBufferSize() == 0) w.problem() = "nothing was serialized";
  return "";
}

// ---- steps

std::string stepOddly(Walker& w, RandomSource& random) {
  w.stepsLater() = true;
  const unsigned way = random() % 6;
  const btScalar time = scalarIn(random, 0.001, 0.1);
  if (way == 0) w.step(double(time), 10);
  if (way == 1) w.step(double(time), 3, 1.0 / 120);
  if (way == 2) w.step(0, 0);
  if (way == 3) w.step(0.3 / 60, 1);
  if (way == 4) w.step(1.0 / 30, 1, 1.0 / 30);
  if (way == 5) w.step(std::min(1.0 / 40, double(time)), 0);
  return text("%u", way);
}

std::string stepOn(Walker& w, RandomSource& random) {
  w.stepsLater() = true;
  const int steps = 5 + static_cast<int>(random() % 20);
  for (int i = 0; i < steps; ++i) w.step(1.0 / 60);
  return text("%d", steps);
}

// Long enough for what is at rest to fall asleep, and for a world to stay so.
std::string letSleep(Walker& w, RandomSource&) {
  w.stepsLater() = true;
  const btScalar usual = gDeactivationTime;
  gDeactivationTime = s(0.1);
  for (auto& [id, o] : w.objects()) {
    if (isMoving(o)) o.body()->setSleepingThresholds(3, 3);
  }
  for (int i = 0; i < 30; ++i) w.step(1.0 / 60);
  gDeactivationTime = usual;
  return "";
}

}  // namespace

const std::vector<OperationKind>& operationKinds() {
  static const std::vector<OperationKind> kinds = {
      {"add", 12, addObject},
      {"remove", 5, removeSome},
      {"remove asleep", 2, removeAsleep},
      {"remove in tick", 2, removeInTick},
      {"add in tick", 1, addInTick},
      {"add again", 4, addAgain},
      {"remove and add", 2, removeAndAdd},
      {"clear", 1, clearWorld},
      {"teleport", 4, teleport},
      {"gather", 4, gather},
      {"velocity", 5, setVelocity},
      {"push", 6, push},
      {"move kinematic", 4, moveKinematic},
      {"activation", 4, setActivation},
      {"wake all", 2, wakeAll},
      {"material", 5, setMaterial},
      {"mass", 3, setMass},
      {"motion", 6, setMotion},
      {"flags", 3, setFlags},
      {"kinematic", 2, becomeKinematic},
      {"filter", 2, setFilter},
      {"ignore", 2, ignorePair},
      {"shape", 3, setShape},
      {"scale", 2, scaleShape},
      {"compound", 3, editCompound},
      {"joint", 6, addJoint},
      {"change joint", 5, changeJoint},
      {"gravity", 1, setGravity},
      {"solver", 2, setSolver},
      {"world", 2, setWorld},
      {"configure", 1, configure},
      {"callbacks", 2, setCallbacks},
      {"mark contacts", 1, markContacts},
      {"action", 1, setAction},
      {"filter callback", 1, setFilterCallback},
      {"rays", 4, castRays},
      {"sweep", 2, sweep},
      {"contact test", 1, testContacts},
      {"serialize", 1, serialize},
      {"step oddly", 5, stepOddly},
      {"step on", 3, stepOn},
      {"sleep", 2, letSleep},
  };
  return kinds;
}

void resetGlobals() {
  gContactAddedCallback = nullptr;
  gContactProcessedCallback = nullptr;
  gContactStartedCallback = nullptr;
  gContactEndedCallback = nullptr;
  gContactDestroyedCallback = nullptr;
  gCalculateCombinedFrictionCallback = &btManifoldResult::calculateCombinedFriction;
}

}  // namespace btgpu::test
