// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "gpu_engine/stages/65_prepare_contacts.h"

#include <cmath>
#include <limits>

#include "gpu_engine/stages/65_prepare_contacts_reference.h"
#include "gpu_engine/stages/reference_maths.h"
#include "kernels/lib/vec.h"
#include "tests/support/bullet_contacts.h"
#include "tests/support/contact_scene.h"
#include "tests/support/device_test.h"

namespace btgpu {
namespace {

using reference::cross;
using reference::dot;
using reference::length;
using reference::toVec;
using reference::Vec;

// What stage 65 writes, as it lies on the device.
using Prepared = PrepareReference;

class PrepareContactsTest : public DeviceTest {
 protected:
  // Runs the stage with poison where it writes rows.
  Prepared device(StageBench& bench) {
    DeviceWorld& world = bench.world();
    bench.poison(world.rows);
    bench.poison(world.solverBodies);
    bench.poison(world.solverMasses);
    if (!world.tangent2.empty()) bench.poison(world.tangent2);
    if (!world.torsion.empty()) bench.poison(world.torsion);
    bench.run<PrepareContacts>();
    Prepared out;
    out.solverBodies = bench.read(world.solverBodies, world.bodyCount);
    out.solverMasses = bench.read(world.solverMasses, world.bodyCount);
    out.manifolds = bench.read(world.manifolds);
    out.rows = bench.read(world.rows);
    out.tangent2 = bench.read(world.tangent2);
    out.torsion = bench.read(world.torsion);
    return out;
  }

  // The reference, with the same poison to begin with.
  static Prepared reference(const PrepareInput& in, const ContactScene& scene, const Prepared& like) {
    Prepared out;
    float poison;
    std::memset(&poison, StageBench::kPoison, sizeof poison);
    out.manifolds = scene.manifolds;
    out.rows.assign(like.rows.size(), poison);
    out.tangent2.assign(like.tangent2.size(), poison);
    out.torsion.assign(like.torsion.size(), poison);
    prepareContactsReference(in, out);
    return out;
  }

  void expectAsReference(const ContactScene& scene) {
    const auto bench = benchForContacts(queue(), scene);
    const PrepareInput in = prepareInput(*bench, scene);
    const Prepared actual = device(*bench), expected = reference(in, scene, actual);
    Contract contract("65_prepare_contacts");
    checkPreparedContacts(contract, in, scene.manifolds, actual, expected);
    EXPECT_TRUE(contract.ok()) << contract.text();
    std::vector<char> written(actual.rows.size(), 0);
    for (size_t slot = 0; slot < in.slots.size(); ++slot) {
      for (uint k = 0; k < in.slots[slot].pointCount; ++k) {
        for (size_t f = 0; f < POINT_FIELDS; ++f) written[rowIndex(slot, SLOT_FIELDS, k * POINT_FIELDS + f)] = 1;
      }
    }
    for (size_t i = 0; i < written.size(); ++i) {
      if (written[i]) continue;
      ASSERT_TRUE(StageBench::isPoison(actual.rows[i])) << "float " << i << " of the rows";
    }
  }
};

// ---- by hand: one sphere of mass 1 and radius 1 on a static one, the contact straight below

struct OneContact {
  ContactScene scene;
  uint sphere, ground;

