// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Only what changed goes to the device: one entry of one array for one change of one body.
#include <functional>

#include "tests/translation/reader_world.h"
#include "translation/write_back_bodies.h"

namespace btgpu::test {
namespace {

TEST(Changes, NewBodiesGoUpOnce) {
  FourBodies w;
  EXPECT_EQ(w.first.at("infos"), (Slots{0, 1, 2, 3}));
  EXPECT_EQ(w.first.at("born"), (Slots{0, 1, 2, 3}));
  EXPECT_EQ(w.first.at("masses"), (Slots{0, 1, 2, 3}));
  EXPECT_EQ(w.first.at("poses"), (Slots{1, 2, 3})) << "slot 0 stands at the origin, as a fresh slot does";
  EXPECT_EQ(w.first.at("shapes"), (Slots{0, 1}));
}

TEST(Changes, AnUntouchedWorldUploadsNothing) {
  FourBodies w;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(w.step(), Upload{}) << i;
}

// Gravity is applied anew in each step, and is the same.
TEST(Changes, ConstantGravityIsNoChange) {
  FourBodies w;
  w.world.setGravity(btVector3(0, -10, 0));
  EXPECT_EQ(w.step(), (Upload{{"forces", {0, 1, 2, 3}}}));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(w.step(), Upload{}) << i;
}

struct Change {
  const char* what;
  std::vector<std::string> arrays;  // that it belongs to
  std::function<void(btRigidBody&)> apply;
};

const std::vector<Change>& changes() {
  static const std::vector<Change> list = {
      {"mass", {"masses"}, [](btRigidBody& b) { b.setMassProps(7, btVector3(1, 2, 3)); }},
      {"inertia", {"masses"}, [](btRigidBody& b) { b.setInvInertiaDiagLocal(btVector3(3, 2, 4)); }},
      {"linear factor", {"masses"}, [](btRigidBody& b) { b.setLinearFactor(btVector3(1, 0, 1)); }},
      {"angular factor", {"masses"}, [](btRigidBody& b) { b.setAngularFactor(btVector3(0, 1, 0)); }},
      {"position", {"poses"}, [](btRigidBody& b) { b.getWorldTransform().setOrigin(btVector3(5, 6, 7)); }},
      {"orientation",
       {"poses"},
       [](btRigidBody& b) {
         b.setWorldTransform(btTransform(btQuaternion(btVector3(0, 1, 0), s(0.5)), b.getWorldTransform().getOrigin()));
       }},
      {"centre of mass transform",
       {"poses"},
       [](btRigidBody& b) {
         b.setCenterOfMassTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 9, 0)));
       }},
      {"linear velocity", {"velocities"}, [](btRigidBody& b) { b.setLinearVelocity(btVector3(0, 1, 0)); }},
      {"angular velocity", {"velocities"}, [](btRigidBody& b) { b.setAngularVelocity(btVector3(0, 1, 0)); }},
      {"impulse", {"velocities"}, [](btRigidBody& b) { b.applyCentralImpulse(btVector3(1, 0, 0)); }},
      {"force", {"forces"}, [](btRigidBody& b) { b.applyCentralForce(btVector3(1, 0, 0)); }},
      {"torque", {"forces"}, [](btRigidBody& b) { b.applyTorque(btVector3(1, 0, 0)); }},
      {"its own gravity", {"forces"}, [](btRigidBody& b) { b.setGravity(btVector3(0, 1, 0)); }},
      {"friction", {"materials"}, [](btRigidBody& b) { b.setFriction(s(0.9)); }},
      {"rolling friction", {"materials"}, [](btRigidBody& b) { b.setRollingFriction(s(0.1)); }},
      {"spinning friction", {"materials"}, [](btRigidBody& b) { b.setSpinningFriction(s(0.1)); }},
      {"restitution", {"materials"}, [](btRigidBody& b) { b.setRestitution(s(0.3)); }},
      {"contact processing threshold", {"materials"}, [](btRigidBody& b) { b.setContactProcessingThreshold(s(0.01)); }},
      {"contact stiffness", {"infos", "materials"}, [](btRigidBody& b) { b.setContactStiffnessAndDamping(100, 1); }},
      {"anisotropic friction",
       {"infos", "materials"},
       [](btRigidBody& b) { b.setAnisotropicFriction(btVector3(1, 2, 3)); }},
      {"anisotropic rolling friction",
       {"infos", "materials"},
       [](btRigidBody& b) {
         b.setAnisotropicFriction(btVector3(1, 2, 3), btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION);
       }},
      {"linear damping", {"dampings"}, [](btRigidBody& b) { b.setDamping(s(0.2), 0); }},
      {"angular damping", {"dampings"}, [](btRigidBody& b) { b.setDamping(0, s(0.2)); }},
      {"sleeping thresholds", {"dampings"}, [](btRigidBody& b) { b.setSleepingThresholds(s(0.1), 2); }},
      {"no contact response",
       {"infos"},
       [](btRigidBody& b) { b.setCollisionFlags(b.getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE); }},
      {"kinematic",
       {"infos"},
       [](btRigidBody& b) { b.setCollisionFlags(b.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT); }},
      {"static",
       {"infos"},
       [](btRigidBody& b) { b.setCollisionFlags(b.getCollisionFlags() | btCollisionObject::CF_STATIC_OBJECT); }},
      {"gyroscopic, explicit", {"infos"}, [](btRigidBody& b) { b.setFlags(BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT); }},
      {"gyroscopic, world", {"infos"}, [](btRigidBody& b) { b.setFlags(BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD); }},
      {"not gyroscopic", {"infos"}, [](btRigidBody& b) { b.setFlags(0); }},
      {"filter group", {"infos"}, [](btRigidBody& b) { b.getBroadphaseHandle()->m_collisionFilterGroup = 64; }},
      {"filter mask", {"infos"}, [](btRigidBody& b) { b.getBroadphaseHandle()->m_collisionFilterMask = 3; }},
      {"activation state", {"activations"}, [](btRigidBody& b) { b.setActivationState(DISABLE_DEACTIVATION); }},
      {"deactivation time", {"activations"}, [](btRigidBody& b) { b.setDeactivationTime(s(0.5)); }},
      // What the device has no use for.
      {"user pointer", {}, [](btRigidBody& b) { b.setUserPointer(&b); }},
      {"user index", {}, [](btRigidBody& b) { b.setUserIndex(7); }},
      {"interpolation transform",
       {},
       [](btRigidBody& b) {
         b.setInterpolationWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 9, 0)));
       }},
      {"the same velocity again", {}, [](btRigidBody& b) { b.setLinearVelocity(b.getLinearVelocity()); }},
      {"the same transform again",
       {},
       [](btRigidBody& b) {
         const btTransform same = b.getWorldTransform();
         b.setWorldTransform(same);
       }},
  };
  return list;
}

