// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Contact rows, twice over: against what they mean, computed in double precision from masses, arms and
// velocities, and against the rows that Bullet's own solver sets up for the same bodies.
#include "kernels/lib/rows.h"

#include <memory>
#include <set>
#include <vector>

#include "tests/lib/bullet_values.h"

namespace btgpu {
namespace {

// One body of a row in double precision.
struct End {
  double inverseMass = 0;
  DoubleMatrix inverseInertia{};  // world axes
  Double3 angularFactor{1, 1, 1};
  Double3 linear, angular;                  // before the step
  Double3 externalLinear, externalAngular;  // gained by forces in the step
  Double3 arm;

  Double3 velocityAtContact() const { return linear + cross(angular, arm); }
  Double3 velocityWithForces() const { return linear + externalLinear + cross(angular + externalAngular, arm); }
  // Speed that the contact point gains along `direction` by a unit impulse in that direction there.
  double yields(Double3 direction) const {
    const Double3 spin = times(inverseInertia * cross(arm, direction), angularFactor);
    return inverseMass + dot(direction, cross(spin, arm));
  }
};

struct Scene {
  std::unique_ptr<btRigidBody> stockA, stockB;
  RowBody a, b;
  End exactA, exactB;
  ContactPoint point{};
  float4 ra, rb;
  StepParams params{};

