// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "scene.h"

#include <cmath>
#include <random>

namespace scenes {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }

}  // namespace

Objects::~Objects() {
  for (const auto& vehicle : m_vehicles) m_world.removeVehicle(vehicle.get());
  for (const auto& joint : m_joints) m_world.removeConstraint(joint.get());
  for (btRigidBody* body : m_bodies) {
    m_world.removeRigidBody(body);
    delete body;
  }
}

btBoxShape* Objects::box(const btVector3& halfExtents) {
  auto shape = std::make_unique<btBoxShape>(halfExtents);
  btBoxShape* raw = shape.get();
  m_shapes.push_back(std::move(shape));
  return raw;
}

btSphereShape* Objects::sphere(btScalar radius) {
  auto shape = std::make_unique<btSphereShape>(radius);
  btSphereShape* raw = shape.get();
  m_shapes.push_back(std::move(shape));
  return raw;
}

btStaticPlaneShape* Objects::plane(const btVector3& normal, btScalar constant) {
  auto shape = std::make_unique<btStaticPlaneShape>(normal, constant);
  btStaticPlaneShape* raw = shape.get();
  m_shapes.push_back(std::move(shape));
  return raw;
}

btCapsuleShape* Objects::capsule(btScalar radius, btScalar height) {
  auto shape = std::make_unique<btCapsuleShape>(radius, height);
  btCapsuleShape* raw = shape.get();
  m_shapes.push_back(std::move(shape));
  return raw;
}

btConvexHullShape* Objects::hull(const std::vector<btVector3>& points) {
  auto shape = std::make_unique<btConvexHullShape>();
  for (const btVector3& p : points) shape->addPoint(p, false);
  shape->recalcLocalAabb();
  btConvexHullShape* raw = shape.get();
  m_shapes.push_back(std::move(shape));
  return raw;
}

btRigidBody* Objects::add(btScalar mass, btCollisionShape* shape, const btTransform& at) {
  btVector3 inertia(0, 0, 0);
  if (mass != btScalar(0)) shape->calculateLocalInertia(mass, inertia);
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
  info.m_startWorldTransform = at;
  auto* body = new btRigidBody(info);
  m_bodies.push_back(body);
  m_world.addRigidBody(body);
  return body;
}

btRigidBody* Objects::add(btScalar mass, btCollisionShape* shape, const btVector3& at) {
  return add(mass, shape, btTransform(btQuaternion::getIdentity(), at));
}

void Objects::remove(btTypedConstraint* joint) {
  m_world.removeConstraint(joint);
  for (auto& owned : m_joints) {
    if (owned.get() == joint) std::swap(owned, m_joints.back());
  }
  m_joints.pop_back();
}

btRaycastVehicle* Objects::vehicle(btRigidBody* chassis, btScalar halfTrack) {
  btRaycastVehicle::btVehicleTuning tuning;
  m_raycasters.push_back(std::make_unique<btDefaultVehicleRaycaster>(&m_world));
  m_vehicles.push_back(std::make_unique<btRaycastVehicle>(tuning, chassis, m_raycasters.back().get()));
  btRaycastVehicle* vehicle = m_vehicles.back().get();
  m_world.addVehicle(vehicle);
  vehicle->setCoordinateSystem(0, 1, 2);
  for (int i = 0; i < 4; ++i) {
    const btVector3 at(i % 2 ? halfTrack : -halfTrack, s(-0.3), s(i < 2 ? 1.5 : -1.5));
    btWheelInfo& wheel = vehicle->addWheel(at, btVector3(0, -1, 0), btVector3(-1, 0, 0), s(0.6), s(0.5), tuning, i < 2);
    wheel.m_suspensionStiffness = 20;
    wheel.m_wheelsDampingRelaxation = s(2.3);
    wheel.m_wheelsDampingCompression = s(4.4);
    wheel.m_rollInfluence = s(0.1);
  }
  return vehicle;
}

std::vector<btVector3> prism(int sides, double radius, double halfHeight) {
  constexpr double kTurn = 6.283185307179586;
  std::vector<btVector3> points;
  for (int k = 0; k < sides; ++k) {
    for (const double y : {-halfHeight, halfHeight}) {
      points.emplace_back(s(radius * std::cos(kTurn * k / sides)), s(y), s(radius * std::sin(kTurn * k / sides)));
    }
  }
  return points;
}