TEST(Changes, OneChangeUploadsOneEntry) {
  for (const Change& change : changes()) {
    SCOPED_TRACE(change.what);
    for (const std::uint32_t slot : {0u, 2u, 3u}) {
      FourBodies w;
      change.apply(*w.bodies[slot]);
      Upload expected;
      for (const auto& array : change.arrays) expected[array] = {slot};
      EXPECT_EQ(w.step(), expected);
    }
  }
}

// Forces go with the step; everything else stays.
TEST(Changes, AChangeIsUploadedOnlyOnce) {
  for (const Change& change : changes()) {
    SCOPED_TRACE(change.what);
    FourBodies w;
    change.apply(*w.bodies[1]);
    w.step();
    const bool goesAway = change.what == std::string("force") || change.what == std::string("torque");
    EXPECT_EQ(w.step(), goesAway ? (Upload{{"forces", {1}}}) : Upload{});
    EXPECT_EQ(w.step(), Upload{});
  }
}

TEST(Changes, SeveralChangesAtOnce) {
  FourBodies w;
  w.bodies[3]->setFriction(s(0.1));
  w.bodies[0]->setFriction(s(0.2));
  w.bodies[0]->setFriction(s(0.3));
  w.bodies[2]->setLinearVelocity(btVector3(1, 0, 0));
  w.bodies[0]->setDamping(s(0.5), 0);
  EXPECT_EQ(w.step(), (Upload{{"materials", {0, 3}}, {"velocities", {2}}, {"dampings", {0}}}));
}