  Double3 normal() const { return toDouble(point.normalWorldOnB); }
};

constexpr float kTimeStep = 1.0f / 60.0f;

std::unique_ptr<btRigidBody> makeBody(bool fixed, Random& random) {
  const float mass = fixed ? 0.0f : random.magnitude(-1, 1.5f);
  const btVector3 inertia =
      fixed ? btVector3(0, 0, 0)
            : btVector3(random.uniform(0.5f, 2), random.uniform(0.5f, 2), random.uniform(0.5f, 2)) * mass * 0.4f;
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, nullptr, inertia);
  auto body = std::make_unique<btRigidBody>(info);
  body->setCenterOfMassTransform(toBullet(random.pose(2)));
  if (fixed) return body;
  body->setLinearVelocity(toBullet(random.vector(5)));
  body->setAngularVelocity(toBullet(random.vector(5)));
  if (random.coin()) body->setAngularFactor(btVector3(random.uniform(0, 1), 1, random.uniform(0, 1)));
  body->applyCentralForce(toBullet(random.vector(100 * mass)));
  body->applyTorque(toBullet(random.vector(100 * mass)));
  return body;
}

float4 toFloat4(const btVector3& v) { return F4(v.x(), v.y(), v.z(), 0); }

// What stage 10 hands to the rows.
RowBody rowBodyOf(const btRigidBody& body) {
  BodyStep step{};
  const btMatrix3x3& inertia = body.getInvInertiaTensorWorld();
  step.linearVelocity = withW(toFloat4(body.getLinearVelocity()), body.getInvMass());
  step.angularVelocity = withW(toFloat4(body.getAngularVelocity()), body.getInvMass() != 0 ? 1.0f : 0.0f);
  step.externalLinear = toFloat4(body.getTotalForce() * body.getInvMass() * kTimeStep);
  step.externalAngular = toFloat4(inertia * body.getTotalTorque() * kTimeStep);
  step.inverseInertia0 = toFloat4(inertia[0]);
  step.inverseInertia1 = toFloat4(inertia[1]);
  step.inverseInertia2 = toFloat4(inertia[2]);
  return makeRowBody(step, toFloat4(body.getAngularFactor()));
}

End exactOf(const RowBody& b, float4 arm) {
  End end;
  end.inverseMass = b.inverseMass;
  end.inverseInertia = {
      {toDouble(b.inverseInertia.row0), toDouble(b.inverseInertia.row1), toDouble(b.inverseInertia.row2)}};
  end.angularFactor = toDouble(b.angularFactor);
  end.linear = toDouble(b.linear);
  end.angular = toDouble(b.angular);
  end.externalLinear = toDouble(b.externalLinear);
  end.externalAngular = toDouble(b.externalAngular);
  end.arm = toDouble(arm);
  return end;
}

StepParams defaultParams() {
  StepParams s{};
  s.timeStep = kTimeStep;
  s.erp2 = 0.2f;
  s.sor = 1;
  s.splitImpulsePenetrationThreshold = -0.04f;
  s.restitutionVelocityThreshold = 0.2f;
  return s;
}

// Body B, or now and then A, may be fixed.
Scene makeScene(Random& random, int n) {
  Scene s;
  s.stockA = makeBody(n % 7 == 1, random);
  s.stockB = makeBody(n % 3 == 0, random);
  s.ra = random.vector(1);
  s.rb = random.vector(1);
  s.a = rowBodyOf(*s.stockA);
  s.b = rowBodyOf(*s.stockB);
  s.exactA = exactOf(s.a, s.ra);
  s.exactB = exactOf(s.b, s.rb);
  s.point.normalWorldOnB = random.direction();
  s.point.localPointA.w = random.uniform(-0.1f, 0.02f);
  s.point.combined = F4(0.5f, random.coin() ? random.uniform(0, 1) : 0.0f, 0, 0);
  s.params = defaultParams();
  if (random.coin()) {
    s.params.erp2 = random.uniform(0.05f, 0.9f);
    s.params.globalCfm = random.magnitude(-6, -2);
    s.params.sor = random.uniform(0.5f, 1.3f);
    s.params.linearSlop = random.uniform(-0.01f, 0.01f);
    s.params.splitImpulsePenetrationThreshold = random.uniform(-0.08f, 0);
    s.params.restitutionVelocityThreshold = random.uniform(0, 2);
  }
  if (random.coin()) s.params.flags |= STEP_SPLIT_IMPULSE;
  return s;
}

// Bullet's solver with its row set-up opened.
class StockRows : public btSequentialImpulseConstraintSolver {
 public:
  explicit StockRows(const Scene& s) {
    m_info.m_timeStep = s.params.timeStep;
    m_info.m_erp2 = s.params.erp2;
    m_info.m_globalCfm = s.params.globalCfm;
    m_info.m_sor = s.params.sor;
    m_info.m_linearSlop = s.params.linearSlop;
    m_info.m_splitImpulse = s.params.flags & STEP_SPLIT_IMPULSE ? 1 : 0;
    m_info.m_splitImpulsePenetrationThreshold = s.params.splitImpulsePenetrationThreshold;
    m_info.m_restitutionVelocityThreshold = s.params.restitutionVelocityThreshold;
    m_point.m_normalWorldOnB = toBullet(s.point.normalWorldOnB);
    m_point.m_distance1 = s.point.localPointA.w;
    m_point.m_combinedFriction = s.point.combined.x;
    m_point.m_combinedRestitution = s.point.combined.y;
    if (s.point.flags & POINT_STIFFNESS_DAMPING) {
      m_point.m_contactPointFlags |= BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING;
      m_point.m_combinedContactStiffness1 = s.point.combinedStiffness;
      m_point.m_combinedContactDamping1 = s.point.combinedDamping;
    }
    if (s.point.flags & (POINT_CFM | POINT_ERP)) {
      m_point.m_contactPointFlags |= s.point.flags & (POINT_CFM | POINT_ERP);
      m_point.m_contactCFM = s.point.combinedStiffness;
      m_point.m_contactERP = s.point.combinedDamping;
    }
    m_tmpSolverBodyPool.resizeNoInitialize(2);
    // As getOrInitSolverBody has it: what can't move shares a solver body without a rigid body.
    btRigidBody* bodies[] = {s.stockA.get(), s.stockB.get()};
    for (int i = 0; i < 2; ++i) {
      initSolverBody(&m_tmpSolverBodyPool[i], bodies[i]->getInvMass() != 0 ? bodies[i] : nullptr, s.params.timeStep);
    }
    m_ra = toBullet(s.ra);
    m_rb = toBullet(s.rb);
  }

  btSolverConstraint normal() {
    btSolverConstraint row;
    btScalar relaxation;
    setupContactConstraint(row, 0, 1, m_point, m_info, relaxation, m_ra, m_rb);
    return row;
  }
  btSolverConstraint friction(float4 t) {
    btSolverConstraint row;
    setupFrictionConstraint(row, toBullet(t), 0, 1, m_point, m_ra, m_rb, nullptr, nullptr, m_info.m_sor, m_info);
    return row;
  }
  btSolverConstraint torsion(float4 axis) {
    btSolverConstraint row;
    setupTorsionalFrictionConstraint(row, toBullet(axis), 0, 1, m_point, 0.1f, m_ra, m_rb, nullptr, nullptr,
                                     m_info.m_sor);
    return row;
  }
  // One Gauss-Seidel update of a row with the limits it holds.
  void solve(btSolverConstraint& row) {
    resolveSingleConstraintRowGeneric(m_tmpSolverBodyPool[0], m_tmpSolverBodyPool[1], row);
  }
  const btSolverBody& body(int i) const { return m_tmpSolverBodyPool[i]; }
  btSolverBody& body(int i) { return m_tmpSolverBodyPool[i]; }

