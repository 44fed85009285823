// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the device can't do sends the step to stock's own path: it is named in the report, counted once a
// step, gives exactly stock's results, and when it is gone the world is back on the device.
#include <BulletCollision/CollisionDispatch/btSimulationIslandManager.h>
#include <BulletCollision/CollisionShapes/btConvexTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletDynamics/ConstraintSolver/btNNCGConstraintSolver.h>

#include <functional>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

constexpr int kSteps = 6;

btScalar s(double v) { return static_cast<btScalar>(v); }

// Calls of the application's callbacks, to see that they are made as often as in stock.
int calls = 0;

class OwnDispatcher : public btCollisionDispatcher {
 public:
  using btCollisionDispatcher::btCollisionDispatcher;
  bool needsResponse(const btCollisionObject* a, const btCollisionObject* b) override {
    ++calls;
    return btCollisionDispatcher::needsResponse(a, b);
  }
};
class OwnSolver : public btSequentialImpulseConstraintSolver {};
class OwnConfiguration : public btDefaultCollisionConfiguration {};
// It overrides what the solver calls in each iteration.
class OwnJoint : public btPoint2PointConstraint {
 public:
  using btPoint2PointConstraint::btPoint2PointConstraint;
  void solveConstraintObsolete(btSolverBody&, btSolverBody&, btScalar) override { ++calls; }
};
// Objects of types that other modules of Bullet bring; they collide with nothing here.
class OwnObject : public btCollisionObject {
 public:
  explicit OwnObject(int type) { m_internalType = type; }
};

// A pile of two boxes on a floor and balls beside it. Everything the causes need is at hand, whichever world
// it is.
struct Lab {
  btDefaultCollisionConfiguration stockConfiguration;
  OwnConfiguration ownConfiguration;
  std::unique_ptr<btCollisionDispatcher> dispatcher;
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  OwnSolver ownSolver;
  btNNCGConstraintSolver foreignSolver;
  std::unique_ptr<btDiscreteDynamicsWorld> world;
  std::unique_ptr<scenes::Objects> objects;
  std::vector<btRigidBody*> bodies;

  // What a cause adds, and where it stays until the world is gone.
  std::vector<std::shared_ptr<void>> keep;
  btRigidBody* body = nullptr;
  btCollisionObject* object = nullptr;
  std::unique_ptr<btTypedConstraint> joint;

  enum class Kind { Ordinary, OwnDispatcher, OwnConfiguration };

  template <typename World>
  static std::unique_ptr<Lab> make(Kind kind) {
    auto lab = std::make_unique<Lab>();
    btCollisionConfiguration* configuration = &lab->stockConfiguration;
    if (kind == Kind::OwnConfiguration) configuration = &lab->ownConfiguration;
    if (kind == Kind::OwnDispatcher) {
      lab->dispatcher = std::make_unique<OwnDispatcher>(configuration);
    } else {
      lab->dispatcher = std::make_unique<btCollisionDispatcher>(configuration);
    }
    lab->world = std::make_unique<World>(lab->dispatcher.get(), &lab->broadphase, &lab->solver, configuration);
    lab->build();
    return lab;
  }
  ~Lab() {
    if (joint) world->removeConstraint(joint.get());
    if (object) world->removeCollisionObject(object);
    objects.reset();
    world.reset();
  }