// Fields by their values, since all the tests above only compare what is read with what is read.
TEST(Changes, EveryFieldIsRead) {
  ReaderWorld w;
  auto* box = w.shape<btBoxShape>(btVector3(1, 2, 3));
  auto* ball = w.shape<btSphereShape>(s(0.25));
  btRigidBody::btRigidBodyConstructionInfo info(4, nullptr, box, btVector3(2, 4, 8));
  info.m_additionalDamping = true;
  info.m_additionalDampingFactor = s(0.5);
  info.m_additionalLinearDampingThresholdSqr = s(0.25);
  info.m_additionalAngularDampingThresholdSqr = s(0.125);
  info.m_linearSleepingThreshold = 3;
  info.m_angularSleepingThreshold = 5;
  btRigidBody body(info);
  w.add(1, ball, btVector3(0, 50, 0));
  w.world.addRigidBody(&body, 2, 5);
  body.setWorldTransform(btTransform(btQuaternion(s(0.5), s(0.5), s(0.5), s(0.5)), btVector3(1, 2, 3)));
  body.setLinearVelocity(btVector3(4, 5, 6));
  body.setAngularVelocity(btVector3(7, 8, 9));
  body.setLinearFactor(btVector3(1, 1, s(0.5)));
  body.setAngularFactor(btVector3(s(0.25), 1, 1));
  body.applyCentralForce(btVector3(10, 11, 12));
  body.applyTorque(btVector3(16, 14, 15));
  body.setFriction(s(0.25));
  body.setRollingFriction(s(0.5));
  body.setSpinningFriction(s(0.75));
  body.setRestitution(s(0.125));
  body.setContactStiffnessAndDamping(1000, 20);
  body.setContactProcessingThreshold(s(0.0625));
  body.setAnisotropicFriction(btVector3(1, 2, 4));
  body.setDamping(s(0.25), s(0.75));
  body.setActivationState(WANTS_DEACTIVATION);
  body.setDeactivationTime(s(1.5));
  w.read();
  ASSERT_EQ(w.slot(&body), 1u);
  const WorldInput& d = w.device;
  const auto expect4 = [](const float4& v, float x, float y, float z, float ww, const char* what) {
    EXPECT_TRUE(v.x == x && v.y == y && v.z == z && v.w == ww)
        << what << ": " << v.x << " " << v.y << " " << v.z << " " << v.w;
  };
  expect4(d.poses.values[1].position, 1, 2, 3, 0, "position");
  expect4(d.poses.values[1].orientation, 0.5f, 0.5f, 0.5f, 0.5f, "orientation");
  expect4(d.velocities.values[1].linear, 4, 5, 6, 0, "linear velocity");
  expect4(d.velocities.values[1].angular, 7, 8, 9, 0, "angular velocity");
  // Bullet multiplies with the factors when forces are applied.
  expect4(d.forces.values[1].force, 10, 11, 6, 0, "force");
  expect4(d.forces.values[1].torque, 4, 14, 15, 0, "torque");
  expect4(d.masses.values[1].inverseInertiaLocal, 0.5f, 0.25f, 0.125f, 0.25f, "inverse inertia and mass");
  expect4(d.masses.values[1].linearFactor, 1, 1, 0.5f, 0, "linear factor");
  expect4(d.masses.values[1].angularFactor, 0.25f, 1, 1, 0, "angular factor");
  const BodyMaterial& m = d.materials.values[1];
  expect4({m.friction, m.rollingFriction, m.spinningFriction, m.restitution}, 0.25f, 0.5f, 0.75f, 0.125f, "material");
  expect4({m.contactStiffness, m.contactDamping, m.contactProcessingThreshold, 0}, 1000, 20, 0.0625f, 0, "contact");
  expect4(m.anisotropicFriction, 1, 2, 4, 0, "anisotropic friction");
  const BodyDamping& g = d.dampings.values[1];
  expect4({g.linear, g.angular, g.linearSleepingThreshold, g.angularSleepingThreshold}, 0.25f, 0.75f, 3, 5, "damping");
  expect4({g.additionalFactor, g.additionalLinearThresholdSqr, g.additionalAngularThresholdSqr, 0}, 0.5f, 0.25f, 0.125f,
          0, "additional damping");
  const BodyInfo& i = d.infos.values[1];
  EXPECT_EQ(i.flags, BODY_PRESENT | BODY_RIGID | BODY_INTEGRATED | BODY_STIFFNESS | BODY_ANISOTROPIC |
                         BODY_ADDITIONAL_DAMPING | BODY_GYRO_IMPLICIT_BODY);
  EXPECT_EQ(i.filterGroup, 2);
  EXPECT_EQ(i.filterMask, 5);
  EXPECT_EQ(i.uniqueId, body.getBroadphaseHandle()->m_uniqueId);
  EXPECT_EQ(i.shapeIndex, 1);
  EXPECT_EQ(d.activations.values[1].state, STATE_WANTS_DEACTIVATION);
  EXPECT_EQ(d.activations.values[1].deactivationTime, 1.5f);
  w.world.removeRigidBody(&body);
}

