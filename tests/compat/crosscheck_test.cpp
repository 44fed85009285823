// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The oracle in the application: it agrees with a right device, names the fault and the body of a wrong one, and the
// application notices nothing of it. Wrong devices are made of copies of the kernels with a line changed.
#include <cstdlib>
#include <filesystem>
#include <set>

#include "tests/support/facade_world.h"
#include "tests/support/subprocess.h"
#include "tests/support/world_hash.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }

// Double Bullet takes the direction of friction from slips down to 1.5e-8 m/s (SIMD_EPSILON of their square), the
// device in both ABIs from 0.35 mm/s, as float Bullet does. What rests then differs by its noise, so here directions
// are fixed.
struct CheckedWorld : WorldOf<btGpuDynamicsWorld> {
  explicit CheckedWorld(const btGpuSettings& settings) : WorldOf(settings) {
#ifdef BT_USE_DOUBLE_PRECISION
    world.getSolverInfo().m_solverMode |= SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION;
#endif
  }
};

btGpuSettings checked(int every = 1) {
  btGpuSettings settings;
  settings.m_crosscheckEvery = every;
  return settings;
}

std::string failures(const std::vector<btGpuCheck>& checks) {
  std::string text;
  for (const btGpuCheck& c : checks) {
    if (!c.m_failed) continue;
    text += std::string(c.m_name) + " " + std::to_string(c.m_value) + " > " + std::to_string(c.m_limit) + ", bodies " +
            std::to_string(c.m_indexA) + " " + std::to_string(c.m_indexB) + ", " + std::to_string(c.m_difference) +
            "\n";
  }
  return text;
}

// Every step was compared, entirely, and nothing failed, in no step and not in the whole run.
void expectAgreement(const btGpuDynamicsWorld& world, unsigned steps, unsigned partly = 0) {
  const btGpuCrosscheckSummary summary = world.crosscheck();
  EXPECT_EQ(summary.m_steps, steps);
  EXPECT_EQ(summary.m_checkedSteps, steps);
  EXPECT_EQ(summary.m_partlySteps, partly);
  EXPECT_EQ(summary.m_failedSteps, 0u) << "first in step " << summary.m_first.m_step << ": "
                                       << failures(summary.m_first.m_checks);
  EXPECT_EQ(failures(summary.m_checks), "");
}

// ---- a right device

struct SceneCase {
  const char* name;
  scenes::Size size;
  int steps;
  bool actions;
};

class RightDevice : public ::testing::TestWithParam<SceneCase> {};

TEST_P(RightDevice, AgreesWithStock) {
  const SceneCase& c = GetParam();
  const scenes::Scene& scene = *scenes::find(c.name);
  btGpuSettings settings = checked();
  settings.m_crosscheckOtherDepths = scene.expectations.otherDepths;
  CheckedWorld w(settings);
  scene.build(w.objects, c.size);
  w.run(c.steps, scene.timeStep);
  // With actions the sleep timers run after them.
  expectAgreement(w.world, unsigned(c.steps), c.actions ? unsigned(c.steps) : 0);
  EXPECT_EQ(w.world.statistics().m_stockSteps, 0u);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, RightDevice,
    ::testing::Values(SceneCase{"stack", {4, 4, 4}, 200, false}, SceneCase{"mixed", {4, 4, 4}, 200, false},
                      SceneCase{"washer", {3, 3, 3}, 100, false}, SceneCase{"domino", {30, 1, 2}, 200, false},
                      SceneCase{"ragdoll", {2, 1, 1}, 200, false}, SceneCase{"vehicle", {1, 2, 2}, 100, true}),
    [](const auto& p) { return std::string(p.param.name); });