  static btVector3 scaledByFriction(btCollisionObject& object, btVector3 direction, int mode) {
    applyAnisotropicFriction(&object, direction, mode);
    return direction;
  }

 private:
  btContactSolverInfo m_info;
  btManifoldPoint m_point;
  btVector3 m_ra, m_rb;
};

// Relative errors. An effective mass is a sum of positive terms, each a chain of products with an inertia
// tensor: below 40 roundings. A right-hand side is a difference of speeds, each good to 10 roundings of its
// parts, times it.
double massTolerance(double value) { return 40 * kRounding * std::fabs(value); }
double speedScale(const Scene& s) {
  double scale = 0;
  for (const End* e : {&s.exactA, &s.exactB}) {
    scale += length(e->linear) + length(e->externalLinear) +
             (length(e->angular) + length(e->externalAngular)) * length(e->arm);
  }
  return scale + std::fabs(s.point.localPointA.w) / kTimeStep;
}
double rhsTolerance(const Scene& s, double jac) { return 60 * kRounding * std::fabs(jac) * speedScale(s); }

double slip(const Scene& s, Double3 direction, Double3 velocityA, Double3 velocityB) {
  (void)s;
  return dot(direction, velocityA - velocityB);
}

// ---- addresses

TEST(Rows, SlotAddresses) {
  for (const uint fields : {uint{SLOT_FIELDS}, uint{SLOT_TANGENT2_FIELDS}, uint{SLOT_TORSION_FIELDS}}) {
    const uint slots = 3 * BTGPU_LANES;
    std::vector<float> rows(slots * fields, -1);
    std::set<const float*> seen;
    for (uint slot = 0; slot < slots; ++slot) {
      for (uint f = 0; f < fields; ++f) {
        storeField(rows.data() + slotBase(slot, fields), static_cast<int>(f), static_cast<float>(slot * fields + f));
      }
    }
    for (uint slot = 0; slot < slots; ++slot) {
      for (uint f = 0; f < fields; ++f) {
        // The formula of kernels/shared/rows.h.
        const size_t at = (slot / BTGPU_LANES * fields + f) * BTGPU_LANES + slot % BTGPU_LANES;
        ASSERT_EQ(rows[at], static_cast<float>(slot * fields + f));
        ASSERT_EQ(loadField(rows.data() + slotBase(slot, fields), static_cast<int>(f)), rows[at]);
      }
    }
  }
  // Beyond 4 GiB of floats the address does not wrap.
  EXPECT_EQ(slotBase(0x80000000u, SLOT_FIELDS), ulong{0x80000000u} * SLOT_FIELDS);
}

TEST(Rows, FieldTriples) {
  std::vector<float> rows(SLOT_FIELDS * BTGPU_LANES, 0);
  float* slot = rows.data() + slotBase(5, SLOT_FIELDS);
  storeField3(slot, ROW_R_B, F4(1, 2, 3, 4));
  expectNear(loadField3(slot, ROW_R_B), Double3{1, 2, 3}, 0);
  EXPECT_EQ(loadField(slot, ROW_R_B + 2), 3);
  EXPECT_EQ(loadField(slot, ROW_R_B + 3), 0) << "w is not stored";
}

// Fields of a point do not overlap and fill their block.
TEST(Rows, FieldsTile) {
  const auto expectTiled = [](const std::vector<std::pair<int, int>>& fields, int total) {
    int end = 0;
    for (const auto& [first, count] : fields) {
      EXPECT_EQ(first, end);
      end = first + count;
    }
    EXPECT_EQ(end, total);
  };
  expectTiled({{ROW_NORMAL, 3},
               {ROW_R_A, 3},
               {ROW_R_B, 3},
               {ROW_NORMAL_JAC, 1},
               {ROW_NORMAL_RHS, 1},
               {ROW_NORMAL_CFM, 1},
               {ROW_NORMAL_IMPULSE, 1},
               {ROW_PUSH_RHS, 1},
               {ROW_PUSH_IMPULSE, 1},
               {ROW_FRICTION, 1},
               {ROW_TANGENT1, 3},
               {ROW_TANGENT1_JAC, 1},
               {ROW_TANGENT1_RHS, 1},
               {ROW_TANGENT1_IMPULSE, 1}},
              POINT_FIELDS);
  expectTiled({{ROW_TANGENT2, 3}, {ROW_TANGENT2_JAC, 1}, {ROW_TANGENT2_RHS, 1}, {ROW_TANGENT2_IMPULSE, 1}},
              TANGENT2_FIELDS);
  expectTiled({{ROW_TORSION_AXIS, 3},
               {ROW_TORSION_JAC, 1},
               {ROW_TORSION_RHS, 1},
               {ROW_TORSION_FRICTION, 1},
               {ROW_TORSION_IMPULSE, 1}},
              TORSION_FIELDS);
}

// ---- what a normal row means

// The row asks for the impulse after which the contact point has the wanted speed along the normal: a bounce
// off the speed before the step, no more approach than closes the gap in this step, and out of a penetration
// by erp a step.
TEST(NormalRow, ImpulseGivesTheWantedSpeed) {
  Random random(1);
  int bouncing = 0, gaps = 0, splits = 0;
  for (int n = 0; n < 5000; ++n) {
    const Scene s = makeScene(random, n);
    if (s.a.inverseMass + s.b.inverseMass == 0) continue;
    const NormalRow row = prepareNormal(s.params, s.a, s.b, s.point, s.ra, s.rb);
    const StepParams& p = s.params;
    const double gap = double(s.point.localPointA.w) + p.linearSlop;
    const double before = slip(s, s.normal(), s.exactA.velocityAtContact(), s.exactB.velocityAtContact());
    const double now = slip(s, s.normal(), s.exactA.velocityWithForces(), s.exactB.velocityWithForces());
    if (std::fabs(std::fabs(before) - p.restitutionVelocityThreshold) < 1e-4) continue;  // a tie of the threshold
    double bounce = 0;
    if (std::fabs(before) >= p.restitutionVelocityThreshold) bounce = std::fmax(0, -before * s.point.combined.y);
    const double push = gap > 0 ? 0 : -gap * p.erp2 / p.timeStep;
    const double closing = gap > 0 ? gap / p.timeStep : 0;
    const bool split = (p.flags & STEP_SPLIT_IMPULSE) && gap <= p.splitImpulsePenetrationThreshold;

    // Impulse j with now + K j + cfm / dt j = wanted, relaxed by sor.
    const double yields = s.exactA.yields(s.normal()) + s.exactB.yields(s.normal());
    const double softness = double(p.globalCfm) / p.timeStep;
    const double jac = p.sor / (yields + softness);
    const double wanted = bounce - closing + (split ? 0 : push);
    EXPECT_NEAR(row.jac, jac, massTolerance(jac));
    EXPECT_NEAR(row.cfm, softness * jac, massTolerance(softness * jac));
    EXPECT_NEAR(row.rhs, (wanted - now) * jac, rhsTolerance(s, jac));
    EXPECT_NEAR(row.pushRhs, split ? push * jac : 0, rhsTolerance(s, jac));
    bouncing += bounce > 0;
    gaps += gap > 0;
    splits += split;
  }
  EXPECT_GT(bouncing, 400);
  EXPECT_GT(gaps, 400);
  EXPECT_GT(splits, 400);
}

TEST(NormalRow, AsStock) {
  Random random(2);
  for (int n = 0; n < 3000; ++n) {
    Scene s = makeScene(random, n);
    if (s.a.inverseMass + s.b.inverseMass == 0) continue;
    if (n % 4 == 0) {
      s.point.flags |= POINT_STIFFNESS_DAMPING;
      s.point.combinedStiffness = random.magnitude(0, 5);
      s.point.combinedDamping = random.magnitude(-2, 3);
    }
    // Their own CFM and ERP go before stiffness and damping.
    if (n % 3 == 0) {
      constexpr int kOwn[] = {POINT_CFM, POINT_ERP, POINT_CFM | POINT_ERP};
      s.point.flags |= kOwn[n / 3 % 3];
      s.point.combinedStiffness = random.magnitude(-4, -1);
      s.point.combinedDamping = random.uniform(0, 1);
    }
    const NormalRow row = prepareNormal(s.params, s.a, s.b, s.point, s.ra, s.rb);
    const btSolverConstraint stock = StockRows(s).normal();
    EXPECT_NEAR(row.jac, stock.m_jacDiagABInv, massTolerance(stock.m_jacDiagABInv));
    EXPECT_NEAR(row.cfm, stock.m_cfm, massTolerance(stock.m_cfm));
    EXPECT_NEAR(row.rhs, stock.m_rhs, rhsTolerance(s, stock.m_jacDiagABInv));
    EXPECT_NEAR(row.pushRhs, stock.m_rhsPenetration, rhsTolerance(s, stock.m_jacDiagABInv));
  }
}

// A spring and a damper at the contact, by the implicit Euler rule: force = -k (gap + v dt) - c v with the
// speed v at the end of the step.
TEST(NormalRow, StiffnessAndDamping) {
  Random random(3);
  for (int n = 0; n < 500; ++n) {
    Scene s = makeScene(random, n);
    if (s.a.inverseMass + s.b.inverseMass == 0) continue;
    s.params = defaultParams();
    s.point.combined.y = 0;
    s.point.localPointA.w = random.uniform(-0.1f, -0.001f);
    s.point.flags |= POINT_STIFFNESS_DAMPING;
    s.point.combinedStiffness = random.magnitude(1, 5);
    s.point.combinedDamping = random.magnitude(0, 3);
    const NormalRow row = prepareNormal(s.params, s.a, s.b, s.point, s.ra, s.rb);
    // The impulse at which the row comes to rest: rhs = cfm j + jac K j.
    const double yields = s.exactA.yields(s.normal()) + s.exactB.yields(s.normal());
    const double impulse = row.rhs / (row.cfm + row.jac * yields);
    const double now = slip(s, s.normal(), s.exactA.velocityWithForces(), s.exactB.velocityWithForces());
    const double after = now + yields * impulse;
    const double k = s.point.combinedStiffness, c = s.point.combinedDamping, gap = s.point.localPointA.w;
    const double dt = s.params.timeStep;
    const double force = -k * (gap + after * dt) - c * after;
    // The speed after is a small difference if the spring is stiff: its error is that of the speed before.
    const double error = (k * dt + c) * 60 * kRounding * speedScale(s) + 60 * kRounding * std::fabs(impulse / dt);
    EXPECT_NEAR(impulse / dt, force, error);
  }
}

// Neither stiffness nor damping: the denominator is held off zero, as in Bullet.
TEST(NormalRow, NoStiffnessAtAll) {
  Random random(4);
  Scene s = makeScene(random, 2);
  s.point.flags |= POINT_STIFFNESS_DAMPING;
  s.point.combinedStiffness = s.point.combinedDamping = 0;
  const NormalRow row = prepareNormal(s.params, s.a, s.b, s.point, s.ra, s.rb);
  const btSolverConstraint stock = StockRows(s).normal();
  EXPECT_NEAR(row.jac, stock.m_jacDiagABInv, massTolerance(stock.m_jacDiagABInv));
  EXPECT_NEAR(row.rhs, stock.m_rhs, rhsTolerance(s, stock.m_jacDiagABInv));
  EXPECT_TRUE(std::isfinite(row.cfm));
}

// The limit of ever stiffer contacts, where Bullet's formula gives NaN.
TEST(NormalRow, InfiniteStiffnessIsHard) {
  Random random(5);
  Scene s = makeScene(random, 2);
  s.point.flags |= POINT_STIFFNESS_DAMPING;
  s.point.localPointA.w = -0.01f;
  s.point.combinedDamping = 3;
  s.point.combinedStiffness = 1e30f;
  const NormalRow stiff = prepareNormal(s.params, s.a, s.b, s.point, s.ra, s.rb);
  s.point.combinedStiffness = std::numeric_limits<float>::infinity();
  const NormalRow hard = prepareNormal(s.params, s.a, s.b, s.point, s.ra, s.rb);
  EXPECT_FLOAT_EQ(hard.jac, stiff.jac);
  EXPECT_FLOAT_EQ(hard.rhs, stiff.rhs);
  EXPECT_FLOAT_EQ(hard.pushRhs, stiff.pushRhs);
  EXPECT_EQ(hard.cfm, 0);
}

// ---- friction and torsion

// Friction aims at no slip along t. Bullet counts the speed gained by forces, but not the spin gained by
// torques (setupFrictionConstraint), and so do we.
TEST(FrictionRow, StopsTheSlip) {
  Random random(5);
  for (int n = 0; n < 3000; ++n) {
    const Scene s = makeScene(random, n);
    if (s.a.inverseMass + s.b.inverseMass == 0) continue;
    const float4 t = random.direction();
    const float jac = frictionJac(s.params, s.a, s.b, t, s.ra, s.rb);
    const Double3 dt = toDouble(t);
    const double exact = s.params.sor / (s.exactA.yields(dt) + s.exactB.yields(dt));
    EXPECT_NEAR(jac, exact, massTolerance(exact));
    const auto velocity = [](const End& e) { return e.velocityAtContact() + e.externalLinear; };
    EXPECT_NEAR(frictionRhs(s.a, s.b, t, s.ra, s.rb, jac), -slip(s, dt, velocity(s.exactA), velocity(s.exactB)) * exact,
                rhsTolerance(s, exact));
  }
}

TEST(FrictionRow, AsStock) {
  Random random(6);
  for (int n = 0; n < 3000; ++n) {
    const Scene s = makeScene(random, n);
    if (s.a.inverseMass + s.b.inverseMass == 0) continue;
    const float4 t = random.direction();
    const btSolverConstraint stock = StockRows(s).friction(t);
    const float jac = frictionJac(s.params, s.a, s.b, t, s.ra, s.rb);
    EXPECT_NEAR(jac, stock.m_jacDiagABInv, massTolerance(stock.m_jacDiagABInv));
    EXPECT_NEAR(frictionRhs(s.a, s.b, t, s.ra, s.rb, jac), stock.m_rhs, rhsTolerance(s, stock.m_jacDiagABInv));
  }
}

// Torsion aims at no relative spin about the axis; a unit angular impulse changes it by axis . I^-1 axis on
// each side (Bullet leaves the angular factor out of it, and the torques of the step as well).
TEST(TorsionRow, StopsTheSpin) {
  Random random(7);
  for (int n = 0; n < 3000; ++n) {
    const Scene s = makeScene(random, n);
    if (s.a.inverseMass + s.b.inverseMass == 0) continue;
    const float4 axis = random.direction();
    const Double3 d = toDouble(axis);
    const double exact = 1 / (dot(d, s.exactA.inverseInertia * d) + dot(d, s.exactB.inverseInertia * d));
    const float jac = torsionJac(s.a, s.b, axis);
    EXPECT_NEAR(jac, exact, massTolerance(exact));
    // The row's impulse turns B by +axis and A by -axis: it is positive where A spins faster.
    const double spin = dot(d, s.exactA.angular - s.exactB.angular);
    EXPECT_NEAR(torsionRhs(s.a, s.b, axis, jac), spin * exact, rhsTolerance(s, exact));
    const btSolverConstraint stock = StockRows(s).torsion(axis);
    EXPECT_NEAR(jac, stock.m_jacDiagABInv, massTolerance(stock.m_jacDiagABInv));
    EXPECT_NEAR(torsionRhs(s.a, s.b, axis, jac), stock.m_rhs, rhsTolerance(s, exact));
  }
}

TEST(FrictionRow, AnisotropicAsStock) {
  Random random(8);
  for (int n = 0; n < 1000; ++n) {
    btCollisionObject object;
    const BodyPose pose = random.pose(2);
    BodyMaterial material{};
    material.anisotropicFriction = F4(random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1), 0);
    object.setWorldTransform(toBullet(pose));
    const bool rolling = random.coin();
    object.setAnisotropicFriction(
        toBullet(material.anisotropicFriction),
        rolling ? btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION : btCollisionObject::CF_ANISOTROPIC_FRICTION);
    const uint flags = rolling ? BODY_ANISOTROPIC_ROLLING : BODY_ANISOTROPIC;
    const float4 direction = random.direction();
    const Matrix3 rotation = matrixFromQuaternion(pose.orientation);
    const auto expectAsStock = [&](uint wanted, int mode) {
      // Two products with a rotation matrix (20 roundings each, vec_test.cpp) of a unit vector.
      expectNear(anisotropic(flags, wanted, material, rotation, direction),
                 StockRows::scaledByFriction(object, toBullet(direction), mode), 50 * kRounding);
    };
    expectAsStock(BODY_ANISOTROPIC, btCollisionObject::CF_ANISOTROPIC_FRICTION);
    expectAsStock(BODY_ANISOTROPIC_ROLLING, btCollisionObject::CF_ANISOTROPIC_ROLLING_FRICTION);
  }
}