  void build() {
    objects = std::make_unique<scenes::Objects>(*world);
    world->setGravity(btVector3(0, -10, 0));
    bodies.push_back(objects->add(0, objects->box(btVector3(20, 1, 20)), btVector3(0, -1, 0)));
    btCollisionShape* box = objects->box(btVector3(s(0.5), s(0.5), s(0.5)));
    bodies.push_back(objects->add(1, box, btVector3(0, s(0.5), 0)));
    bodies.push_back(objects->add(1, box, btVector3(s(0.1), s(1.5), 0)));
    bodies.push_back(objects->add(1, objects->sphere(s(0.5)), btVector3(3, s(0.52), 0)));
    bodies.push_back(objects->add(1, objects->sphere(s(0.5)), btVector3(s(3.4), s(1.4), 0)));
  }
  template <typename Shape, typename... Arguments>
  Shape* shape(Arguments&&... arguments) {
    auto made = std::make_shared<Shape>(std::forward<Arguments>(arguments)...);
    keep.push_back(made);
    return made.get();
  }
  // A body of this shape beside the pile; it touches the floor.
  void addShape(btCollisionShape* added, double mass = 1) {
    body = objects->add(s(mass), added, btVector3(-5, s(0.5), 0));
  }
  void removeShape() { world->removeRigidBody(body); }
  void addObject(int type) {
    auto made = std::make_shared<OwnObject>(type);
    keep.push_back(made);
    object = made.get();
    object->setCollisionShape(bodies[3]->getCollisionShape());
    object->setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 30, 0)));
    world->addCollisionObject(object, 0, 0);
  }
  void removeObject() {
    world->removeCollisionObject(object);
    object = nullptr;
  }
  template <typename Joint, typename... Arguments>
  void addJoint(Arguments&&... arguments) {
    joint = std::make_unique<Joint>(*bodies[3], *bodies[4], std::forward<Arguments>(arguments)...);
    world->addConstraint(joint.get());
  }
  void removeJoint() {
    world->removeConstraint(joint.get());
    joint.reset();
  }
  void step(int count) {
    for (int i = 0; i < count; ++i) world->stepSimulation(s(1.0 / 60), 0);
  }
  btGpuDynamicsWorld& gpu() { return dynamic_cast<btGpuDynamicsWorld&>(*world); }
};

struct Cause {
  std::string name;    // of the test
  std::string what;    // in the report
  std::string reason;  // likewise
  std::function<void(Lab&)> begin, end;
  Lab::Kind kind = Lab::Kind::Ordinary;
  bool countsCalls = false;
  // Undone, the world is back on the device; not so what belongs to the world for life.
  bool ends() const { return end != nullptr; }
};

void PrintTo(const Cause& cause, std::ostream* stream) { *stream << cause.name; }

void expectSameBodies(const Lab& gpu, const Lab& stock, const std::string& when) {
  for (size_t i = 0; i < gpu.bodies.size(); ++i) {
    expectSame(stateOf(*gpu.bodies[i]), stateOf(*stock.bodies[i]), when + " body " + std::to_string(i));
  }
  if (gpu.body) expectSame(stateOf(*gpu.body), stateOf(*stock.body), when + " body of the cause");
}

class Fallback : public testing::TestWithParam<Cause> {
 protected:
  void expectReport(btGpuDynamicsWorld& world, unsigned count) {
    const auto report = world.fallbackReport();
    ASSERT_EQ(report.size(), 1u) << reportText(world);
    EXPECT_EQ(report[0].m_what, GetParam().what);
    EXPECT_EQ(report[0].m_reason, GetParam().reason);
    EXPECT_EQ(report[0].m_count, count);
  }
};

TEST_P(Fallback, ExactlyAsStockAndBack) {
  const Cause& cause = GetParam();
  int callsOf[2];
  const auto gpu = Lab::make<btGpuDynamicsWorld>(cause.kind);
  const auto stock = Lab::make<btDiscreteDynamicsWorld>(cause.kind);
  // One after the other, since some causes are global.
  for (Lab* lab : {gpu.get(), stock.get()}) {
    calls = 0;
    if (cause.begin) cause.begin(*lab);
    lab->step(kSteps);
    callsOf[lab == stock.get()] = calls;
    if (cause.ends()) cause.end(*lab);
  }
  expectSameBodies(*gpu, *stock, "after the cause");
  EXPECT_EQ(callsOf[0], callsOf[1]);
  EXPECT_GE(callsOf[1], cause.countsCalls ? 1 : 0) << "the callback should have been called";
  expectReport(gpu->gpu(), kSteps);
  EXPECT_EQ(gpu->gpu().statistics().m_stockSteps, unsigned(kSteps));
  EXPECT_EQ(gpu->gpu().statistics().m_deviceSteps, 0u);
  if (!cause.ends()) return;
  gpu->step(kSteps);
  expectReport(gpu->gpu(), kSteps);
  EXPECT_EQ(gpu->gpu().statistics().m_stockSteps, unsigned(kSteps));
  EXPECT_EQ(gpu->gpu().statistics().m_deviceSteps, unsigned(kSteps));
}