// Bodies of all kinds come, go, come back and change between the steps.
TEST(CrossCheck, FollowsWhatTheApplicationChanges) {
  CheckedWorld w(checked());
  w.world.setGravity(btVector3(0, -10, 0));
  auto* box = w.objects.box(btVector3(s(0.5), s(0.5), s(0.5)));
  auto* ball = w.objects.sphere(s(0.4));
  w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
  std::vector<btRigidBody*> bodies;
  for (int i = 0; i < 24; ++i) {
    btCollisionShape* shape = i % 3 == 0 ? static_cast<btCollisionShape*>(ball) : box;
    bodies.push_back(
        w.objects.add(1, shape, btVector3(s(1.3 * (i % 4)), s(0.6 + 1.2 * (i / 8)), s(1.1 * (i / 4 % 2)))));
  }
  for (int step = 0; step < 120; ++step) {
    if (step == 10) w.world.removeRigidBody(bodies[3]);
    if (step == 20) w.objects.add(2, ball, btVector3(1, 5, 1));  // takes the slot that is free
    if (step == 30) {
      w.world.addRigidBody(bodies[3]);  // above the others
      bodies[3]->setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(2, 6, 0)));
      bodies[3]->setInterpolationWorldTransform(bodies[3]->getWorldTransform());
    }
    if (step == 40) {  // out and in again between two steps
      w.world.removeRigidBody(bodies[7]);
      w.world.addRigidBody(bodies[7]);
    }
    if (step == 50) bodies[5]->setCollisionShape(ball);
    if (step == 60) {
      bodies[6]->setMassProps(5, btVector3(1, 2, 3));
      bodies[6]->updateInertiaTensor();
      bodies[6]->setFriction(s(0.9));
      bodies[6]->setDamping(s(0.3), s(0.4));
      bodies[6]->setAngularFactor(btVector3(0, 1, 0));
    }
    if (step == 70) bodies[8]->setLinearVelocity(btVector3(3, 2, 1));
    if (step == 80) {
      w.world.removeRigidBody(bodies[9]);
      bodies[9]->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
      bodies[9]->setActivationState(DISABLE_DEACTIVATION);
      w.world.addRigidBody(bodies[9]);
    }
    if (step == 90) bodies[10]->applyCentralImpulse(btVector3(0, 3, 0));
    if (step == 100) bodies[11]->setIgnoreCollisionCheck(bodies[15], true);
    w.run(1);
  }
  expectAgreement(w.world, 120);
}

// A class of the application's own: its shapes are the host's.
class OwnCylinder : public btCylinderShape {
 public:
  using btCylinderShape::btCylinderShape;
};

// Shapes that the device lacks: their contacts are the record's, everything else is compared.
TEST(CrossCheck, TakesTheHostsContactsFromTheRecord) {
  CheckedWorld w(checked());
  w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
  OwnCylinder cylinder(btVector3(s(0.5), s(0.5), s(0.5)));
  auto* box = w.objects.box(btVector3(s(0.5), s(0.5), s(0.5)));
  for (int i = 0; i < 12; ++i) {
    w.objects.add(1, i % 2 ? static_cast<btCollisionShape*>(&cylinder) : box,
                  btVector3(s(0.3 * i), s(0.6 + 1.1 * (i % 4)), s(0.2 * (i % 3))));
  }
  w.run(120);
  EXPECT_FALSE(w.world.fallbackReport().empty()) << "the host was to collide cylinders";
  EXPECT_EQ(w.world.statistics().m_stockSteps, 0u);
  expectAgreement(w.world, 120);
}