// No mass: fixed for the solver, not integrated, and its gravity is no force.
TEST(Changes, BodiesWithoutMass) {
  ReaderWorld w;
  w.world.setGravity(btVector3(0, -10, 0));
  auto* box = w.shape<btBoxShape>(btVector3(1, 1, 1));
  btRigidBody* fixed = w.add(0, box, btVector3(0, 0, 0));
  btRigidBody* moving = w.add(1, box, btVector3(3, 0, 0));
  btRigidBody* plane = w.add(0, w.shape<btStaticPlaneShape>(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
  btCollisionObject plain;
  plain.setCollisionShape(box);
  w.world.addCollisionObject(&plain);
  w.step();
  EXPECT_TRUE(w.missing.empty()) << w.missingText();
  EXPECT_TRUE(w.notes.empty());
  const auto flags = [&w](const btCollisionObject* o) { return w.device.infos.values[w.slot(o)].flags; };
  EXPECT_EQ(flags(fixed), BODY_PRESENT | BODY_STATIC | BODY_RIGID | BODY_GYRO_IMPLICIT_BODY);
  EXPECT_EQ(flags(plane), BODY_PRESENT | BODY_STATIC | BODY_RIGID | BODY_GYRO_IMPLICIT_BODY);
  EXPECT_EQ(flags(moving), BODY_PRESENT | BODY_INTEGRATED | BODY_RIGID | BODY_GYRO_IMPLICIT_BODY);
  EXPECT_EQ(flags(&plain), BODY_PRESENT | BODY_STATIC);
  for (const btCollisionObject* object :
       {static_cast<btCollisionObject*>(fixed), static_cast<btCollisionObject*>(plane), &plain}) {
    const std::uint32_t slot = w.slot(object);
    const float4& inverse = w.device.masses.values[slot].inverseInertiaLocal;
    EXPECT_TRUE(inverse.x == 0 && inverse.y == 0 && inverse.z == 0 && inverse.w == 0) << slot;
    EXPECT_EQ(w.device.forces.values[slot].force.y, 0) << slot;
  }
  EXPECT_EQ(w.device.forces.values[w.slot(moving)].force.y, -10);
  // Mass that comes and goes while the body is in the world.
  moving->setMassProps(0, btVector3(0, 0, 0));
  const Upload upload = w.step();
  EXPECT_EQ(upload.count("masses"), 1u);
  EXPECT_EQ(upload.count("infos"), 1u);
  EXPECT_EQ(flags(moving) & BODY_STATIC, BODY_STATIC);
  EXPECT_EQ(w.device.masses.values[w.slot(moving)].inverseInertiaLocal.w, 0);
}

// What a step brought up is known on both sides: nothing of it goes down again.
TEST(Changes, ResultsOfAStepAreNoChanges) {
  FourBodies w;
  w.bodies[2]->forceActivationState(ISLAND_SLEEPING);
  for (int i = 0; i < 3; ++i) {
    SCOPED_TRACE(i);
    const Upload upload = w.read();
    if (i > 0) { EXPECT_EQ(upload, Upload{}); }
    StepResults results = w.unchangedResults();
    for (const size_t slot : {size_t(0), size_t(3)}) {
      results.poses[slot].position.y += 0.3f;
      // Some of these do not survive the way through Bullet's matrix bit by bit.
      const btQuaternion q(btVector3(1, 2, 3).normalized(), s(0.7 * (i + 1) + 0.1 * double(slot)));
      results.poses[slot].orientation = {float(q.x()), float(q.y()), float(q.z()), float(q.w())};
      results.velocities[slot].linear = {0.1f, 0.2f, float(i), 0};
      results.velocities[slot].angular = {0, 0.7f, 0, 0};
      results.activations[slot] = {STATE_WANTS_DEACTIVATION, 0.1f * float(i + 1)};
    }
    writeBackBodies(w.reader, results, s(1.0 / 60));
    w.reader.acceptResults(results);
    w.world.clearForces();
    EXPECT_EQ(float(w.bodies[0]->getLinearVelocity().z()), float(i));
    EXPECT_EQ(w.bodies[0]->getActivationState(), WANTS_DEACTIVATION);
    EXPECT_EQ(w.bodies[2]->getActivationState(), ISLAND_SLEEPING);
    // The stand-in moves along.
    w.device.poses.values = results.poses;
    w.device.velocities.values = results.velocities;
    w.device.activations.values = results.activations;
  }
  w.bodies[3]->setWorldTransform(btTransform::getIdentity());
  EXPECT_EQ(w.step(), (Upload{{"poses", {3}}}));
}

// What a step that changes nothing does to a body asleep, as stock does it to all bodies: it is done once, and again
// after the application has touched the body.
TEST(Changes, BodyAtRestIsLeftAlone) {
  FourBodies w;
  btRigidBody& body = *w.bodies[1];
  body.getWorldTransform().setRotation(btQuaternion(s(0.1), s(0.2), s(0.3), s(0.9)));
  body.forceActivationState(ISLAND_SLEEPING);
  const auto step = [&w] {
    w.read();
    const StepResults results = w.unchangedResults();
    writeBackBodies(w.reader, results, s(1.0 / 60));
    w.reader.acceptResults(results);
  };
  step();
  btTransform predicted;
  body.predictIntegratedTransform(s(1.0 / 60), predicted);
  ASSERT_TRUE(body.getInterpolationWorldTransform() == predicted);
  w.read();
  EXPECT_TRUE(w.reader.slots()[w.slot(&body)].resting);
  EXPECT_FALSE(w.reader.slots()[w.slot(w.bodies[0])].resting);
  const std::vector<std::pair<const char*, std::function<void()>>> touches = {
      {"interpolation", [&] { body.setInterpolationWorldTransform(btTransform::getIdentity()); }},
      {"hit fraction", [&] { body.setHitFraction(s(0.5)); }},
      {"transform", [&] { body.getWorldTransform().setOrigin(btVector3(9, 9, 9)); }},
      {"velocity", [&] { body.setLinearVelocity(btVector3(1, 0, 0)); }},
      {"no velocity", [&] { body.setLinearVelocity(btVector3(0, 0, 0)); }}};
  for (const auto& [what, touch] : touches) {
    SCOPED_TRACE(what);
    touch();
    step();
    body.predictIntegratedTransform(s(1.0 / 60), predicted);
    EXPECT_TRUE(body.getInterpolationWorldTransform() == predicted);
    EXPECT_EQ(body.getHitFraction(), s(1));
    step();
    EXPECT_TRUE(body.getInterpolationWorldTransform() == predicted);
    w.read();
    EXPECT_EQ(w.reader.slots()[w.slot(&body)].resting, std::string(what) != "velocity");
  }
}

}  // namespace
}  // namespace btgpu::test
