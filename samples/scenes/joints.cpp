// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What hangs together by joints: a bridge, ragdolls in a heap, a crane with a load of a hundred times its chain's
// links, a net of balls.
#include <algorithm>
#include <cmath>

#include "parts.h"

namespace scenes {
namespace {

constexpr double kTurn = 6.283185307179586;

// ---- bridge

// It hangs in an arc as long as its planks, from one bank to the other.
struct Bridge {
  static constexpr double kPitch = 0.5, kHalfPlank = 0.24, kHalfWidth = 1, kArc = 1;  // kArc: in radians
  int planks;

  double radius() const { return kPitch * planks / kArc; }
  double halfSpan() const { return radius() * std::sin(kArc / 2); }
  double sag() const { return radius() * (1 - std::cos(kArc / 2)); }
  double height() const { return sag() + 4; }  // of its ends
  // `seam`: planks from its left end. Turned as a plank is there.
  btTransform at(double seam, double z) const {
    const double angle = kArc * (seam / planks - 0.5);
    const btVector3 place(s(radius() * std::sin(angle)),
                          s(height() + radius() * (std::cos(kArc / 2) - std::cos(angle))), s(z));
    return btTransform(btQuaternion(btVector3(0, 0, 1), s(angle)), place);
  }
};

// Planks in a row, hinged to each other and to a bank at either end.
void addBridge(Objects& o, const Bridge& bridge, double z) {
  const double half = bridge.height() / 2;
  btBoxShape* bank = o.box(btVector3(1, s(half), s(Bridge::kHalfWidth)));
  btBoxShape* plank = o.box(btVector3(s(Bridge::kHalfPlank), s(0.05), s(Bridge::kHalfWidth)));
  btRigidBody* last = o.add(0, bank, placedAt(-bridge.halfSpan() - 1, half, z));
  for (int i = 0; i < bridge.planks; ++i) {
    btRigidBody* next = o.add(10, plank, bridge.at(i + 0.5, z));
    addHinge(o, *last, *next, bridge.at(i, z));
    last = next;
  }
  addHinge(o, *last, *o.add(0, bank, placedAt(bridge.halfSpan() + 1, half, z)), bridge.at(bridge.planks, z));
}

// Crates fall on the bridges all along.
void buildBridge(Objects& o, Size n) {
  constexpr double kApart = 4;
  const Bridge bridge{n.x};
  addFloor(o, bridge.halfSpan() + 10, kApart * n.z + 10);
  btBoxShape* crate = o.box(btVector3(s(0.3), s(0.3), s(0.3)));
  for (int k = 0; k < n.z; ++k) {
    const double z = kApart * (k - 0.5 * (n.z - 1));
    addBridge(o, bridge, z);
    for (int i = 0; i < n.y; ++i) {
      btTransform at = bridge.at(n.x * (i + 0.5) / n.y, z + (i % 2 ? 0.4 : -0.4));
      at.getOrigin() += btVector3(0, s(0.6 + 0.5 * (i % 3)), 0);
      o.add(5, crate, at);
    }
  }
}

// ---- ragdolls

// In square layers, as many of these as make a cube.
void buildRagdolls(Objects& o, Size n) {
  constexpr double kPitch = 1.9;
  addFloor(o);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> jitter(-0.15, 0.15);
  const int count = n.x * n.y * n.z, side = root(count, 3);
  for (int i = 0; i < count; ++i) {
    const int x = i % side, z = i / side % side, y = i / side / side;
    const double atX = kPitch * (x - 0.5 * (side - 1)) + jitter(random);
    const double atZ = kPitch * (z - 0.5 * (side - 1)) + jitter(random);
    addRagdoll(o, btVector3(s(atX), s(0.6 + 2.2 * y), s(atZ)), randomRotation(random), Limbs::Boxes);
  }
}

// ---- crane

// A jib that turns to and fro about a tower; from its end hangs a chain of light links with a heavy load.
class Crane {
 public:
  Crane(Objects& o, int links, double x) : m_objects(o), m_x(x), m_height(kLink * links + 2 * kHalfLoad + 1.5) {
    o.add(0, o.box(btVector3(s(0.5), s(m_height / 2 - 0.2), s(0.5))), placedAt(x, m_height / 2 - 0.2, 0));
    // It turns about the tower: so does its centre.
    m_jib = o.addKinematic(o.box(btVector3(s(0.2), s(0.2), s(kReach + 0.2))), placedAt(x, m_height, 0));
    addChain(links);
  }
  btRigidBody* jib() const { return m_jib; }

  static constexpr double kReach = 5, kLink = 0.5, kHalfLoad = 0.5, kLinkMass = 1, kLoadMass = 100;

 private:
  void addChain(int links) {
    btCapsuleShape* link = m_objects.capsule(s(0.08), s(kLink - 0.16));
    btRigidBody* last = m_jib;
    double y = m_height - 0.2;
    for (int i = 0; i < links; ++i, y -= kLink) { last = hang(last, kLinkMass, link, y, kLink / 2); }
    hang(last, kLoadMass, m_objects.box(btVector3(s(kHalfLoad), s(kHalfLoad), s(kHalfLoad))), y, kHalfLoad);
  }
  // By a ball joint at height y, `below` over the middle of the new body.
  btRigidBody* hang(btRigidBody* from, double mass, btCollisionShape* shape, double y, double below) {
    btRigidBody* body = m_objects.add(s(mass), shape, placedAt(m_x, y - below, kReach));
    const btVector3 at(s(m_x), s(y), s(kReach));
    m_objects.joint<btPoint2PointConstraint>(true, *from, *body, from->getWorldTransform().inverse() * at,
                                             body->getWorldTransform().inverse() * at);
    return body;
  }