namespace {

constexpr double kStep = 1.0 / 60.0;
const btVector3 kGravity(0, -10, 0);

void addGround(Objects& o) {
  o.world().setGravity(kGravity);
  o.add(0, o.box(btVector3(400, 400, 400)), btVector3(0, -400, 0));
}

// For small bodies: the size of a ground box takes digits from its contacts' depths.
void addFloor(Objects& o) {
  o.world().setGravity(kGravity);
  o.add(0, o.box(btVector3(50, 1, 50)), btVector3(0, -1, 0));
}

void addPlane(Objects& o) {
  o.world().setGravity(kGravity);
  o.add(0, o.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
}

// The paper's demo: layers of boxes with half extent 1, every second layer shifted by half a box.
void buildStack(Objects& o, Size n) {
  addGround(o);
  btBoxShape* box = o.box(btVector3(1, 1, 1));
  for (int y = 0; y < n.y; ++y) {
    const btScalar shift = y % 2 ? s(1) : s(0);
    for (int x = 0; x < n.x; ++x) {
      for (int z = 0; z < n.z; ++z) {
        o.add(1, box, btVector3(s(2.2 * (x - n.x / 2)) + shift, s(1 + 2.2 * y), s(2.2 * (z - n.z / 2)) + shift));
      }
    }
  }
}

void buildPyramid(Objects& o, Size n) {
  addGround(o);
  btBoxShape* box = o.box(btVector3(s(0.5), s(0.5), s(0.5)));
  for (int z = 0; z < n.z; ++z) {
    for (int row = 0; row < n.x; ++row) {
      for (int i = 0; i < n.x - row; ++i) {
        o.add(1, box, btVector3(s(1.05 * (i - 0.5 * (n.x - row))), s(0.5 + 1.0 * row), s(3.0 * z)));
      }
    }
  }
}

void buildWall(Objects& o, Size n) {
  addGround(o);
  btBoxShape* brick = o.box(btVector3(1, s(0.5), s(0.5)));
  for (int z = 0; z < n.z; ++z) {
    for (int y = 0; y < n.y; ++y) {
      for (int x = 0; x < n.x; ++x) {
        o.add(1, brick, btVector3(s(2.02 * x + (y % 2 ? 1.0 : 0.0)), s(0.5 + 1.0 * y), s(4.0 * z)));
      }
    }
  }
}

btQuaternion randomRotation(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  btQuaternion q(s(unit(random)), s(unit(random)), s(unit(random)), s(unit(random)));
  if (q.length2() < s(0.01)) return btQuaternion::getIdentity();
  return q.normalized();
}

// Points on an ellipsoid, so that all of them are corners, with the centre of mass at their mean.
std::vector<btVector3> randomHull(std::mt19937& random, int count, const btVector3& half) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<btVector3> points;
  while (static_cast<int>(points.size()) < count) {
    const btVector3 p(s(unit(random)), s(unit(random)), s(unit(random)));
    if (p.length2() > s(0.01) && p.length2() < 1) points.push_back(p.normalized() * half);
  }
  btVector3 mean(0, 0, 0);
  for (const btVector3& p : points) mean += p / s(count);
  for (btVector3& p : points) p -= mean;
  return points;
}

void addRolling(Objects& o, btCollisionShape* shape, const btTransform& at) {
  btRigidBody* body = o.add(1, shape, at);
  body->setFriction(s(0.6));
  // Without it spheres roll for ever on a plane, in stock too.
  body->setRollingFriction(s(0.1));
  body->setSpinningFriction(s(0.1));
}

// Calls make(random, x + y + z) for each place of a grid over a plane.
template <typename Make>
void rain(Objects& o, Size n, const Make& make) {
  addPlane(o);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter(-0.2, 0.2);
  for (int y = 0; y < n.y; ++y) {
    for (int x = 0; x < n.x; ++x) {
      for (int z = 0; z < n.z; ++z) {
        const double atX = 2.0 * (x - n.x / 2) + jitter(random), atZ = 2.0 * (z - n.z / 2) + jitter(random);
        const btQuaternion rotation = randomRotation(random);
        btCollisionShape* shape = make(random, x + y + z);
        addRolling(o, shape, btTransform(rotation, btVector3(s(atX), s(1.5 + 2.0 * y), s(atZ))));
      }
    }
  }
}

void buildMixed(Objects& o, Size n) {
  std::uniform_real_distribution<double> size(0.4, 0.8);
  rain(o, n, [&o, &size](std::mt19937& random, int place) -> btCollisionShape* {
    const double a = size(random), b = size(random), c = size(random);
    switch (place % 4) {
      case 0:
        return o.box(btVector3(s(a), s(b), s(c)));
      case 1:
        return o.sphere(s(a));
      case 2:
        return o.capsule(s(a / 2), s(b));
      default:
        return o.hull(randomHull(random, 12, btVector3(s(a), s(b), s(c))));
    }
  });
}

void buildHulls(Objects& o, Size n) {
  std::uniform_real_distribution<double> size(0.4, 0.8);
  std::uniform_int_distribution<int> vertices(8, 32), sides(3, 12);
  rain(o, n, [&](std::mt19937& random, int place) {
    const double a = size(random), b = size(random), c = size(random);
    if (place % 3 == 0) return o.hull(prism(sides(random), a, b));
    return o.hull(randomHull(random, vertices(random), btVector3(s(a), s(b), s(c))));
  });
}

void buildBounce(Objects& o, Size n) {
  addPlane(o);
  o.bodies().front()->setRestitution(1);
  btSphereShape* ball = o.sphere(s(0.5));
  btBoxShape* box = o.box(btVector3(s(0.4), s(0.4), s(0.4)));
  for (int x = 0; x < n.x; ++x) {
    const btScalar restitution = s(0.9 * x / btMax(1, n.x - 1));
    for (int z = 0; z < n.z; ++z) {
      btCollisionShape* shape = z % 2 ? static_cast<btCollisionShape*>(box) : ball;
      o.add(1, shape, btVector3(s(2.0 * x), s(3.0 + 0.5 * z), s(2.0 * z)))->setRestitution(restitution);
    }
  }
}

void buildSlope(Objects& o, Size n) {
  o.world().setGravity(kGravity);
  const btQuaternion tilt(btVector3(0, 0, 1), s(-std::atan(0.5)));
  btRigidBody* ground = o.add(0, o.box(btVector3(100, 1, 100)), btTransform(tilt, btVector3(0, 0, 0)));
  ground->setFriction(1);
  btBoxShape* slab = o.box(btVector3(s(0.5), s(0.1), s(0.5)));
  for (int x = 0; x < n.x; ++x) {
    for (int z = 0; z < n.z; ++z) {
      const btVector3 local(s(-40 + 3.0 * x), s(1.1), s(2.0 * (z - n.z / 2)));
      btRigidBody* body = o.add(1, slab, btTransform(tilt, btTransform(tilt) * local));
      body->setFriction(s(1.0 * (z + 1) / n.z));
    }
  }
}

void buildSpin(Objects& o, Size n) {
  o.world().setGravity(btVector3(0, 0, 0));
  btBoxShape* box = o.box(btVector3(s(0.3), s(0.6), s(1.0)));
  const int flags[] = {0, BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT, BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD,
                       BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY};
  for (int x = 0; x < n.x; ++x) {
    for (int z = 0; z < n.z; ++z) {
      btRigidBody* body = o.add(1, box, btVector3(s(5.0 * x), 0, s(5.0 * z)));
      body->setFlags(flags[z % 4]);
      body->setAngularVelocity(btVector3(s(0.1), s(1.0 + x), s(0.05)));
      body->setActivationState(DISABLE_DEACTIVATION);
    }
  }
}

void buildDomino(Objects& o, Size n) {
  addPlane(o);
  btBoxShape* tile = o.box(btVector3(s(0.1), s(1.0), s(0.5)));
  for (int z = 0; z < n.z; ++z) {
    for (int x = 0; x < n.x; ++x) {
      btRigidBody* body = o.add(1, tile, btVector3(s(1.0 * x), 1, s(4.0 * z)));
      if (x == 0) body->setAngularVelocity(btVector3(0, 0, s(-2.0)));
    }
  }
}

btTransform inFrameOf(const btRigidBody& body, const btTransform& world) {
  return body.getWorldTransform().inverse() * world;
}

// A frame whose x axis points along `axis` (about which a cone twists), or whose z axis does (about which a hinge
// turns).
btTransform frameAlong(const btVector3& from, const btVector3& axis, const btVector3& at) {
  return btTransform(shortestArcQuat(from, axis), at);
}

// One figure of eleven bodies and ten joints, 1.7 high, upright at `at` (between its feet), then turned by `turn`.
class Ragdoll {
 public:
  Ragdoll(Objects& o, const btVector3& at, const btQuaternion& turn)
      : m_objects(o), m_place(btTransform(turn, at + btVector3(0, s(0.85), 0))) {
    const btVector3 x(1, 0, 0), y(0, 1, 0);
    btRigidBody* pelvis = addBox(10, {0.15, 0.1, 0.1}, {0, 1.0, 0});
    btRigidBody* chest = addBox(15, {0.18, 0.18, 0.1}, {0, 1.3, 0});
    btRigidBody* head = add(4, o.sphere(s(0.11)), {0, 1.62, 0});
    cone(chest, head, y, {0, 1.5, 0}, 0.4, 0.4, 0.6);
    hinge(pelvis, chest, x, {0, 1.11, 0}, -0.3, 0.6);
    for (const double side : {-1.0, 1.0}) {
      btRigidBody* upperArm = addBox(2.5, {0.13, 0.05, 0.05}, {side * 0.33, 1.42, 0});
      btRigidBody* lowerArm = addBox(1.5, {0.13, 0.04, 0.04}, {side * 0.61, 1.42, 0});
      cone(chest, upperArm, x * s(side), {side * 0.19, 1.42, 0}, 1.2, 1.2, 0.5);
      hinge(upperArm, lowerArm, y, {side * 0.47, 1.42, 0}, side < 0 ? 0 : -2.0, side < 0 ? 2.0 : 0);
      btRigidBody* thigh = addBox(6, {0.07, 0.2, 0.07}, {side * 0.1, 0.68, 0});
      btRigidBody* shin = addBox(4, {0.05, 0.2, 0.06}, {side * 0.1, 0.24, 0});
      cone(pelvis, thigh, -y, {side * 0.1, 0.89, 0}, 0.9, 0.6, 0.3);
      hinge(thigh, shin, x, {side * 0.1, 0.46, 0}, 0, 2.0);
    }
  }