// A cause that comes while the world is on the device, twice.
TEST_P(Fallback, ComesAndGoes) {
  const Cause& cause = GetParam();
  if (!cause.ends()) return;
  const auto gpu = Lab::make<btGpuDynamicsWorld>(cause.kind);
  unsigned device = 0, stock = 0;
  for (int i = 0; i < 2; ++i) {
    gpu->step(3);
    device += 3;
    if (cause.begin) cause.begin(*gpu);
    gpu->step(2);
    stock += 2;
    cause.end(*gpu);
    expectReport(gpu->gpu(), stock);
    EXPECT_EQ(gpu->gpu().statistics().m_deviceSteps, device);
    EXPECT_EQ(gpu->gpu().statistics().m_stockSteps, stock);
  }
  gpu->step(20);
  EXPECT_EQ(gpu->gpu().statistics().m_deviceSteps, device + 20);
  // The pile has come through it.
  EXPECT_NEAR(double(gpu->bodies[1]->getWorldTransform().getOrigin().y()), 0.5, 0.02);
  EXPECT_NEAR(double(gpu->bodies[2]->getWorldTransform().getOrigin().y()), 1.5, 0.04);
}

std::string nameOf(const testing::TestParamInfo<Cause>& test) { return test.param.name; }

constexpr const char* kNotYet = "not on the device yet";

const Cause kJoints[] = {
    {"OwnJointClass", "joint that overrides solveConstraintObsolete", "called in the solver",
     [](Lab& lab) { lab.addJoint<OwnJoint>(btVector3(0, 1, 0), btVector3(0, -1, 0)); },
     [](Lab& lab) { lab.removeJoint(); }, Lab::Kind::Ordinary, true},
};
INSTANTIATE_TEST_SUITE_P(Joints, Fallback, testing::ValuesIn(kJoints), nameOf);

void setMode(Lab& lab, int flag, bool on) {
  int& mode = lab.world->getSolverInfo().m_solverMode;
  mode = on ? mode | flag : mode & ~flag;
}

const Cause kSolver[] = {
    {"DerivedSolver", "constraint solver", "not Bullet's own btSequentialImpulseConstraintSolver",
     [](Lab& lab) { lab.world->setConstraintSolver(&lab.ownSolver); },
     [](Lab& lab) { lab.world->setConstraintSolver(&lab.solver); }},
    {"OtherSolver", "constraint solver", "not Bullet's own btSequentialImpulseConstraintSolver",
     [](Lab& lab) { lab.world->setConstraintSolver(&lab.foreignSolver); },
     [](Lab& lab) { lab.world->setConstraintSolver(&lab.solver); }},
    {"RandomOrder", "SOLVER_RANDMIZE_ORDER", "not on the device",
     [](Lab& lab) { setMode(lab, SOLVER_RANDMIZE_ORDER, true); },
     [](Lab& lab) { setMode(lab, SOLVER_RANDMIZE_ORDER, false); }},
    {"ResidualThreshold", "m_leastSquaresResidualThreshold", "iterations can't end early on the device",
     [](Lab& lab) { lab.world->getSolverInfo().m_leastSquaresResidualThreshold = s(1e-4); },
     [](Lab& lab) { lab.world->getSolverInfo().m_leastSquaresResidualThreshold = 0; }},
};
INSTANTIATE_TEST_SUITE_P(Solver, Fallback, testing::ValuesIn(kSolver), nameOf);

const Cause kCallbacks[] = {
    {"DerivedConfiguration", "collision configuration", "not Bullet's own", nullptr, nullptr,
     Lab::Kind::OwnConfiguration},
    {"DerivedDispatcher", "dispatcher", "not Bullet's own btCollisionDispatcher", nullptr, nullptr,
     Lab::Kind::OwnDispatcher, true},
    {"ContinuousDispatch", "continuous dispatch", "not on the device",
     [](Lab& lab) { lab.world->getDispatchInfo().m_dispatchFunc = btDispatcherInfo::DISPATCH_CONTINUOUS; },
     [](Lab& lab) { lab.world->getDispatchInfo().m_dispatchFunc = btDispatcherInfo::DISPATCH_DISCRETE; }},
};
INSTANTIATE_TEST_SUITE_P(Callbacks, Fallback, testing::ValuesIn(kCallbacks), nameOf);