  Objects& m_objects;
  double m_x, m_height;
  btRigidBody* m_jib = nullptr;
};

// Moves the jib to where it is at the end of a substep, at the velocity of the way there, as the washer's drum.
void swing(Objects& o, btRigidBody* jib) {
  constexpr double kReachOfTurn = kTurn / 6, kPeriod = 8;
  o.beforeSubsteps([jib, time = 0.0](btScalar timeStep) mutable {
    const auto angleAt = [](double t) { return kReachOfTurn * std::sin(kTurn * t / kPeriod); };
    const double before = angleAt(time);
    time += double(timeStep);
    const btVector3 up(0, 1, 0);
    const btTransform pose(btQuaternion(up, s(angleAt(time))), jib->getWorldTransform().getOrigin());
    jib->setWorldTransform(pose);
    jib->setInterpolationWorldTransform(pose);
    jib->setAngularVelocity(up * s((angleAt(time) - before) / double(timeStep)));
  });
}

// A wall of crates stands where the load comes by.
void buildCrane(Objects& o, Size n) {
  constexpr double kApart = 16, kCrate = 0.4;
  addFloor(o, kApart * n.z / 2 + 20, 30);
  btBoxShape* crate = o.box(btVector3(s(kCrate), s(kCrate), s(kCrate)));
  for (int k = 0; k < n.z; ++k) {
    const double x = kApart * (k - 0.5 * (n.z - 1));
    const Crane crane(o, n.x, x);
    swing(o, crane.jib());
    for (int y = 0; y < n.y; ++y) {
      for (int i = 0; i < n.y; ++i) {
        o.add(5, crate, placedAt(x + 2.5, kCrate * (2 * y + 1), Crane::kReach - 0.6 + 2.05 * kCrate * (i - 0.5 * n.y)));
      }
    }
  }
}

// ---- net

// A sheet of balls, each linked to its neighbours, that is held along one edge and swings down.
void buildJointGrid(Objects& o, Size n) {
  o.world().setGravity(kGravity);
  btSphereShape* ball = o.sphere(s(0.4));
  const auto index = [n](int x, int z) {
    return static_cast<size_t>(z) * static_cast<size_t>(n.x) + static_cast<size_t>(x);
  };
  for (int z = 0; z < n.z; ++z) {
    for (int x = 0; x < n.x; ++x) o.add(z == 0 ? 0 : 1, ball, placedAt(x - 0.5 * (n.x - 1), 0, z));
  }
  const auto link = [&o](btRigidBody* a, btRigidBody* b) {
    const btVector3 half = (b->getWorldTransform().getOrigin() - a->getWorldTransform().getOrigin()) / 2;
    o.joint<btPoint2PointConstraint>(true, *a, *b, half, -half);
  };
  const std::vector<btRigidBody*>& bodies = o.bodies();
  for (int z = 1; z < n.z; ++z) {
    for (int x = 0; x < n.x; ++x) {
      link(bodies[index(x, z - 1)], bodies[index(x, z)]);
      if (x > 0) link(bodies[index(x - 1, z)], bodies[index(x, z)]);
    }
  }
}

}  // namespace

std::vector<Scene> jointScenes() {
  return {
      {"bridge",
       "Z bridges of X planks on hinges, Y crates falling on each",
       {100, 20, 1},
       240,
       kStep,
       {10, 0, Rest::No, 0, 0, {"joints"}},
       buildBridge,
       {{100, 20, 24},
        120,
        [](int n) {
          return Size{100, 20, std::max(1, n / 120)};
        }}},
      {"ragdolls",
       "X by Y by Z ragdolls, in square layers, falling in a heap",
       {136, 1, 1},
       300,
       kStep,
       {10, 0, Rest::AsStock, 0.05, 0.01, {"joints"}},
       buildRagdolls,
       {{136, 1, 1},
        240,
        [](int n) {
          return Size{std::max(1, n / 11), 1, 1};
        }}},
      {"crane",
       "Z cranes that swing a load of 100 on a chain of X links of 1 through walls of Y by Y crates",
       {12, 4, 1},
       240,
       kStep,
       {10, 0, Rest::No, 0, 0.01, {"joints"}},
       buildCrane,
       {{12, 4, 32},
        120,
        [](int n) {
          return Size{12, 4, std::max(1, n / 31)};
        }}},
  };
}

std::vector<Scene> bigJointScenes() {
  return {
      {"joint_grid",
       "X by Z balls linked to their neighbours, held along one edge",
       {16, 1, 16},
       120,
       kStep,
       {10, -1e30, Rest::No, 0, 0, {"joints"}},
       buildJointGrid,
       {{100, 1, 100}, 120, square}},
  };
}

}  // namespace scenes