 private:
  struct Point {
    double x, y, z;
    btVector3 vector() const { return {s(x), s(y), s(z)}; }
  };
  // Places are given from the feet; the figure turns about its middle.
  btTransform placed(const Point& p) const {
    return m_place * btTransform(btQuaternion::getIdentity(), p.vector() - btVector3(0, s(0.85), 0));
  }
  btRigidBody* add(double mass, btCollisionShape* shape, const Point& p) {
    btRigidBody* body = m_objects.add(s(mass), shape, placed(p));
    body->setDamping(s(0.05), s(0.85));  // as in Bullet's own ragdoll demo
    body->setFriction(s(0.8));
    body->setRollingFriction(s(0.05));
    body->setSpinningFriction(s(0.05));
    body->setSleepingThresholds(s(1.6), s(2.5));
    return body;
  }
  btRigidBody* addBox(double mass, const Point& halfExtents, const Point& p) {
    return add(mass, m_objects.box(halfExtents.vector()), p);
  }
  void cone(btRigidBody* a, btRigidBody* b, const btVector3& axis, const Point& p, double swing1, double swing2,
            double twist) {
    const btTransform at = placed(p) * frameAlong(btVector3(1, 0, 0), axis, btVector3(0, 0, 0));
    auto* joint = m_objects.joint<btConeTwistConstraint>(true, *a, *b, inFrameOf(*a, at), inFrameOf(*b, at));
    joint->setLimit(s(swing1), s(swing2), s(twist));
  }
  void hinge(btRigidBody* a, btRigidBody* b, const btVector3& axis, const Point& p, double low, double high) {
    const btTransform at = placed(p) * frameAlong(btVector3(0, 0, 1), axis, btVector3(0, 0, 0));
    auto* joint = m_objects.joint<btHingeConstraint>(true, *a, *b, inFrameOf(*a, at), inFrameOf(*b, at));
    joint->setLimit(s(low), s(high));
  }