const Cause kObjects[] = {
    {"SoftBody", "soft body", kNotYet, [](Lab& lab) { lab.addObject(btCollisionObject::CO_SOFT_BODY); },
     [](Lab& lab) { lab.removeObject(); }},
    {"MultibodyLink", "multibody link", kNotYet,
     [](Lab& lab) { lab.addObject(btCollisionObject::CO_FEATHERSTONE_LINK); }, [](Lab& lab) { lab.removeObject(); }},
    {"OwnType", "collision object of the application's own type", kNotYet,
     [](Lab& lab) { lab.addObject(btCollisionObject::CO_USER_TYPE); }, [](Lab& lab) { lab.removeObject(); }},
};
INSTANTIATE_TEST_SUITE_P(Objects, Fallback, testing::ValuesIn(kObjects), nameOf);

// Several causes at once are all named.
TEST(FallbackReport, NamesAllCauses) {
  const auto gpu = Lab::make<btGpuDynamicsWorld>(Lab::Kind::Ordinary);
  gpu->addObject(btCollisionObject::CO_FEATHERSTONE_LINK);
  OwnObject own(btCollisionObject::CO_USER_TYPE);
  own.setCollisionShape(gpu->bodies[3]->getCollisionShape());
  gpu->world->addCollisionObject(&own, 0, 0);
  gpu->step(2);
  EXPECT_EQ(reported(gpu->gpu(), "multibody link").m_count, 2u);
  EXPECT_EQ(reported(gpu->gpu(), "collision object of the application's own type").m_count, 2u);
  EXPECT_EQ(gpu->gpu().fallbackReport().size(), 2u) << reportText(gpu->gpu());
  EXPECT_EQ(gpu->gpu().statistics().m_stockSteps, 2u);
  gpu->world->removeCollisionObject(&own);
}

// Many objects with one cause are counted once a step.
TEST(FallbackReport, CountsSteps) {
  const auto gpu = Lab::make<btGpuDynamicsWorld>(Lab::Kind::Ordinary);
  std::vector<std::unique_ptr<OwnObject>> links;
  for (int i = 0; i < 4; ++i) {
    links.push_back(std::make_unique<OwnObject>(btCollisionObject::CO_FEATHERSTONE_LINK));
    links.back()->setCollisionShape(gpu->bodies[3]->getCollisionShape());
    gpu->world->addCollisionObject(links.back().get(), 0, 0);
  }
  gpu->step(4);
  EXPECT_EQ(gpu->gpu().fallbackReport().size(), 1u) << reportText(gpu->gpu());
  EXPECT_EQ(reported(gpu->gpu(), "multibody link").m_count, 4u);
  for (const auto& link : links) gpu->world->removeCollisionObject(link.get());
}

// A body whose shape is taken away while it is in the world has no proxy any more... and neither have bodies
// of applications that empty the arrays themselves.
TEST(FallbackReport, ObjectWithoutProxy) {
  const auto gpu = Lab::make<btGpuDynamicsWorld>(Lab::Kind::Ordinary);
  gpu->step(2);
  btRigidBody* body = gpu->bodies[4];
  btBroadphaseProxy* proxy = body->getBroadphaseHandle();
  gpu->broadphase.getOverlappingPairCache()->cleanProxyFromPairs(proxy, gpu->dispatcher.get());
  gpu->broadphase.destroyProxy(proxy, gpu->dispatcher.get());
  body->setBroadphaseHandle(nullptr);
  body->setActivationState(DISABLE_SIMULATION);
  gpu->world->setForceUpdateAllAabbs(false);
  gpu->step(2);
  EXPECT_EQ(reported(gpu->gpu(), "collision object without shape or broadphase proxy").m_count, 2u)
      << reportText(gpu->gpu());
}

}  // namespace
}  // namespace btgpu::test