// A body whose contacts were the host's brings them along when they are the device's again; here one that no
// narrowphase would find.
TEST(CrossCheck, KnowsWhatComesBackFromTheHost) {
  CheckedWorld w(checked());
  w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
  btRigidBody* box = w.objects.add(1, w.objects.box(btVector3(s(0.5), s(0.5), s(0.5))), btVector3(0, s(0.5), 0));
  const ContactAddedCallback usual = gContactAddedCallback;
  gContactAddedCallback = [](btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) { return false; };
  box->setCollisionFlags(box->getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  w.run(2);
  ASSERT_EQ(w.dispatcher.getNumManifolds(), 1);
  btPersistentManifold& manifold = *w.dispatcher.getManifoldByIndexInternal(0);
  ASSERT_EQ(manifold.getBody0(), box);
  manifold.clearManifold();
  manifold.addManifoldPoint(
      btManifoldPoint(btVector3(0, s(-0.5), 0), btVector3(0, s(0.1), 0), btVector3(0, 1, 0), s(-0.1)));
  box->setCollisionFlags(box->getCollisionFlags() & ~btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  w.run(1);
  gContactAddedCallback = usual;
  double deepest = 0;
  for (int k = 0; k < manifold.getNumContacts(); ++k) {
    deepest = std::min(deepest, double(manifold.getContactPoint(k).getDistance()));
  }
  EXPECT_NEAR(deepest, -0.1, 0.01) << "the device has it";
  expectAgreement(w.world, 3);
}

// What stops a fast body in its sweep does so in the oracle too, though its contacts are the host's: here a ball that
// has none yet, whose swept sphere is larger than itself. As it meets the plane with more than m_allowedCcdPenetration
// only once gravity has been added, no contact is predicted either, and its pose is compared.
TEST(CrossCheck, SweepsAgainstWhatTheHostCollides) {
  for (const bool onHost : {false, true}) {
    CheckedWorld w(checked());
    const ContactProcessedCallback usual = gContactProcessedCallback;
    if (onHost) gContactProcessedCallback = [](btManifoldPoint&, void*, void*) { return false; };
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    btRigidBody* ball = w.objects.add(1, w.objects.sphere(s(0.1)), btVector3(0, s(0.16), 0));
    ball->setDamping(0, 0);
    ball->setLinearVelocity(btVector3(0, s(-2.3), 0));
    ball->setCcdMotionThreshold(s(0.01));
    ball->setCcdSweptSphereRadius(s(0.2));
    w.run(1);
    gContactProcessedCallback = usual;
    EXPECT_EQ(ball->getWorldTransform().getOrigin().y(), s(0.16)) << "stopped where it was";
    EXPECT_EQ(ball->getHitFraction(), s(0));
    expectAgreement(w.world, 1);
  }
}

// A body that fell asleep keeps the box of the step before, here as long as its flight, and what that overlaps is of
// its island: also for an oracle that begins only then.
TEST(CrossCheck, BeginsAmongSleepers) {
  CheckedWorld w(checked());
  w.world.setForceUpdateAllAabbs(false);
  w.world.setGravity(btVector3(0, 0, 0));
  btRigidBody* sleeper = w.objects.add(1, w.objects.sphere(s(0.5)), btVector3(0, 0, 0));
  w.objects.add(1, w.objects.sphere(s(0.3)), btVector3(s(-0.65), s(0.65), 0));
  sleeper->setLinearVelocity(btVector3(60, 0, 0));
  w.run(1);
  sleeper->setLinearVelocity(btVector3(0, 0, 0));
  sleeper->forceActivationState(ISLAND_SLEEPING);
  btGpuDynamicsWorld::configure(&w.world, checked());
  w.run(1);
  EXPECT_EQ(sleeper->getActivationState(), WANTS_DEACTIVATION) << "woken by the one that it left";
  expectAgreement(w.world, 1);
}

TEST(CrossCheck, LooksAtEveryNthStep) {
  std::vector<unsigned long long> told;
  btGpuSettings settings = checked(7);
  settings.m_crosscheckCallback = [&told](const btGpuCrosscheckStep& step) { told.push_back(step.m_step); };
  CheckedWorld w(settings);
  scenes::find("stack")->build(w.objects, {3, 3, 3});
  w.run(30);
  EXPECT_EQ(told, (std::vector<unsigned long long>{7, 14, 21, 28}));
  const btGpuCrosscheckSummary summary = w.world.crosscheck();
  EXPECT_EQ(summary.m_steps, 30u);
  EXPECT_EQ(summary.m_checkedSteps, 4u);
  EXPECT_EQ(summary.m_failedSteps, 0u) << failures(summary.m_first.m_checks);
}

// Steps on the stock path are counted, not compared; the step after them starts from the dispatcher's contacts.
TEST(CrossCheck, CountsStepsOnTheStockPath) {
  CheckedWorld w(checked());
  scenes::find("stack")->build(w.objects, {3, 3, 3});
  w.run(20);
  w.world.getSolverInfo().m_solverMode |= SOLVER_RANDMIZE_ORDER;
  w.run(5);
  w.world.getSolverInfo().m_solverMode &= ~SOLVER_RANDMIZE_ORDER;
  w.run(20);
  const btGpuCrosscheckSummary summary = w.world.crosscheck();
  EXPECT_EQ(summary.m_steps, 45u);
  EXPECT_EQ(summary.m_stockSteps, 5u);
  EXPECT_EQ(summary.m_checkedSteps, 40u);
  EXPECT_EQ(summary.m_failedSteps, 0u) << failures(summary.m_first.m_checks);
}

// ---- the application notices nothing

struct Counts {
  int started = 0, ended = 0, added = 0, ticks = 0, preTicks = 0, actions = 0, reads = 0, writes = 0;
  bool operator==(const Counts& o) const {
    return started == o.started && ended == o.ended && added == o.added && ticks == o.ticks && preTicks == o.preTicks &&
           actions == o.actions && reads == o.reads && writes == o.writes;
  }
};
Counts* counts = nullptr;

struct CountingMotionState : btDefaultMotionState {
  using btDefaultMotionState::btDefaultMotionState;
  void getWorldTransform(btTransform& t) const override {
    ++counts->reads;
    btDefaultMotionState::getWorldTransform(t);
  }
  void setWorldTransform(const btTransform& t) override {
    ++counts->writes;
    btDefaultMotionState::setWorldTransform(t);
  }
};

struct CountingAction : btActionInterface {
  void updateAction(btCollisionWorld*, btScalar) override { ++counts->actions; }
  void debugDraw(btIDebugDraw*) override {}
};

void onStarted(btPersistentManifold* const&) { ++counts->started; }
void onEnded(btPersistentManifold* const&) { ++counts->ended; }
bool onAdded(btManifoldPoint&, const btCollisionObjectWrapper*, int, int, const btCollisionObjectWrapper*, int, int) {
  ++counts->added;
  return false;
}

// All that an application can hang on a world, for 90 steps of two substeps; returns the hash of all poses.
std::uint64_t runWatched(const btGpuSettings& settings, Counts& seen) {
  counts = &seen;
  WorldHash hash;
  {
    CheckedWorld w(settings);
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    auto* box = w.objects.box(btVector3(s(0.5), s(0.5), s(0.5)));
    std::vector<std::unique_ptr<CountingMotionState>> states;
    for (int i = 0; i < 20; ++i) {
      btRigidBody* body = w.objects.add(1, box, btVector3(s(1.1 * (i % 5)), s(0.8 + 1.1 * (i / 5)), s(0.1 * i)));
      states.push_back(std::make_unique<CountingMotionState>(body->getWorldTransform()));
      body->setMotionState(states.back().get());
      body->setUserPointer(&states);
      if (i % 4 == 0)
        body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
      if (i == 6) w.objects.joint<btPoint2PointConstraint>(true, *body, btVector3(0, s(0.6), 0));
    }
    CountingAction action;
    w.world.addAction(&action);
    w.world.setInternalTickCallback([](btDynamicsWorld*, btScalar) { ++counts->ticks; }, nullptr, false);
    w.world.setInternalTickCallback([](btDynamicsWorld*, btScalar) { ++counts->preTicks; }, nullptr, true);
    gContactStartedCallback = onStarted;
    gContactEndedCallback = onEnded;
    gContactAddedCallback = onAdded;
    for (int i = 0; i < 90; ++i) {
      w.world.stepSimulation(s(1.0 / 30), 2, s(1.0 / 60));
      hash.add(w.world);
      EXPECT_EQ(gContactStartedCallback, &onStarted);
      EXPECT_EQ(gContactEndedCallback, &onEnded);
    }
    EXPECT_EQ(w.world.statistics().m_deviceSteps, 180u) << reportText(w.world);
    if (settings.m_crosscheckEvery > 0) {
      EXPECT_EQ(w.world.crosscheck().m_checkedSteps, 180u);
      // Of some 60 pairs two may be ties in one step, which is more than its share (m_crosscheckOtherDepths).
      EXPECT_LE(w.world.crosscheck().m_failedSteps, 1u) << failures(w.world.crosscheck().m_first.m_checks);
    }
    w.world.removeAction(&action);
    gContactAddedCallback = nullptr;
    gContactStartedCallback = nullptr;
    gContactEndedCallback = nullptr;
  }
  return hash.value();
}

TEST(CrossCheck, ChangesNothingForTheApplication) {
  Counts plain, watched;
  const std::uint64_t hash = runWatched(checked(-1), plain);
  btGpuSettings settings = checked();
  settings.m_crosscheckOtherDepths = 0.01;  // its boxes tumble, as in docs/crosscheck.md
  EXPECT_EQ(runWatched(settings, watched), hash);
  EXPECT_TRUE(plain == watched);
  EXPECT_EQ(plain.started, watched.started);
  EXPECT_EQ(plain.ended, watched.ended);
  EXPECT_EQ(plain.added, watched.added);
  EXPECT_EQ(plain.reads, watched.reads);
  EXPECT_EQ(plain.writes, watched.writes);
  EXPECT_GT(plain.started, 0);
  EXPECT_GT(plain.added, 0);
  EXPECT_GT(plain.actions, 0);
}

// ---- wrong devices

// The kernels with one line changed.
class BrokenKernels {
 public:
  BrokenKernels(const std::string& file, const std::string& line, const std::string& instead) {
    namespace fs = std::filesystem;
    fs::copy(fs::path(BTGPU_SOURCE_DIR) / "kernels", m_folder.path() / "kernels", fs::copy_options::recursive);
    const fs::path path = m_folder.path() / "kernels" / file;
    std::string text = readFile(path);
    const size_t at = text.find(line);
    EXPECT_NE(at, std::string::npos) << file << " has no " << line;
    if (at == std::string::npos) return;
    writeFile(path, text.replace(at, line.size(), instead));
    setenv("BTGPU_KERNEL_DIR", m_folder.path().c_str(), 1);
  }
  ~BrokenKernels() { unsetenv("BTGPU_KERNEL_DIR"); }
  BrokenKernels(const BrokenKernels&) = delete;
  BrokenKernels& operator=(const BrokenKernels&) = delete;

 private:
  TemporaryFolder m_folder;
};

// Bodies that only one fault each can reach: by their positions in the world's array.
enum Body { kPlane, kBox, kBall, kDamped, kLeft, kRight };

struct Fault {
  const char* name;
  const char *file, *line, *instead;
  const char* check;  // fails first, and no other but `follows`
  int a, b;           // where it is worst in the first step that fails; -1: none
  const char* follows = nullptr;
};

class WrongDevice : public ::testing::TestWithParam<Fault> {};

TEST_P(WrongDevice, IsFoundOut) {
  const Fault& fault = GetParam();
  const BrokenKernels kernels(fault.file, fault.line, fault.instead);
  const TemporaryFolder folder;
  btGpuSettings settings = checked();
  settings.m_crosscheckFile = folder.file("steps.json");
  std::set<std::string> failed;
  const btCollisionObject *bodyA = nullptr, *bodyB = nullptr;
  settings.m_crosscheckCallback = [&](const btGpuCrosscheckStep& step) {
    for (const btGpuCheck& c : step.m_checks) {
      if (!c.m_failed) continue;
      if (failed.empty()) {
        bodyA = c.m_bodyA;
        bodyB = c.m_bodyB;
      }
      failed.insert(c.m_name);
    }
  };
  CheckedWorld w(settings);
  w.world.setGravity(btVector3(0, -10, 0));
  auto* ball = w.objects.sphere(s(0.5));
  auto* box = w.objects.box(btVector3(s(0.5), s(0.5), s(0.5)));
  std::vector<btRigidBody*> bodies = {
      w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0)),
      w.objects.add(1, box, btVector3(0, s(0.49), 0)),
      w.objects.add(1, ball, btVector3(4, s(0.8), 0)),
      w.objects.add(1, ball, btVector3(8, 50, 0)),
      w.objects.add(1, ball, btVector3(-10, 50, 0)),
      w.objects.add(1, ball, btVector3(s(-8.9), 50, 0)),
  };
  bodies[kBox]->setActivationState(DISABLE_DEACTIVATION);
  bodies[kBall]->setRestitution(s(0.7));
  bodies[kPlane]->setRestitution(s(0.7));
  bodies[kDamped]->setDamping(s(0.5), 0);
  bodies[kDamped]->setLinearVelocity(btVector3(0, 0, 3));
  bodies[kLeft]->setLinearVelocity(btVector3(2, 0, 0));
  w.run(60);

  const btGpuCrosscheckSummary summary = w.world.crosscheck();
  EXPECT_EQ(summary.m_checkedSteps, 60u);
  std::set<std::string> expected;
  if (fault.check) expected.insert(fault.check);
  if (fault.follows) expected.insert(fault.follows);
  EXPECT_EQ(failed, expected) << failures(summary.m_first.m_checks);
  if (!fault.check) return;
  EXPECT_GT(summary.m_failedSteps, 0u);
  // Either of a pair may come first.
  std::set<const btCollisionObject*> named = {bodyA}, right = {bodies[size_t(fault.a)]};
  if (bodyB) named.insert(bodyB);
  if (fault.b >= 0) right.insert(bodies[size_t(fault.b)]);
  EXPECT_EQ(named, right);
  const std::string json = readFile(folder.file("steps.json"));
  EXPECT_NE(json.find("\"failed\":true"), std::string::npos);
  EXPECT_NE(json.find(std::string("{\"name\":\"") + fault.check), std::string::npos);
}