  Objects& m_objects;
  btTransform m_place;
};

void buildRagdoll(Objects& o, Size n) {
  addFloor(o);
  std::mt19937 random(2);
  for (int y = 0; y < n.y; ++y) {
    for (int x = 0; x < n.x; ++x) {
      for (int z = 0; z < n.z; ++z) {
        const btVector3 at(s(2.2 * (x - n.x / 2)), s(0.6 + 2.2 * y), s(2.2 * (z - n.z / 2)));
        Ragdoll(o, at, randomRotation(random));
      }
    }
  }
}

// X cars drive a curve through rows of Z boxes.
void buildVehicle(Objects& o, Size n) {
  addFloor(o);
  btBoxShape* body = o.box(btVector3(1, s(0.5), 2));
  btBoxShape* crate = o.box(btVector3(s(0.4), s(0.4), s(0.4)));
  for (int x = 0; x < n.x; ++x) {
    const btScalar left = s(12.0 * x);
    btRigidBody* chassis = o.add(800, body, btVector3(left, s(1.5), 0));
    chassis->setActivationState(DISABLE_DEACTIVATION);
    btRaycastVehicle* vehicle = o.vehicle(chassis, s(0.9));
    for (int wheel = 2; wheel < 4; ++wheel) vehicle->applyEngineForce(s(1500), wheel);
    for (int wheel = 0; wheel < 2; ++wheel) vehicle->setSteeringValue(s(0.03 * (x + 1)), wheel);
    for (int z = 0; z < n.z; ++z) {
      for (int y = 0; y < n.y; ++y)
        o.add(20, crate, btVector3(left + s(1.2 * (z % 3)), s(0.4 + 0.8 * y), s(8 + 3.0 * z)));
    }
  }
}

}  // namespace