// ---- solving

// As stage 65 prepares them (prepareBodies): both factors twice.
SolverMass solverMassOf(const btRigidBody& body) {
  const btMatrix3x3& inertia = body.getInvInertiaTensorWorld();
  const btVector3 af = body.getAngularFactor(), lf = body.getLinearFactor();
  SolverMass m;
  m.row0 = withW(toFloat4(inertia[0]) * (af.x() * af.x()), body.getInvMass() * lf.x() * lf.x());
  m.row1 = withW(toFloat4(inertia[1]) * (af.y() * af.y()), body.getInvMass() * lf.y() * lf.y());
  m.row2 = withW(toFloat4(inertia[2]) * (af.z() * af.z()), body.getInvMass() * lf.z() * lf.z());
  return m;
}

SlotBodies randomSlot(const Scene& s, Random& random) {
  SlotBodies slot{};
  if (s.a.inverseMass != 0) {
    slot.linearA = random.vector(2);
    slot.angularA = random.vector(2);
    slot.massA = solverMassOf(*s.stockA);
  }
  if (s.b.inverseMass != 0) {
    slot.linearB = random.vector(2);
    slot.angularB = random.vector(2);
    slot.massB = solverMassOf(*s.stockB);
  }
  return slot;
}

void setDeltas(btSolverBody& body, float4 linear, float4 angular) {
  body.internalGetDeltaLinearVelocity() = toBullet(linear);
  body.internalGetDeltaAngularVelocity() = toBullet(angular);
}

