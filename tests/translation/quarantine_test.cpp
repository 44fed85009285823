// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// NaN and infinity: the body is left out, nothing of it goes to the device, and it comes back once it is
// finite.
#include <functional>
#include <limits>

#include "tests/translation/reader_world.h"

namespace btgpu::test {
namespace {

struct Poison {
  const char* what;
  std::function<void(btRigidBody&, btScalar)> set;
};

const std::vector<Poison>& poisons() {
  static const std::vector<Poison> list = {
      {"position", [](btRigidBody& b, btScalar v) { b.getWorldTransform().setOrigin(btVector3(0, v, 0)); }},
      {"orientation", [](btRigidBody& b, btScalar v) { b.getWorldTransform().getBasis()[1][2] = v; }},
      {"linear velocity", [](btRigidBody& b, btScalar v) { b.setLinearVelocity(btVector3(0, 0, v)); }},
      {"angular velocity", [](btRigidBody& b, btScalar v) { b.setAngularVelocity(btVector3(v, 0, 0)); }},
      {"gravity", [](btRigidBody& b, btScalar v) { b.setGravity(btVector3(0, v, 0)); }},
      {"torque", [](btRigidBody& b, btScalar v) { b.applyTorque(btVector3(v, 0, 0)); }},
      {"inertia", [](btRigidBody& b, btScalar v) { b.setInvInertiaDiagLocal(btVector3(1, v, 1)); }},
      {"linear factor", [](btRigidBody& b, btScalar v) { b.setLinearFactor(btVector3(1, v, 1)); }},
      {"angular factor", [](btRigidBody& b, btScalar v) { b.setAngularFactor(btVector3(1, 1, v)); }},
      {"friction", [](btRigidBody& b, btScalar v) { b.setFriction(v); }},
      {"rolling friction", [](btRigidBody& b, btScalar v) { b.setRollingFriction(v); }},
      {"spinning friction", [](btRigidBody& b, btScalar v) { b.setSpinningFriction(v); }},
      {"restitution", [](btRigidBody& b, btScalar v) { b.setRestitution(v); }},
      {"contact damping", [](btRigidBody& b, btScalar v) { b.setContactStiffnessAndDamping(100, v); }},
      {"anisotropic friction", [](btRigidBody& b, btScalar v) { b.setAnisotropicFriction(btVector3(1, 1, v)); }},
  };
  return list;
}

// Everything that the device has, as floats.
void expectDeviceIsFinite(const ReaderWorld& w) {
  const auto finite = [](const float4& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z) && std::isfinite(v.w);
  };
  const WorldInput& d = w.device;
  for (std::uint32_t i = 0; i < d.infos.values.size(); ++i) {
    EXPECT_TRUE(finite(d.poses.values[i].position) && finite(d.poses.values[i].orientation)) << "pose " << i;
    EXPECT_TRUE(finite(d.velocities.values[i].linear) && finite(d.velocities.values[i].angular)) << "velocity " << i;
    EXPECT_TRUE(finite(d.forces.values[i].force) && finite(d.forces.values[i].torque)) << "forces " << i;
    const BodyMass& mass = d.masses.values[i];
    EXPECT_TRUE(finite(mass.inverseInertiaLocal) && finite(mass.linearFactor) && finite(mass.angularFactor)) << i;
    const BodyMaterial& m = d.materials.values[i];
    EXPECT_TRUE(finite({m.friction, m.rollingFriction, m.spinningFriction, m.restitution})) << "material " << i;
    EXPECT_TRUE(finite({m.contactStiffness, m.contactDamping, 0, 0}) && finite(m.anisotropicFriction)) << i;
    EXPECT_TRUE(finite({d.dampings.values[i].linear, d.dampings.values[i].angular, 0, 0})) << "damping " << i;
  }
}

void expectQuarantineAndReturn(const Poison& poison, btScalar value) {
  FourBodies w;
  const btVector3 place = w.bodies[1]->getWorldTransform().getOrigin();
  poison.set(*w.bodies[1], value);
  EXPECT_EQ(w.step(), (Upload{{"infos", {1}}})) << "nothing but the flag";
  EXPECT_TRUE(w.quarantined(w.bodies[1]));
  EXPECT_FALSE(w.quarantined(w.bodies[0]));
  EXPECT_TRUE(w.missing.empty()) << w.missingText();
  ASSERT_EQ(w.notes.entries().size(), 1u);
  EXPECT_EQ(w.notes.entries()[0].what, "body");
  EXPECT_EQ(w.notes.entries()[0].count, 1u);
  expectDeviceIsFinite(w);

  // Said once, and others are read as ever.
  poison.set(*w.bodies[1], value);
  w.bodies[2]->setFriction(s(0.125));
  EXPECT_EQ(w.step(), (Upload{{"materials", {2}}}));
  EXPECT_TRUE(w.notes.empty());

  // Whole again, elsewhere and with other values: all of it goes up, and the flag goes.
  poison.set(*w.bodies[1], s(0.5));
  btTransform transform = btTransform::getIdentity();
  transform.setOrigin(place + btVector3(0, 2, 0));
  w.bodies[1]->setWorldTransform(transform);
  w.bodies[1]->setDamping(s(0.25), 0);
  const Upload upload = w.step();
  EXPECT_FALSE(w.quarantined(w.bodies[1]));
  EXPECT_EQ(upload.at("infos"), (Slots{1}));
  EXPECT_EQ(upload.at("poses"), (Slots{1}));
  EXPECT_EQ(upload.at("dampings"), (Slots{1}));
  EXPECT_TRUE(w.notes.empty());

  poison.set(*w.bodies[1], value);
  w.step();
  EXPECT_EQ(w.notes.entries().size(), 1u) << "said again, for it is another time";
}

TEST(Quarantine, NaN) {
  for (const Poison& poison : poisons()) {
    SCOPED_TRACE(poison.what);
    expectQuarantineAndReturn(poison, std::numeric_limits<btScalar>::quiet_NaN());
  }
}

TEST(Quarantine, Infinity) {
  for (const Poison& poison : poisons()) {
    SCOPED_TRACE(poison.what);
    expectQuarantineAndReturn(poison, -std::numeric_limits<btScalar>::infinity());
  }
}

// Infinite stiffness is a hard contact, as in Bullet, and NaN is nothing.
TEST(Quarantine, StiffnessAndThresholdThatAreNaN) {
  FourBodies threshold;
  threshold.bodies[1]->setContactProcessingThreshold(std::numeric_limits<btScalar>::quiet_NaN());
  threshold.step();
  EXPECT_TRUE(threshold.quarantined(threshold.bodies[1]));
  FourBodies w;
  w.bodies[1]->setContactStiffnessAndDamping(std::numeric_limits<btScalar>::quiet_NaN(), 1);
  w.step();
  EXPECT_TRUE(w.quarantined(w.bodies[1]));
  expectDeviceIsFinite(w);
  FourBodies hard;
  hard.bodies[1]->setContactStiffnessAndDamping(std::numeric_limits<btScalar>::infinity(), 1);
  hard.step();
  EXPECT_FALSE(hard.quarantined(hard.bodies[1]));
}

TEST(Quarantine, ABodyThatIsBadFromTheStart) {
  FourBodies w;
  btRigidBody* bad = w.add(1, w.box, btVector3(0, 0, std::numeric_limits<btScalar>::quiet_NaN()));
  const Upload upload = w.step();
  EXPECT_EQ(upload.at("born"), (Slots{4}));
  EXPECT_TRUE(w.quarantined(bad));
  expectDeviceIsFinite(w);
  bad->getWorldTransform().setOrigin(btVector3(0, 20, 0));
  EXPECT_EQ(w.step().at("poses"), (Slots{4}));
  EXPECT_FALSE(w.quarantined(bad));
}

// Its index goes to a healthy body in the same step.
TEST(Quarantine, SlotOfABadBodyIsReused) {
  FourBodies w;
  w.bodies[1]->setLinearVelocity(btVector3(std::numeric_limits<btScalar>::quiet_NaN(), 0, 0));
  w.step();
  w.world.removeRigidBody(w.bodies[1]);
  btRigidBody* fresh = w.add(1, w.box, btVector3(3, 0, 0));
  w.step();
  EXPECT_EQ(w.slot(fresh), 1u);
  EXPECT_FALSE(w.quarantined(fresh));
  EXPECT_TRUE(w.notes.empty());
}

// A step in which the results of body 1 came out not finite.
void quarantineOnDevice(FourBodies& w) {
  w.read();
  StepResults results = w.unchangedResults();
  results.quarantined = {1};
  w.reader.acceptResults(results);
  w.device.infos.values[1].flags |= BODY_QUARANTINED;
}

TEST(Quarantine, OfTheDeviceLastsUntilTheBodyHasANewState) {
  const std::vector<std::pair<const char*, std::function<void(btRigidBody&)>>> states = {
      {"transform", [](btRigidBody& b) { b.getWorldTransform().setOrigin(btVector3(0, 9, 0)); }},
      {"velocity", [](btRigidBody& b) { b.setAngularVelocity(btVector3(0, 1, 0)); }}};
  for (const auto& [what, set] : states) {
    SCOPED_TRACE(what);
    FourBodies w;
    quarantineOnDevice(w);
    w.bodies[1]->setFriction(s(0.125));  // no new state
    w.reader.read(w.world, w.missing, w.notes);
    EXPECT_EQ(uploadOf(w.reader.input()), (Upload{{"materials", {1}}}));
    EXPECT_TRUE(w.reader.input().infos.values[1].flags & BODY_QUARANTINED);
    w.reader.acceptResults(w.unchangedResults());
    set(*w.bodies[1]);
    w.reader.read(w.world, w.missing, w.notes);
    EXPECT_EQ(uploadOf(w.reader.input()).at("infos"), (Slots{1}));
    EXPECT_FALSE(w.reader.input().infos.values[1].flags & BODY_QUARANTINED);
  }
}

// A body that leaves the world and comes back, or another one at its address, is a new body.
TEST(Quarantine, OfTheDeviceEndsWithTheBody) {
  FourBodies w;
  quarantineOnDevice(w);
  w.world.removeRigidBody(w.bodies[1]);
  w.world.addRigidBody(w.bodies[1]);
  w.reader.read(w.world, w.missing, w.notes);
  EXPECT_EQ(uploadOf(w.reader.input()).at("born"), (Slots{1}));
  EXPECT_FALSE(w.reader.input().infos.values[1].flags & BODY_QUARANTINED);

  FourBodies other;
  quarantineOnDevice(other);
  other.world.removeRigidBody(other.bodies[1]);
  btRigidBody* twin = other.add(1, other.box, btVector3(3, 0, 0));
  other.reader.read(other.world, other.missing, other.notes);
  EXPECT_EQ(other.slot(twin), 1u);
  EXPECT_FALSE(other.reader.input().infos.values[1].flags & BODY_QUARANTINED);
}

}  // namespace
}  // namespace btgpu::test
