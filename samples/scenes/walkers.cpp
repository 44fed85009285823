// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What walks: characters moved by Bullet's own controller, and machines with six legs moved by motors.
#include <BulletDynamics/Character/btKinematicCharacterController.h>

#include <cmath>

#include "parts.h"

namespace scenes {
namespace {

constexpr double kTurn = 6.283185307179586;

// ---- characters

struct Walk {
  double until;  // seconds
  btVector3 velocity;
  bool jump;  // as soon as it can
};

// Up the stairs, on over the crates, a jump, a turn and back.
void follow(Objects& o, btKinematicCharacterController* character, double stepsLong) {
  const double speed = 2, there = stepsLong / speed;
  const std::vector<Walk> walks = {{0.3, {0, 0, 0}, false},
                                   {0.3 + there, {s(speed), 0, 0}, false},
                                   {1.3 + there, {s(speed), 0, s(0.5)}, true},
                                   {2.0 + there, {0, 0, s(-speed)}, false},
                                   {1e30, {s(-speed), 0, s(0.3)}, false}};
  o.beforeSubsteps([character, walks, time = 0.0, now = size_t{0}](btScalar timeStep) mutable {
    while (time >= walks[now].until) ++now;
    time += double(timeStep);
    // The controller goes so far in each substep, however long that is.
    character->setWalkDirection(walks[now].velocity * timeStep);
    if (walks[now].jump && character->canJump()) character->jump(btVector3(0, 4, 0));
  });
}

// X stairs up to a platform, a crate in the way on every other one, and Y crates on the platform; Z of these and a
// character before each.
void buildCharacter(Objects& o, Size n) {
  constexpr double kRise = 0.2, kTread = 0.7, kApart = 4;
  const double stairs = kTread * n.x, top = kRise * n.x;
  addFloor(o, stairs + 20, kApart * n.z + 10);
  btConvexShape* figure = o.capsule(s(0.35), s(1));
  btBoxShape* crate = o.box(btVector3(s(0.15), s(0.15), s(0.15)));
  for (int k = 0; k < n.z; ++k) {
    const double z = kApart * (k - 0.5 * (n.z - 1));
    for (int i = 0; i < n.x; ++i) {
      const double height = kRise * (i + 1), x = kTread * (i + 0.5);
      o.add(0, o.box(btVector3(s(kTread / 2), s(height / 2), s(1.8))), placedAt(x, height / 2, z));
      if (i % 2) o.add(2, crate, placedAt(x, height + 0.2, z + 0.3));
    }
    o.add(0, o.box(btVector3(4, s(top / 2), s(1.8))), placedAt(stairs + 4, top / 2, z));
    for (int y = 0; y < n.y; ++y) {
      o.add(2, crate, placedAt(stairs + 1 + 0.6 * (y / 2), top + 0.16 + 0.31 * (y % 2), z + (y % 4 < 2 ? 0.4 : -0.2)));
    }
    follow(o, o.character(figure, 0.3, btVector3(s(-1.5), s(0.9), s(z))), stairs + 1.5);
  }
}

// ---- six legs

struct Leg {
  btHingeConstraint *hip, *knee;
};

// A round trunk with six legs around it, each of a thigh that stands out and a shin that hangs down, by two hinges
// about the same level axis across the leg.
std::vector<Leg> addHexapod(Objects& o, const btVector3& at) {
  constexpr double kTrunk = 0.4, kThigh = 0.5, kShin = 0.6;
  const auto stiff = [](btRigidBody* body) {
    body->setDamping(s(0.05), s(0.85));
    body->setActivationState(DISABLE_DEACTIVATION);  // motors don't wake what sleeps
    body->setFriction(s(0.9));
    return body;
  };
  const btTransform middle(btQuaternion::getIdentity(), at);
  btRigidBody* trunk = stiff(o.add(4, o.capsule(s(kTrunk), s(0.1)), middle));
  btCollisionShape* thighShape = o.shape<btCapsuleShapeX>(s(0.08), s(kThigh - 0.16));
  btCollisionShape* shinShape = o.capsule(s(0.07), s(kShin));
  std::vector<Leg> legs;
  for (int i = 0; i < 6; ++i) {
    const btTransform out =
        middle * btTransform(btQuaternion(btVector3(0, 1, 0), s(kTurn * i / 6)), btVector3(0, 0, 0));
    const double hipX = kTrunk + 0.1, kneeX = hipX + kThigh;
    btRigidBody* thigh = stiff(o.add(1, thighShape, out * placedAt(hipX + kThigh / 2, 0, 0)));
    btRigidBody* shin = stiff(o.add(1, shinShape, out * placedAt(kneeX, -kShin / 2, 0)));
    btHingeConstraint* hip = addHinge(o, *trunk, *thigh, out * placedAt(hipX, 0, 0));
    btHingeConstraint* knee = addHinge(o, *thigh, *shin, out * placedAt(kneeX, 0, 0));
    hip->setLimit(s(-0.6), s(0.5));
    knee->setLimit(s(-0.6), s(0.6));
    legs.push_back({hip, knee});
  }
  return legs;
}

// At a constant pace from where the joint is to where it should be at the end of the substep.
void drive(btHingeConstraint* hinge, double angle, btScalar timeStep) {
  constexpr double kStrength = 20;  // N m
  hinge->enableAngularMotor(true, (s(angle) - hinge->getHingeAngle()) / timeStep, s(kStrength) * timeStep);
}

// Neighbouring legs take turns.
void walk(Objects& o, const std::vector<Leg>& legs, double phase) {
  constexpr double kPeriod = 1.2;
  o.beforeSubsteps([legs, phase, time = 0.0](btScalar timeStep) mutable {
    time += double(timeStep);
    for (size_t i = 0; i < legs.size(); ++i) {
      const double a = kTurn * (time / kPeriod + phase + 0.5 * static_cast<double>(i % 2));
      drive(legs[i].hip, 0.3 * std::sin(a) - 0.1, timeStep);
      drive(legs[i].knee, 0.4 * std::cos(a), timeStep);
    }
  });
}

void buildHexapod(Objects& o, Size n) {
  constexpr double kPitch = 3.6;
  addFloor(o, kPitch * n.x / 2 + 20, kPitch * n.z / 2 + 20);
  for (int y = 0; y < n.y; ++y) {
    for (int x = 0; x < n.x; ++x) {
      for (int z = 0; z < n.z; ++z) {
        const btVector3 at(s(kPitch * (x - 0.5 * (n.x - 1))), s(0.8 + 1.5 * y), s(kPitch * (z - 0.5 * (n.z - 1))));
        walk(o, addHexapod(o, at), 0.13 * (x + y + z));
      }
    }
  }
}

}  // namespace

std::vector<Scene> walkerScenes() {
  return {
      {"character",
       "Z characters that climb X stairs with crates on them and walk through Y more",
       {8, 8, 3},
       360,
       kStep,
       {30, 0, Rest::No, 0, 0, {"actions"}},
       buildCharacter,
       {{8, 8, 64}, 120, nullptr}},
      {"hexapod",
       "X by Y by Z machines on six legs, whose twelve hinges have motors with a sinusoidal schedule",
       {3, 1, 3},
       240,
       kStep,
       {10, 0, Rest::No, 0, 0, {"joints"}},
       buildHexapod,
       {{16, 1, 16},
        120,
        [](int n) {
          return Size{root(n / 13.0, 2), 1, root(n / 13.0, 2)};
        }}},
  };
}

}  // namespace scenes