  OneContact() {
    const int shape = scene.builder.sphere(1);
    sphere = scene.builder.add(shape, {0, 1, 0, 0}, 1);
    ground = scene.builder.add(shape, {0, -1, 0, 0}, 0);
    scene.addPoint(scene.addManifold(sphere, ground), {0, 1, 0, 0}, -0.01f, {0, -1, 0, 0}, {0, 1, 0, 0});
  }
  ContactPoint& point() { return scene.manifolds[0].points[0]; }
  BodyVelocity& velocity() { return scene.builder.velocity(sphere); }
};

class OneContactTest : public PrepareContactsTest {
 protected:
  // The row of the contact, checked against the reference as well.
  std::vector<float> rows(const OneContact& c) {
    expectAsReference(c.scene);
    const auto bench = benchForContacts(queue(), c.scene);
    const Prepared out = device(*bench);
    m_point = out.manifolds[0].points[0];
    std::vector<float> fields;
    for (size_t f = 0; f < POINT_FIELDS; ++f) fields.push_back(out.rows[rowIndex(0, SLOT_FIELDS, f)]);
    return fields;
  }
  ContactPoint m_point;
};

TEST_F(OneContactTest, RestingSmall) {
  OneContact c;
  const auto r = rows(c);
  EXPECT_EQ(r[ROW_NORMAL_JAC], 1);
  EXPECT_FLOAT_EQ(r[ROW_NORMAL_RHS], 0.01f * 0.2f * 60);  // depth * erp / dt
  EXPECT_EQ(r[ROW_PUSH_RHS], 0);
  // Without slip the directions come from btPlaneSpace1. r x t and the inertia 0.4: 1 + 1 / 0.4.
  EXPECT_EQ(r[ROW_TANGENT1], -1);
  EXPECT_FLOAT_EQ(r[ROW_TANGENT1_JAC], 1 / 3.5f);
  EXPECT_EQ(r[ROW_TANGENT1_RHS], 0);
}

TEST_F(OneContactTest, GapSmall) {
  OneContact c;
  c.point().localPointA.w = 0.01f;
  EXPECT_FLOAT_EQ(rows(c)[ROW_NORMAL_RHS], -0.01f * 60) << "may approach by the gap";
  c.scene.settings.linearSlop = 0.01f;
  EXPECT_FLOAT_EQ(rows(c)[ROW_NORMAL_RHS], -0.02f * 60);
  c.point().localPointA.w = -0.01f;
  EXPECT_EQ(rows(c)[ROW_NORMAL_RHS], 0);
}

TEST_F(OneContactTest, ForcesSmall) {
  OneContact c;
  c.scene.builder.forces(c.sphere).force = {0, -6, 0, 0};
  c.point().localPointA.w = 0;
  EXPECT_FLOAT_EQ(rows(c)[ROW_NORMAL_RHS], 0.1f);
}

// A torque turns the sphere in this step: it counts for the normal row of a contact off centre, and for the
// choice of the friction direction, but not for the friction row itself.
TEST_F(OneContactTest, TorqueIsNoFrictionSmall) {
  OneContact c;
  c.scene.builder.forces(c.sphere).torque = {0, 0, 24, 0};  // z spin of 24 / 0.4 / 60 = 1: the contact moves along +x
  const auto r = rows(c);
  EXPECT_FLOAT_EQ(r[ROW_TANGENT1], 1);
  EXPECT_EQ(r[ROW_TANGENT1_RHS], 0);
  c.velocity().angular = {0, 0, 1, 0};
  EXPECT_FLOAT_EQ(rows(c)[ROW_TANGENT1_RHS], -1 / 3.5f);
}

TEST_F(OneContactTest, RestitutionSmall) {
  OneContact c;
  c.point().localPointA.w = 0;
  c.point().combined.y = 0.5f;
  c.scene.settings.restitutionVelocityThreshold = 0.25f;
  const struct {
    float speed, rhs;
  } cases[] = {{-2, 3}, {-0.25f, 0.375f}, {-0.249f, 0.249f}, {0.249f, -0.249f}, {2, -2}};
  for (const auto& k : cases) {
    c.velocity().linear = {0, k.speed, 0, 0};
    EXPECT_FLOAT_EQ(rows(c)[ROW_NORMAL_RHS], k.rhs) << "at " << k.speed;
  }
}

TEST_F(OneContactTest, SplitImpulseSmall) {
  OneContact c;
  c.velocity().linear = {0, -1, 0, 0};
  const float depths[] = {0.03125f, 0.0625f, 0.125f};
  c.scene.settings.splitImpulsePenetrationThreshold = -0.0625f;
  for (const bool on : {false, true}) {
    c.scene.settings.splitImpulse = on;
    for (const float depth : depths) {
      c.point().localPointA.w = -depth;
      const auto r = rows(c);
      const bool split = on && depth >= 0.0625f;
      EXPECT_FLOAT_EQ(r[ROW_NORMAL_RHS], split ? 1 : 1 + depth * 12) << "depth " << depth;
      EXPECT_FLOAT_EQ(r[ROW_PUSH_RHS], split ? depth * 12 : 0) << "depth " << depth;
    }
  }
}

TEST_F(OneContactTest, SoftContactSmall) {
  OneContact c;
  c.scene.settings.globalCfm = 0.01f;
  const auto stiff = rows(c);
  EXPECT_FLOAT_EQ(stiff[ROW_NORMAL_JAC], 1 / 1.6f);
  EXPECT_FLOAT_EQ(stiff[ROW_NORMAL_CFM], 0.6f / 1.6f);
  c.point().flags = POINT_STIFFNESS_DAMPING;
  c.point().combinedStiffness = 600;  // dt * k = 10
  c.point().combinedDamping = 30;
  const auto soft = rows(c);
  EXPECT_FLOAT_EQ(soft[ROW_NORMAL_JAC], 1 / 2.5f);  // cfm = 1 / 40 * 60
  EXPECT_FLOAT_EQ(soft[ROW_NORMAL_CFM], 1.5f / 2.5f);
  EXPECT_FLOAT_EQ(soft[ROW_NORMAL_RHS], 0.01f * 0.25f * 60 / 2.5f);
  c.point().combinedStiffness = c.point().combinedDamping = 0;
  rows(c);  // as the reference: limited by Bullet's epsilon
}

TEST_F(OneContactTest, RelaxationAndWarmStartSmall) {
  OneContact c;
  c.scene.settings.sor = 0.5f;
  c.point().localPointB.w = 2;
  const auto r = rows(c);
  EXPECT_EQ(r[ROW_NORMAL_JAC], 0.5f);
  EXPECT_FLOAT_EQ(r[ROW_TANGENT1_JAC], 0.5f / 3.5f);
  EXPECT_FLOAT_EQ(r[ROW_NORMAL_IMPULSE], 1.7f);
  c.scene.settings.warmStarting = false;
  EXPECT_EQ(rows(c)[ROW_NORMAL_IMPULSE], 0);
}

TEST_F(OneContactTest, ProcessingThresholdSmall) {
  OneContact c;
  c.velocity().linear = {1, 0, 0, 0};
  c.point().localPointB.w = 2;
  c.scene.manifolds[0].processingThreshold = -0.01f;
  EXPECT_EQ(rows(c)[ROW_NORMAL_JAC], 1) << "on the threshold";
  EXPECT_EQ(m_point.lateralFrictionDir1.x, 1);
  c.scene.manifolds[0].processingThreshold = -0.011f;
  const auto r = rows(c);
  EXPECT_EQ(r[ROW_NORMAL_JAC], 0);
  EXPECT_EQ(r[ROW_NORMAL_IMPULSE], 0);
  EXPECT_EQ(m_point.lateralFrictionDir1.x, 0) << "the point is left alone";
}

// Bullet solves no contact in which neither body can be pushed, be it turned or not.
TEST_F(OneContactTest, NothingToPushSmall) {
  OneContact c;
  c.scene.builder.mass(c.sphere).linearFactor = {0, 0, 0, 0};
  EXPECT_EQ(rows(c)[ROW_NORMAL_JAC], 0);
  c.scene.builder.mass(c.sphere).linearFactor = {0, 0, 1, 0};
  EXPECT_EQ(rows(c)[ROW_NORMAL_JAC], 1);
  c.scene.builder.mass(c.sphere).linearFactor = {1, 1, 1, 0};
  c.scene.builder.mass(c.sphere).inverseInertiaLocal.w = 1e-7f;
  EXPECT_EQ(rows(c)[ROW_NORMAL_JAC], 1e7f) << "heavy, but not beyond Bullet's epsilon";
  c.scene.builder.mass(c.sphere).inverseInertiaLocal.w = 6e-8f;
  EXPECT_EQ(rows(c)[ROW_NORMAL_JAC], 0);
}

TEST_F(OneContactTest, KinematicGroundSmall) {
  OneContact c;
  c.scene.builder.info(c.ground).flags = BODY_PRESENT | BODY_RIGID | BODY_KINEMATIC;
  c.scene.builder.velocity(c.ground) = {{3, 2, 0, 0}, {0, 0, 0, 0}};
  c.point().localPointA.w = 0;
  const auto r = rows(c);
  EXPECT_EQ(r[ROW_NORMAL_JAC], 1);
  EXPECT_FLOAT_EQ(r[ROW_NORMAL_RHS], 2);
  EXPECT_EQ(r[ROW_TANGENT1], -1);
  EXPECT_FLOAT_EQ(r[ROW_TANGENT1_RHS], -3 / 3.5f);
  // A static body's velocity counts for nothing.
  c.scene.builder.info(c.ground).flags = BODY_PRESENT | BODY_RIGID | BODY_STATIC;
  EXPECT_EQ(rows(c)[ROW_NORMAL_RHS], 0);
}

// Bullet fixes the directions for good only if there are two that do not depend on the slip.
TEST_F(OneContactTest, DirectionsForGoodSmall) {
  for (uint bits = 0; bits < 8; ++bits) {
    OneContact c;
    c.scene.settings.twoFrictionDirections = bits & 1;
    c.scene.settings.velocityDependentFriction = bits & 2;
    if (bits & 4) c.velocity().linear = {1, 0, 0, 0};
    rows(c);
    EXPECT_EQ(m_point.flags, (bits & 3) == 1 ? POINT_LATERAL_FRICTION_INITIALIZED : 0) << "case " << bits;
  }
}

// A body that is not finite gets rows of zeros: it can't push its neighbours.
TEST_F(OneContactTest, NotFiniteSmall) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    OneContact c;
    c.point().localPointB.w = 2;
    c.velocity().linear.y = bad;
    const auto bench = benchForContacts(queue(), c.scene);
    const Prepared out = device(*bench);
    for (const size_t f : {ROW_NORMAL_JAC, ROW_NORMAL_RHS, ROW_NORMAL_IMPULSE, ROW_PUSH_RHS}) {
      EXPECT_EQ(out.rows[rowIndex(0, SLOT_FIELDS, f)], 0) << "field " << f;
    }
  }
}