void expectDeltas(const SlotBodies& slot, const StockRows& stock, double tolerance) {
  expectNear(slot.linearA, stock.body(0).getDeltaLinearVelocity(), tolerance);
  expectNear(slot.angularA, stock.body(0).getDeltaAngularVelocity(), tolerance);
  expectNear(slot.linearB, stock.body(1).getDeltaLinearVelocity(), tolerance);
  expectNear(slot.angularB, stock.body(1).getDeltaAngularVelocity(), tolerance);
}

// The impulse and the velocities after one update, for normal and friction rows, unclamped and at either
// limit.
TEST(SolveRow, AsStock) {
  Random random(9);
  int atLower = 0, atUpper = 0, within = 0;
  for (int n = 0; n < 5000; ++n) {
    Scene s = makeScene(random, n);
    if (s.a.inverseMass + s.b.inverseMass == 0) continue;
    s.stockA->setLinearFactor(btVector3(random.uniform(0.5f, 1), 1, random.uniform(0, 1)));
    SlotBodies slot = randomSlot(s, random);
    StockRows stock(s);
    setDeltas(stock.body(0), slot.linearA, slot.angularA);
    setDeltas(stock.body(1), slot.linearB, slot.angularB);
    const bool friction = n % 2;
    const float4 direction = friction ? random.direction() : s.point.normalWorldOnB;
    btSolverConstraint row = friction ? stock.friction(direction) : stock.normal();
    const float start = random.uniform(0, 0.5f) * row.m_jacDiagABInv;
    row.m_appliedImpulse = start;
    row.m_lowerLimit = friction ? -2 * row.m_jacDiagABInv : 0;
    row.m_upperLimit = friction ? 2 * row.m_jacDiagABInv : 1e10f;
    const float impulse = solveRow(&slot, direction, s.ra, s.rb, row.m_jacDiagABInv, row.m_rhs, row.m_cfm, start,
                                   row.m_lowerLimit, row.m_upperLimit);
    stock.solve(row);
    // The impulse is good to the error of a relative speed (20 roundings of speeds up to scale) times the
    // effective mass; a velocity changes by that times how much a body yields, which is 1 / mass at most, or
    // less.
    const double scale = speedScale(s) + 20;
    const double yields = s.exactA.inverseMass + s.exactB.inverseMass;
    const double tolerance = 60 * kRounding * scale * row.m_jacDiagABInv;
    EXPECT_NEAR(impulse, row.m_appliedImpulse, tolerance);
    expectDeltas(slot, stock, tolerance * 10 * yields + 10 * kRounding * scale);
    (impulse == row.m_lowerLimit ? atLower : impulse == row.m_upperLimit ? atUpper : within) += 1;
  }
  EXPECT_GT(atLower, 500);
  EXPECT_GT(atUpper, 200);
  EXPECT_GT(within, 1000);
}