const std::vector<Scene>& all() {
  static const std::vector<Scene> scenes = {
      {"stack",
       "layers of boxes, every second one shifted (the paper's demo)",
       {8, 8, 8},
       300,
       kStep,
       {8, 0, Rest::Yes},
       buildStack},
      {"pyramid",
       "pyramids of X boxes at the base, Z of them",
       {12, 1, 2},
       300,
       kStep,
       {10, 0, Rest::Yes},
       buildPyramid},
      {"wall", "Z walls of X by Y bricks", {12, 8, 2}, 300, kStep, {10, 0, Rest::Yes}, buildWall},
      // Stock finds one corner of a box on a plane a step, btgpu all of them: boxes that land tumble less, and a pile
      // rained on a plane stands 3.8 +- 1.7 % higher (the same rain on a box: 1.0 +- 1.3 %).
      {"mixed",
       "boxes, spheres, capsules and hulls of many sizes rained on a plane",
       {8, 8, 8},
       600,
       kStep,
       {20, 0, Rest::Yes, 0.05},
       buildMixed},
      {"hulls",
       "convex hulls of 8 to 32 vertices and prisms rained on a plane",
       {6, 6, 6},
       600,
       kStep,
       {20, 0, Rest::Yes, 0.05},
       buildHulls},
      {"bounce",
       "balls and boxes with restitution from 0 to 0.9 dropped on a plane",
       {10, 1, 6},
       300,
       kStep,
       {40, 0, Rest::No},
       buildBounce},
      {"slope",
       "slabs of friction up to 1 on a slope of 1 in 2",
       {6, 1, 10},
       300,
       kStep,
       {40, -1e30, Rest::No},
       buildSlope},
      {"spin",
       "boxes with three different edges spinning freely, one row for each gyroscopic flag",
       {6, 1, 8},
       600,
       kStep,
       {600, -1e30, Rest::No},
       buildSpin},
      {"domino",
       "Z rows of X dominoes, the first of each pushed",
       {30, 1, 3},
       600,
       kStep,
       {30, 0, Rest::Yes},
       buildDomino},
      // Boxes that slide and tumble have old points in their manifolds. Of the new ones on top Bullet keeps those that
      // span the largest area together with the old ones, which it then drops: the deepest may be lost, in either
      // world, and which one depends on the order of the points. 0.2 to 0.9 % of the pairs in these two scenes, all in
      // motion.
      {"ragdoll",
       "ragdolls of boxes, spheres, cone twist joints and hinges, dropped on the ground",
       {3, 2, 3},
       400,
       kStep,
       {10, 0, Rest::AsStock, 0.05, 0.01, {"joints"}},
       buildRagdoll},
      {"vehicle",
       "X raycast vehicles that drive through Z stacks of Y crates",
       {2, 2, 4},
       240,
       kStep,
       {30, 0, Rest::No, 0, 0.01, {"actions"}},
       buildVehicle},
  };
  return scenes;
}

const Scene* find(const std::string& name) {
  for (const Scene& scene : all()) {
    if (scene.name == name) return &scene;
  }
  return nullptr;
}

}  // namespace scenes