TEST_F(OneContactTest, NothingAfterOverflowSmall) {
  const OneContact c;
  const auto bench = benchForContacts(queue(), c.scene);
  StepCounters counters = bench->counters();
  counters.overflow = OVERFLOW_PAIRS;
  bench->setCounters(counters);
  const Prepared out = device(*bench);
  EXPECT_TRUE(StageBench::isPoison(out.rows[0]));
  EXPECT_TRUE(StageBench::isPoison(out.solverBodies[0]));
}

// ---- random

// All combinations of the settings that choose friction directions.
std::vector<StepSettings> frictionSettings() {
  std::vector<StepSettings> all;
  for (uint bits = 0; bits < 8; ++bits) {
    StepSettings s;
    s.twoFrictionDirections = bits & 1;
    s.frictionDirectionCaching = bits & 2;
    s.velocityDependentFriction = bits & 4;
    all.push_back(s);
  }
  return all;
}

StepSettings otherSettings() {
  StepSettings s;
  s.timeStep = 1.0f / 100;
  s.erp2 = 0.35f;
  s.globalCfm = 1e-3f;
  s.sor = 0.8f;
  s.linearSlop = 0.005f;
  s.splitImpulsePenetrationThreshold = -0.02f;
  s.warmStartingFactor = 0.5f;
  s.restitutionVelocityThreshold = 1;
  s.twoFrictionDirections = true;
  return s;
}