TEST(SolveRow, TorsionAsStock) {
  Random random(10);
  int limited = 0, within = 0;
  for (int n = 0; n < 3000; ++n) {
    const Scene s = makeScene(random, n);
    if (s.a.inverseMass + s.b.inverseMass == 0) continue;
    SlotBodies slot = randomSlot(s, random);
    StockRows stock(s);
    setDeltas(stock.body(0), slot.linearA, slot.angularA);
    setDeltas(stock.body(1), slot.linearB, slot.angularB);
    const float4 axis = random.direction();
    btSolverConstraint row = stock.torsion(axis);
    const float start = random.uniform(-0.5f, 0.5f) * row.m_jacDiagABInv, limit = 3 * row.m_jacDiagABInv;
    row.m_appliedImpulse = start;
    row.m_lowerLimit = -limit;
    row.m_upperLimit = limit;
    const float impulse = solveTorsion(&slot, axis, row.m_jacDiagABInv, row.m_rhs, start, limit);
    stock.solve(row);
    const double scale = speedScale(s) + 20;
    const double tolerance = 60 * kRounding * scale * row.m_jacDiagABInv;
    EXPECT_NEAR(impulse, row.m_appliedImpulse, tolerance);
    // jac is the inverse of the sum of both bodies' responses, whose anisotropy is at most 4 (moments of 0.5
    // to 2).
    expectDeltas(slot, stock, 60 * kRounding * scale * 4 + 10 * kRounding * scale);
    (std::fabs(impulse) == limit ? limited : within) += 1;
  }
  EXPECT_GT(limited, 300);
  EXPECT_GT(within, 300);
}

