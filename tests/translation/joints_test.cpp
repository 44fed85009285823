// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The rows that translation makes of joints are those that stock's solver makes.
#include "translation/read_joints.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/support/joints.h"
#include "tests/support/world_of.h"
#include "translation/convert.h"
#include "translation/write_back_joints.h"

namespace btgpu::test {
namespace {

constexpr double kStep = 1.0 / 60.0;

// Lets the test look at what the solver has set up.
class OpenSolver : public btSequentialImpulseConstraintSolver {
 public:
  const btConstraintArray& setUp(btRigidBody& a, btRigidBody& b, btTypedConstraint* joint, btContactSolverInfo& info) {
    btCollisionObject* bodies[] = {&a, &b};
    a.setCompanionId(-1);
    b.setCompanionId(-1);
    solveGroupCacheFriendlySetup(bodies, 2, nullptr, 0, &joint, 1, info, nullptr);
    return m_tmpSolverNonContactConstraintPool;
  }
};

class OpenWorld : public btDiscreteDynamicsWorld {
 public:
  using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;
  void damp(btScalar timeStep) { predictUnconstraintMotion(timeStep); }
};

template <typename World>
struct Pair {
  explicit Pair(const JointMaker& make) {
    addJointBodies(w.objects, a, b);
    joint = make(w.objects, *a, *b);
    for (btRigidBody* body : {a, b}) body->setFlags(0);  // no gyroscopic term, which the solver keeps to itself
    btContactSolverInfo& info = w.world.getSolverInfo();
    info.m_erp = scalar(0.3);  // nothing at its default
    info.m_damping = scalar(0.9);
    info.m_globalCfm = scalar(0.02);
  }
  WorldOf<World> w;
  btRigidBody *a = nullptr, *b = nullptr;
  btTypedConstraint* joint = nullptr;
};

struct ReadPair : Pair<btDiscreteDynamicsWorld> {
  using Pair::Pair;
  const WorldInput& read() {
    missing.clear();
    reader.read(w.world, missing, notes);
    joints.read(w.world, scalar(kStep), reader, missing);
    return reader.input();
  }
  WorldReader reader;
  JointReader joints;
  FallbackList missing, notes;
};

bool same(const btVector3& v, const float4& f) {
  const float4 expected = toFloat4(v);
  return expected.x == f.x && expected.y == f.y && expected.z == f.z;
}

class JointRows : public ::testing::TestWithParam<JointKind> {
 protected:
  // Everything that getInfo2 gives is the same, bit by bit; of the right-hand side stock keeps only the sum, from which
  // the velocity part is taken away again.
  static void expectRows(const WorldInput& input, const btConstraintArray& rows, Pair<OpenWorld>& stock) {
    ASSERT_EQ(input.joints.size(), 1u);
    const Joint& joint = input.joints[0];
    ASSERT_EQ(joint.rowCount, static_cast<uint>(rows.size()));
    for (int r = 0; r < rows.size(); ++r) {
      const JointRow& row = input.jointRows[joint.firstRow + static_cast<uint>(r)];
      const btSolverConstraint& s = rows[r];
      EXPECT_TRUE(same(s.m_contactNormal1, row.linearA)) << "row " << r;
      EXPECT_TRUE(same(s.m_relpos1CrossNormal, row.angularA)) << "row " << r;
      EXPECT_TRUE(same(s.m_contactNormal2, row.linearB)) << "row " << r;
      EXPECT_TRUE(same(s.m_relpos2CrossNormal, row.angularB)) << "row " << r;
      EXPECT_EQ(row.angularA.w, static_cast<float>(s.m_cfm)) << "row " << r;
      const auto limit = [](btScalar v) {
        return static_cast<float>(btMax(btMin(v, scalar(3.4e38)), scalar(-3.4e38)));
      };
      EXPECT_EQ(limit(scalar(row.linearB.w)), limit(s.m_lowerLimit)) << "row " << r;
      EXPECT_EQ(limit(scalar(row.angularB.w)), limit(s.m_upperLimit)) << "row " << r;
      EXPECT_EQ(joint.iterations, s.m_overrideNumSolverIterations);
      const btVector3 force = btVector3(0, -10, 0) * scalar(kStep);  // what gravity adds to either body
      const btScalar speed = s.m_contactNormal1.dot(stock.a->getLinearVelocity() + force) +
                             s.m_relpos1CrossNormal.dot(stock.a->getAngularVelocity()) +
                             s.m_contactNormal2.dot(stock.b->getLinearVelocity() + force) +
                             s.m_relpos2CrossNormal.dot(stock.b->getAngularVelocity());
      const double wanted = double(s.m_rhs / s.m_jacDiagABInv + speed * scalar(joint.damping));
      // Products and quotients of numbers up to 10, each within half a unit.
      EXPECT_NEAR(double(row.linearA.w), wanted, 10 * 10 * 6e-8 * (1 + std::fabs(wanted))) << "row " << r;
    }
  }
};

TEST_P(JointRows, AreStocks) {
  ReadPair ours(GetParam().make);
  Pair<OpenWorld> stock(GetParam().make);
  for (auto* joint : {ours.joint, stock.joint}) {
    joint->setOverrideNumSolverIterations(17);
    joint->setBreakingImpulseThreshold(scalar(0.7));
  }
  for (const auto& pose : {btTransform::getIdentity(), btTransform(btQuaternion(vector(1, 0, 0), scalar(0.3)))}) {
    for (btRigidBody* body : {ours.b, stock.b}) {
      body->setWorldTransform(body->getWorldTransform() * pose);
      body->updateInertiaTensor();
    }
    const btVector3 velocities[] = {ours.a->getLinearVelocity(), ours.a->getAngularVelocity(),
                                    ours.b->getLinearVelocity(), ours.b->getAngularVelocity()};
    const WorldInput& input = ours.read();
    EXPECT_TRUE(ours.missing.empty());
    EXPECT_EQ(std::memcmp(&velocities[0], &ours.a->getLinearVelocity(), sizeof(btVector3)), 0) << "not restored";
    EXPECT_EQ(std::memcmp(&velocities[1], &ours.a->getAngularVelocity(), sizeof(btVector3)), 0) << "not restored";
    EXPECT_EQ(std::memcmp(&velocities[2], &ours.b->getLinearVelocity(), sizeof(btVector3)), 0) << "not restored";
    EXPECT_EQ(std::memcmp(&velocities[3], &ours.b->getAngularVelocity(), sizeof(btVector3)), 0) << "not restored";

    btContactSolverInfo info = stock.w.world.getSolverInfo();
    info.m_timeStep = scalar(kStep);
    stock.w.world.applyGravity();
    const btVector3 before[] = {stock.a->getLinearVelocity(), stock.a->getAngularVelocity(),
                                stock.b->getLinearVelocity(), stock.b->getAngularVelocity()};
    stock.w.world.damp(scalar(kStep));
    OpenSolver solver;
    expectRows(input, solver.setUp(*stock.a, *stock.b, stock.joint, info), stock);
    stock.w.world.clearForces();
    stock.a->setLinearVelocity(before[0]);
    stock.a->setAngularVelocity(before[1]);
    stock.b->setLinearVelocity(before[2]);
    stock.b->setAngularVelocity(before[3]);
    ours.reader.input().clearChanges();
  }
}

INSTANTIATE_TEST_SUITE_P(All, JointRows, ::testing::ValuesIn(jointKinds()), [](const auto& p) { return p.param.name; });

// ---- which bodies, which islands

const JointKind& ball() {
  static const JointKind kind = jointKinds().front();
  return kind;
}

TEST(ReadJoints, Disabled) {
  ReadPair pair(ball().make);
  pair.joint->setEnabled(false);
  const WorldInput& input = pair.read();
  ASSERT_EQ(input.joints.size(), 1u);
  EXPECT_EQ(input.joints[0].enabled, 0u);
  EXPECT_EQ(input.joints[0].rowCount, 0u);
  EXPECT_TRUE(input.jointRows.empty());
}

// The speed of an end that the solver holds is part of what the row wants; the device knows nothing of it.
TEST(ReadJoints, HeldBodies) {
  ReadPair pair([](scenes::Objects& o, btRigidBody& a, btRigidBody& b) -> btTypedConstraint* {
    b.setCollisionFlags(b.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    b.setMassProps(0, vector(0, 0, 0));
    b.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    b.setLinearVelocity(vector(0, 0, 0));
    b.setAngularVelocity(vector(0, 0, 0));
    return ball().make(o, a, b);
  });
  const float still = pair.read().jointRows[0].linearA.w;
  pair.b->setLinearVelocity(vector(2, 0, 0));
  const WorldInput& input = pair.read();
  EXPECT_EQ(input.joints[0].bodyA, 0u);
  EXPECT_EQ(input.joints[0].islandA, 0u);
  EXPECT_EQ(input.joints[0].bodyB, NO_INDEX);
  EXPECT_EQ(input.joints[0].islandB, NO_INDEX);
  EXPECT_NEAR(input.jointRows[0].linearA.w, still + 2, 1e-5) << "J of B is (-1, 0, 0); the ball's own damping is 1";
}

TEST(ReadJoints, FixedBody) {
  ReadPair pair([](scenes::Objects& o, btRigidBody& a, btRigidBody&) -> btTypedConstraint* {
    return o.joint<btPoint2PointConstraint>(false, a, vector(0, 1, 0));
  });
  const WorldInput& input = pair.read();
  EXPECT_TRUE(pair.missing.empty());
  EXPECT_EQ(input.joints[0].bodyB, NO_INDEX);
  EXPECT_EQ(input.joints[0].rowCount, 3u);
}

TEST(ReadJoints, BodyOutsideTheWorld) {
  ReadPair pair(ball().make);
  pair.w.world.removeRigidBody(pair.b);
  pair.read();
  ASSERT_EQ(pair.missing.entries().size(), 1u);
  EXPECT_EQ(pair.missing.entries()[0].what, "joint to a body outside the world");
  pair.joint->setEnabled(false);
  pair.read();
  EXPECT_TRUE(pair.missing.empty()) << "a disabled joint does nothing";
  pair.w.world.addRigidBody(pair.b);
}

TEST(ReadJoints, QuarantinedBody) {
  ReadPair pair(ball().make);
  pair.b->setLinearVelocity(vector(NAN, 0, 0));
  const WorldInput& input = pair.read();
  EXPECT_EQ(input.joints[0].rowCount, 0u);
  EXPECT_EQ(input.joints[0].enabled, 0u);
}

// ---- back

// 60 joints of each kind between bodies in a row, so that neighbours share bodies, which are damped, each its own way.
struct ManyJoints {
  // `twice`: the first joint is in the world twice, and so all are read one after the other.
  explicit ManyJoints(bool twice) {
    btCollisionShape* shape = w.objects.sphere(scalar(0.4));
    const std::vector<JointKind> kinds = jointKinds();
    const std::size_t count = 60 * kinds.size();
    for (std::size_t i = 0; i <= count; ++i) {
      btRigidBody* body = w.objects.add(1, shape, vector(double(i), 0.1 * double(i % 7), 0));
      body->setLinearVelocity(vector(0.3, double(i % 5), -1));
      body->setAngularVelocity(vector(double(i % 3), 1, 0.5));
      body->setDamping(scalar(0.01 * double(i % 4)), scalar(0.1 * double(i % 3)));
      bodies.push_back(body);
    }
    for (std::size_t i = 0; i < count; ++i) kinds[i % kinds.size()].make(w.objects, *bodies[i], *bodies[i + 1]);
    if (twice) w.world.addConstraint(w.world.getConstraint(0));
    reader.read(w.world, missing, notes);
    joints.read(w.world, scalar(kStep), reader, missing);
    EXPECT_TRUE(missing.empty());
  }
  WorldOf<btDiscreteDynamicsWorld> w;
  std::vector<btRigidBody*> bodies;
  WorldReader reader;
  JointReader joints;
  FallbackList missing, notes;
  ~ManyJoints() {
    if (!joints.areDistinct()) w.world.removeConstraint(w.world.getConstraint(0));
  }
};

TEST(ReadJoints, SeveralAtOnceAreAsOneByOne) {
  ManyJoints atOnce(false), inTurn(true);
  const WorldInput &a = atOnce.reader.input(), &b = inTurn.reader.input();
  ASSERT_EQ(a.joints.size() + 1, b.joints.size());
  ASSERT_EQ(a.jointRows.size() + a.joints[0].rowCount, b.jointRows.size());
  EXPECT_TRUE(atOnce.joints.areDistinct());
  EXPECT_FALSE(inTurn.joints.areDistinct());
  EXPECT_EQ(std::memcmp(a.joints.data(), b.joints.data(), a.joints.size() * sizeof(Joint)), 0);
  EXPECT_EQ(std::memcmp(a.jointRows.data(), b.jointRows.data(), a.jointRows.size() * sizeof(JointRow)), 0);
  for (std::size_t i = 0; i < atOnce.bodies.size(); ++i) {
    EXPECT_EQ(atOnce.bodies[i]->getLinearVelocity(), vector(0.3, double(i % 5), -1)) << "damped only for the rows";
  }
}

// A joint that is in the world twice is not read by two threads, and is written back.
TEST(ReadJoints, TwiceInTheWorld) {
  ReadPair r(jointKinds().front().make);
  r.read();
  EXPECT_TRUE(r.joints.areDistinct());
  r.w.world.addConstraint(r.joint);
  EXPECT_EQ(r.read().joints.size(), 2u);
  EXPECT_FALSE(r.joints.areDistinct());
  r.w.world.removeConstraint(r.joint);
}

// Of many joints, those that report to the same place do so in their order, the last one's stays.
TEST(WriteBackJoints, SharedFeedback) {
  ManyJoints many(false);
  btJointFeedback shared;
  const std::size_t count = many.joints.constraints().size();
  for (const std::size_t i : {std::size_t{1}, count / 2, count - 1}) {
    many.joints.constraints()[i]->setJointFeedback(&shared);
    many.joints.constraints()[i]->enableFeedback(true);
  }
  const WorldInput& input = many.reader.input();
  StepResults results;
  results.jointSolved.assign(count, 1);
  for (std::size_t k = 0; k < input.jointRows.size(); ++k) results.jointImpulses.push_back(float(k % 100) * 0.01f);
  writeBackJoints(many.w.world, many.joints, input, results, scalar(kStep));
  for (std::size_t i = 0; i < count; ++i) {
    const Joint& joint = input.joints[i];
    const float last = joint.rowCount > 0 ? results.jointImpulses[joint.firstRow + joint.rowCount - 1] : 0;
    EXPECT_EQ(many.joints.constraints()[i]->internalGetAppliedImpulse(), btScalar(last)) << i;
  }
  const Joint& end = input.joints[count - 1];
  btVector3 force(0, 0, 0);
  for (uint r = end.firstRow; r < end.firstRow + end.rowCount; ++r) {
    force += toBullet(input.jointRows[r].linearA) * (btScalar(results.jointImpulses[r]) / scalar(kStep));
  }
  EXPECT_LE((shared.m_appliedForceBodyA - force).length(), scalar(1e-5) * (1 + force.length()));
}

TEST(WriteBackJoints, ImpulsesFeedbackAndBreaking) {
  ReadPair pair(ball().make);
  btJointFeedback feedback;
  pair.joint->setJointFeedback(&feedback);
  pair.joint->setBreakingImpulseThreshold(2);
  pair.a->setLinearFactor(vector(1, 0.5, 1));
  const WorldInput& input = pair.read();
  StepResults results;
  results.jointImpulses = {1, -1.5f, 0.25f};
  results.jointSolved = {0};
  pair.joint->internalSetAppliedImpulse(scalar(7));
  feedback.m_appliedForceBodyA = vector(1, 2, 3);
  writeBackJoints(pair.w.world, pair.joints, input, results, scalar(kStep));
  EXPECT_EQ(pair.joint->getAppliedImpulse(), scalar(7)) << "asleep";
  EXPECT_EQ(feedback.m_appliedForceBodyA, vector(1, 2, 3)) << "asleep";

  results.jointSolved = {1};
  writeBackJoints(pair.w.world, pair.joints, input, results, scalar(kStep));
  EXPECT_EQ(pair.joint->getAppliedImpulse(), scalar(0.25)) << "the last row's";
  EXPECT_NEAR(double((feedback.m_appliedForceBodyA - vector(60, -45, 15)).length()), 0, 1e-4);
  EXPECT_NEAR(double((feedback.m_appliedForceBodyB - vector(-60, 90, -15)).length()), 0, 1e-4);
  EXPECT_TRUE(pair.joint->isEnabled());
  results.jointImpulses[0] = -2;
  writeBackJoints(pair.w.world, pair.joints, input, results, scalar(kStep));
  EXPECT_FALSE(pair.joint->isEnabled());
}

// A callback may take a joint out of the world, and destroy it, while the device works.
TEST(WriteBackJoints, JointThatIsGone) {
  ReadPair pair(ball().make);
  const WorldInput& input = pair.read();
  StepResults results;
  results.jointImpulses = {1, 1, 1};
  results.jointSolved = {1};
  pair.w.objects.remove(pair.joint);
  writeBackJoints(pair.w.world, pair.joints, input, results, scalar(kStep));
}

}  // namespace
}  // namespace btgpu::test