TEST_F(PrepareContactsTest, RandomSmall) {
  std::mt19937 random(1);
  ContactScene scene = randomContacts(random, {16, 24});
  for (const auto& settings : {frictionSettings()[1], otherSettings()}) {
    scene.settings = settings;
    expectAsReference(scene);
  }
}

TEST_F(PrepareContactsTest, Random) {
  std::mt19937 random(2);
  for (const auto& settings : frictionSettings()) {
    ContactScene scene = randomContacts(random, {300, 500});
    scene.settings = settings;
    expectAsReference(scene);
    scene.torsionRows = false;
    scene.settings = otherSettings();
    expectAsReference(scene);
  }
}

// What the CPU shape prepares many slots at a time for: one direction along the slip, no torsional rows, and few
// anisotropic bodies, so that there are blocks of slots with such a body and without.
ContactScene usualContacts(std::mt19937& random, uint bodies, uint manifolds) {
  ContactScene scene = randomContacts(random, {bodies, manifolds});
  scene.torsionRows = false;
  for (uint i = 0; i < bodies; ++i) {
    if (i % 60 != 7) scene.builder.info(i).flags &= ~BODY_ANISOTROPIC;
  }
  return scene;
}

// Every second body at rest: contacts between two of them have no slip to follow.
void layToRest(ContactScene& scene, uint bodies) {
  for (uint i = 0; i < bodies; i += 2) {
    scene.builder.velocity(i) = {};
    scene.builder.forces(i) = {};
  }
}