// Actio and reactio: linear and angular momentum about any point stay, if both bodies are free.
TEST(SolveRow, KeepsMomentum) {
  Random random(11);
  for (int n = 0; n < 500; ++n) {
    SlotBodies slot{};
    const float massA = random.uniform(0.5f, 5), massB = random.uniform(0.5f, 5);
    const auto ball = [](float mass) {  // moment 0.4 m
      SolverMass m;
      m.row0 = F4(2.5f / mass, 0, 0, 1 / mass);
      m.row1 = F4(0, 2.5f / mass, 0, 1 / mass);
      m.row2 = F4(0, 0, 2.5f / mass, 1 / mass);
      return m;
    };
    slot.massA = ball(massA);
    slot.massB = ball(massB);
    // The contact at the origin: A at -ra, B at -rb.
    const float4 ra = random.vector(1), rb = random.vector(1), direction = random.direction();
    const auto linear = [&] { return toDouble(slot.linearA) * massA + toDouble(slot.linearB) * massB; };
    const auto angular = [&] {
      return cross(toDouble(-ra), toDouble(slot.linearA)) * massA + toDouble(slot.angularA) * (0.4 * massA) +
             cross(toDouble(-rb), toDouble(slot.linearB)) * massB + toDouble(slot.angularB) * (0.4 * massB);
    };
    const float impulse = solveRow(&slot, direction, ra, rb, 0.5f, 3.0f, 0, 0, 0, 10);
    EXPECT_EQ(impulse, 3.0f);
    expectNear(linear(), Double3{0, 0, 0}, 20 * kRounding * 3);
    expectNear(angular(), Double3{0, 0, 0}, 60 * kRounding * 3);
    solveTorsion(&slot, direction, 0.5f, 2.0f, 0, 10);
    expectNear(linear(), Double3{0, 0, 0}, 20 * kRounding * 3);
    expectNear(angular(), Double3{0, 0, 0}, 60 * kRounding * 3);
  }
}

// The impulse already given is part of what is clamped, and only the change is applied.
TEST(SolveRow, ClampsTheSum) {
  SlotBodies slot{};
  slot.massA.row0.w = slot.massA.row1.w = slot.massA.row2.w = 1;
  const float4 up = F4(0, 1, 0, 0), none = F4(0, 0, 0, 0);
  EXPECT_EQ(solveRow(&slot, up, none, none, 1, -5, 0, 2, 0, INFINITY), 0);
  EXPECT_EQ(slot.linearA.y, -2) << "the whole impulse is taken back, not more";
  EXPECT_EQ(solveRow(&slot, up, none, none, 1, 9, 0, 0, 0, 4), 4);
  EXPECT_EQ(slot.linearA.y, 2);
  // With cfm the row gives way: 1 = rhs - cfm * impulse - speed.
  slot.linearA = none;
  EXPECT_EQ(solveRow(&slot, up, none, none, 1, 3, 0.5f, 2, 0, 100), 2 + 3 - 1);
}

}  // namespace
}  // namespace btgpu