const Fault kFaults[] = {
    // The scene itself is in agreement: the fault alone is what the others are about.
    {"None", "lib/motion.h", "#ifndef BTGPU_LIB_MOTION_H", "#ifndef BTGPU_LIB_MOTION_H", nullptr, -1, -1},
    {"NormalTilted", "lib/collide.h", "addRaw(out, p - out->normal * distance, distance);\n  }\n",
     "addRaw(out, p - out->normal * distance, distance);\n  }\n"
     "  out->normal = normalize3(xyz(planeInWorld) + vec3(0.1f, 0.0f, 0.0f));\n",
     "contact.normal", kPlane, kBox},
    {"DepthScaled", "lib/collide.h", "addRaw(out, out->normal * (-radius - distance), distance)",
     "addRaw(out, out->normal * (-radius - distance), 1.1f * distance)", "contact.depth", kPlane, kBall},
    {"PairMissed", "lib/collide.h", "if (distance > radiusA + radiusB) return;",
     "if (distance > 0.98f * (radiusA + radiusB)) return;", "contact.missing_pairs", kLeft, kRight},
    {"DampingSkipped", "lib/motion.h",
     "if (d.linear != 0.0f) *linear *= dampingFactor(d.linear, timeStep, linearFactor);", "", "solver.free_velocity",
     kDamped, -1, "integrate.pose"},
    {"ImpulseScaled", "stages/80_integrate_poses.cl", "linear = xyz(linear + s.deltaLinear + steps[i].externalLinear);",
     "linear = xyz(linear + s.deltaLinear * (linear.y < -1.5f ? 0.99f : 1.0f) + steps[i].externalLinear);",
     "solver.single_velocity", kBall, -1},
    {"PoseOvershoots", "stages/80_integrate_poses.cl",
     "pose = integratePose(pose, meanLinear, meanAngular, timeStep);\n  if (!isFiniteState",
     "pose = integratePose(pose, meanLinear, meanAngular, (i == 3 ? 1.1f : 1.0f) * timeStep);\n  if (!isFiniteState",
     "integrate.pose", kDamped, -1},
    {"NotFinite", "stages/80_integrate_poses.cl", "  if (!isFiniteState",
     "    if (i == 3) linear.y = INFINITY;\n  if (!isFiniteState", "integrate.not_finite", kDamped, -1},
    {"WantsToSleep", "stages/90_update_activation.cl", "    activations[i] = a;",
     "    if (i == 3) a.state = STATE_WANTS_DEACTIVATION;\n    activations[i] = a;", "sleep.state", kDamped, -1},
};

INSTANTIATE_TEST_SUITE_P(Faults, WrongDevice, ::testing::ValuesIn(kFaults),
                         [](const auto& p) { return std::string(p.param.name); });

}  // namespace
}  // namespace btgpu::test