TEST_F(PrepareContactsTest, UsualSmall) {
  std::mt19937 random(3);
  ContactScene scene = usualContacts(random, 16, 24);
  layToRest(scene, 16);
  expectAsReference(scene);
}

TEST_F(PrepareContactsTest, Usual) {
  std::mt19937 random(4);
  for (const bool warmStarting : {true, false}) {
    ContactScene scene = usualContacts(random, 300, 500);
    if (!warmStarting) layToRest(scene, 300);
    scene.settings.warmStarting = warmStarting;
    expectAsReference(scene);
    scene.settings = otherSettings();
    scene.settings.twoFrictionDirections = false;
    scene.settings.warmStarting = warmStarting;
    expectAsReference(scene);
  }
}

// ---- Bullet

// The rows that Bullet's own solver makes of the same bodies and manifolds, put where the device has them.
class PrepareAsBullet : public PrepareContactsTest {
 protected:
  void expectAsBullet(ContactScene scene) {
    // The host notes a motion only where Bullet asks for it.
    for (Manifold& m : scene.manifolds) {
      if (scene.settings.frictionDirectionCaching) break;
      for (ContactPoint& p : m.points) p.flags &= ~POINT_MOTION;
    }
    const auto bench = benchForContacts(queue(), scene);
    const PrepareInput in = prepareInput(*bench, scene);
    const Prepared actual = device(*bench);
    Prepared expected = reference(in, scene, actual);
    BulletContacts bullet(scene);
    bullet.setup();
    size_t solved = 0;
    for (size_t slot = 0; slot < in.slots.size(); ++slot) {
      for (uint k = 0; k < in.slots[slot].pointCount; ++k) {
        const int row = bullet.rowOf(in.slots[slot].manifold, static_cast<int>(k));
        EXPECT_EQ(row >= 0, actual.rows[rowIndex(slot, SLOT_FIELDS, k * POINT_FIELDS + ROW_NORMAL_JAC)] != 0);
        if (row >= 0) overwrite(bullet, scene, expected, slot, in.slots[slot].manifold, k, row);
        solved += row >= 0;
        if (HasFailure()) return;
      }
    }
    Contract contract("65_prepare_contacts, as Bullet");
    checkPreparedContacts(contract, in, scene.manifolds, actual, expected);
    EXPECT_TRUE(contract.ok()) << contract.text();
    EXPECT_GT(solved, scene.manifolds.size());
  }

  // Puts Bullet's rows of one point into the reference's place.
  static void overwrite(BulletContacts& bullet, const ContactScene& scene, Prepared& out, size_t slot, size_t manifold,
                        uint k, int row) {
    const auto put = [&](std::vector<float>& array, size_t fields, size_t field, float value) {
      array[rowIndex(slot, fields, field)] = value;
    };
    const btSolverConstraint& c = bullet.solver().contacts()[row];
    const size_t first = k * POINT_FIELDS;
    put(out.rows, SLOT_FIELDS, first + ROW_NORMAL_JAC, c.m_jacDiagABInv);
    put(out.rows, SLOT_FIELDS, first + ROW_NORMAL_RHS, c.m_rhs);
    put(out.rows, SLOT_FIELDS, first + ROW_NORMAL_CFM, c.m_cfm);
    put(out.rows, SLOT_FIELDS, first + ROW_NORMAL_IMPULSE, c.m_appliedImpulse);
    put(out.rows, SLOT_FIELDS, first + ROW_PUSH_RHS, c.m_rhsPenetration);
    put(out.rows, SLOT_FIELDS, first + ROW_FRICTION, c.m_friction);
    const btSolverConstraint& t1 = bullet.solver().friction()[c.m_frictionIndex];
    put(out.rows, SLOT_FIELDS, first + ROW_TANGENT1_JAC, t1.m_jacDiagABInv);
    put(out.rows, SLOT_FIELDS, first + ROW_TANGENT1_RHS, t1.m_rhs);
    const btManifoldPoint& cp = bullet.point(manifold, static_cast<int>(k));
    ContactPoint& p = out.manifolds[manifold].points[k];
    p.flags = cp.m_contactPointFlags | (p.flags & POINT_MOTION);
    for (int i = 0; i < 3; ++i) {
      put(out.rows, SLOT_FIELDS, first + ROW_TANGENT1 + static_cast<size_t>(i), cp.m_lateralFrictionDir1[i]);
    }
    const btVector3 &d1 = cp.m_lateralFrictionDir1, &d2 = cp.m_lateralFrictionDir2;
    p.lateralFrictionDir1 = {d1.x(), d1.y(), d1.z(), p.lateralFrictionDir1.w};
    p.lateralFrictionDir2 = {d2.x(), d2.y(), d2.z(), 0};
    if (scene.settings.twoFrictionDirections) {
      const btSolverConstraint& t2 = bullet.solver().friction()[c.m_frictionIndex + 1];
      put(out.tangent2, SLOT_TANGENT2_FIELDS, k * TANGENT2_FIELDS + ROW_TANGENT2_JAC, t2.m_jacDiagABInv);
      put(out.tangent2, SLOT_TANGENT2_FIELDS, k * TANGENT2_FIELDS + ROW_TANGENT2_RHS, t2.m_rhs);
    }
    overwriteTorsion(bullet, out, slot, k, row);
  }

  static void overwriteTorsion(const BulletContacts& bullet, Prepared& out, size_t slot, uint k, int row) {
    size_t r = 0;
    for (int i = 0; i < bullet.solver().torsion().size(); ++i) {
      const btSolverConstraint& t = bullet.solver().torsion()[i];
      if (t.m_frictionIndex != row) continue;
      const size_t first = (k * TORSION_ROWS + r++) * TORSION_FIELDS;
      const auto put = [&](size_t field, float value) {
        out.torsion[rowIndex(slot, SLOT_TORSION_FIELDS, first + field)] = value;
      };
      for (int axis = 0; axis < 3; ++axis) {
        put(ROW_TORSION_AXIS + static_cast<size_t>(axis), t.m_relpos2CrossNormal[axis]);
      }
      put(ROW_TORSION_JAC, t.m_jacDiagABInv);
      put(ROW_TORSION_RHS, t.m_rhs);
      put(ROW_TORSION_FRICTION, t.m_friction);
    }
    EXPECT_TRUE(r == 0 || r == TORSION_ROWS);
  }
};

TEST_F(PrepareAsBullet, RandomSmall) {
  std::mt19937 random(3);
  ContactScene scene = randomContacts(random, {16, 24});
  expectAsBullet(scene);
}

TEST_F(PrepareAsBullet, Random) {
  std::mt19937 random(4);
  for (const auto& settings : frictionSettings()) {
    ContactScene scene = randomContacts(random, {200, 300});
    scene.settings = settings;
    expectAsBullet(scene);
    scene.settings = otherSettings();
    expectAsBullet(scene);
  }
}

}  // namespace
}  // namespace btgpu
