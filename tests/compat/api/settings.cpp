// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Settings of solver and dispatcher, Bullet's global variables and callbacks, debug drawing.
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>

#include "tests/compat/api/api_case.h"

namespace btgpu::test::api {
namespace {

// A ball deep in the ground, one that bounces off it, one that rolls.
struct Balls {
  btRigidBody *ground, *deep, *bouncing, *rolling;
};
Balls balls(Lab& w) {
  w.world.setGravity(vector(0, -10, 0));
  Balls b{};
  b.ground = w.objects.add(0, w.objects.plane(vector(0, 1, 0), 0), vector(0, 0, 0));
  b.ground->setRestitution(1);
  b.ground->setRollingFriction(scalar(0.3));
  btCollisionShape* ball = w.objects.sphere(scalar(0.5));
  b.deep = w.objects.add(1, ball, vector(0, 0.3, 0));
  b.bouncing = w.objects.add(1, ball, vector(0, 0.48, 3));
  b.bouncing->setLinearVelocity(vector(0, -1, 0.1));
  b.bouncing->setRestitution(scalar(0.8));
  b.rolling = w.objects.add(1, ball, vector(0, 0.49, 6));
  b.rolling->setLinearVelocity(vector(2, 0, 0.5));
  b.rolling->setAngularVelocity(vector(1, 0.5, -3));
  b.rolling->setRollingFriction(scalar(0.4));
  w.start();
  return b;
}

// Sets a global variable for as long as it lives.
template <typename T>
class Global {
 public:
  Global(T& variable, T value) : m_variable(variable), m_before(variable) { m_variable = value; }
  ~Global() { m_variable = m_before; }
  Global(const Global&) = delete;
  Global& operator=(const Global&) = delete;

 private:
  T& m_variable;
  T m_before;
};

Lab* lab = nullptr;
bool contactAdded(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int,
                  const btCollisionObjectWrapper* b, int, int) {
  Lab& w = *lab;
  w.log.note("contact added");
  LOG(w.number(a->getCollisionObject()));
  LOG(w.number(b->getCollisionObject()));
  LOG_NEAR(point.getDistance());
  point.m_combinedFriction = scalar(0.1);
  point.m_contactPointFlags |= BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
  point.m_lateralFrictionDir1 = vector(0, 0, 1);
  point.m_lateralFrictionDir2 = vector(1, 0, 0);
  point.m_contactPointFlags |= BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING;
  point.m_combinedContactStiffness1 = 400;
  point.m_combinedContactDamping1 = 20;
  return true;
}
bool contactWithCfm(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int, const btCollisionObjectWrapper*,
                    int, int) {
  point.m_contactPointFlags |= BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP;
  point.m_contactCFM = scalar(0.01);
  point.m_contactERP = scalar(0.1);
  return true;
}
bool contactProcessed(btManifoldPoint& point, void* a, void* b) {
  Lab& w = *lab;
  w.log.note("contact processed");
  LOG(w.number(static_cast<btCollisionObject*>(a)));
  LOG(w.number(static_cast<btCollisionObject*>(b)));
  point.m_userPersistentData = &w;
  return true;
}
bool contactDestroyed(void* data) {
  lab->log.exact("contact destroyed", data == lab);
  return true;
}
void contactStarted(btPersistentManifold* const& manifold) {
  lab->log.exact("contact started, A", lab->number(manifold->getBody0()));
  lab->log.exact("B", lab->number(manifold->getBody1()));
}
void contactEnded(btPersistentManifold* const& manifold) {
  lab->log.exact("contact ended, A", lab->number(manifold->getBody0()));
  lab->log.exact("B", lab->number(manifold->getBody1()));
}
template <int percent>
btScalar combined(const btCollisionObject* a, const btCollisionObject* b) {
  const double numbers = lab->number(a) + lab->number(b);
  return scalar(percent * 0.01 * (1 + 0.1 * numbers));
}
bool childPair(const btCollisionShape*, const btCollisionShape*) { return false; }

// An object of a type that another module of Bullet brings; it collides with nothing.
class OwnObject : public btCollisionObject {
 public:
  OwnObject(int type, btCollisionShape* shape) {
    m_internalType = type;
    setCollisionShape(shape);
    setWorldTransform(turnedAt(vector(0, 30, 0)));
  }
};

// How many lines of each colour, where they are in the mean, and all else in words.
class Drawer : public btIDebugDraw {
 public:
  explicit Drawer(Lab& w) : m_lab(w) {}
  using btIDebugDraw::drawLine;
  void drawLine(const btVector3& from, const btVector3& to, const btVector3& colour) override {
    const std::string name =
        std::to_string(colour.x()) + " " + std::to_string(colour.y()) + " " + std::to_string(colour.z());
    ++m_lines[name];
    m_middle += from + to;
  }
  void drawContactPoint(const btVector3& at, const btVector3& normal, btScalar distance, int life,
                        const btVector3&) override {
    m_lab.log.near("contact point", at);
    m_lab.log.near("normal", normal);
    m_lab.log.near("distance", distance);
    m_lab.log.exact("life", life);
  }
  void reportErrorWarning(const char* text) override { m_lab.log.note(text); }
  void draw3dText(const btVector3&, const char* text) override { m_lab.log.note(text); }
  void setDebugMode(int mode) override { m_mode = mode; }
  int getDebugMode() const override { return m_mode; }

  void finish(const std::string& mode) {
    int count = 0;
    for (const auto& [colour, lines] : m_lines) {
      m_lab.log.exact(mode + ", " + colour, lines);
      count += lines;
    }
    if (count > 0) m_lab.log.near(mode + ", mean", btVector3(m_middle / scalar(2 * count)));
    m_lines.clear();
    m_middle.setValue(0, 0, 0);
  }

 private:
  Lab& m_lab;
  int m_mode = 0;
  std::map<std::string, int> m_lines;
  btVector3 m_middle{0, 0, 0};
};

}  // namespace

// ---- btContactSolverInfo

API_CASE(SolverInfo, Contacts, OnDevice()) {
  balls(w);
  btContactSolverInfo& info = w.world.getSolverInfo();
  w.probe("as made");
  info.m_erp2 = scalar(0.4);
  w.probe("m_erp2");
  info.m_splitImpulse = false;
  w.probe("m_splitImpulse");
  info.m_erp = scalar(0.5);
  w.probeAny("m_erp, without split impulse");
  info.m_splitImpulse = true;
  w.probe("m_splitImpulse");
  info.m_splitImpulsePenetrationThreshold = scalar(-0.5);
  w.probe("m_splitImpulsePenetrationThreshold");
  info.m_splitImpulsePenetrationThreshold = scalar(-0.04);
  w.probe("m_splitImpulsePenetrationThreshold");
  info.m_linearSlop = scalar(-0.05);
  w.probe("m_linearSlop");
  info.m_globalCfm = scalar(0.02);
  w.probe("m_globalCfm");
  info.m_sor = scalar(0.5);
  info.m_numIterations = 2;
  w.probe("m_sor");
  info.m_restitutionVelocityThreshold = scalar(3);
  w.probe("m_restitutionVelocityThreshold");
  w.probe("two steps", 2);
  info.m_warmstartingFactor = scalar(0.1);
  w.probe("m_warmstartingFactor", 2);
}

// A box in the ground with one edge is turned out of it.
API_CASE(SolverInfo, Turn, OnDevice()) {
  w.world.setGravity(vector(0, 0, 0));
  w.objects.add(0, w.objects.sphere(1), vector(0, 0, 0));
  w.objects.add(1, w.objects.box(vector(1, 0.5, 1)), vector(0.4, 1.3, 0.2));
  w.start();
  w.probe("as made");
  w.world.getSolverInfo().m_splitImpulseTurnErp = scalar(0.9);
  w.probe("m_splitImpulseTurnErp");
}

API_CASE(SolverInfo, Joints, Shares("joints")) {
  btRigidBody *a, *b;
  addJointBodies(w.objects, a, b);
  const btTransform between = frameBetween(*a, *b);
  auto* j = w.objects.joint<btHingeConstraint>(false, *a, *b, frameIn(*a, between) * turnedAt(vector(0, 0.02, 0)),
                                               frameIn(*b, between), false);
  btJointFeedback feedback;
  j->setJointFeedback(&feedback);
  w.start();
  btContactSolverInfo& info = w.world.getSolverInfo();
  w.probe("as made");
  info.m_numIterations = 3;
  w.probe("m_numIterations");
  info.m_erp = scalar(0.7);
  w.probe("m_erp");
  info.m_globalCfm = scalar(0.05);
  w.probe("m_globalCfm");
  info.m_damping = scalar(0.5);
  w.probe("m_damping");
  info.m_numNonContactInnerIterations = 3;
  w.probeSame("m_numNonContactInnerIterations: of the solver of multi bodies");
  w.log.near("force", feedback.m_appliedForceBodyA, 120);
  info.m_jointFeedbackInWorldSpace = true;
  w.probeSame("m_jointFeedbackInWorldSpace");
  w.log.near("force", feedback.m_appliedForceBodyA, 120);
  info.m_jointFeedbackInJointFrame = true;
  w.probeSame("m_jointFeedbackInJointFrame");
  w.log.near("force", feedback.m_appliedForceBodyA, 120);
  w.log.near("torque", feedback.m_appliedTorqueBodyA, 120);
  j->setJointFeedback(nullptr);
}

API_CASE(SolverInfo, Gyroscopic, OnDevice()) {
  btRigidBody* body = w.objects.add(1, w.objects.box(vector(0.2, 0.5, 1)), vector(0, 5, 0));
  body->setFlags(BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT);
  body->setAngularVelocity(vector(3, 4, 5));
  w.start();
  w.probe("as made");
  w.world.getSolverInfo().m_maxGyroscopicForce = scalar(0.5);
  w.probe("m_maxGyroscopicForce");
}

// What stock's solver of rigid bodies does not look at.
API_CASE(SolverInfo, WithoutEffect, OnDevice()) {
  balls(w);
  btContactSolverInfo& info = w.world.getSolverInfo();
  w.probe("as made", 2);
  info.m_tau = scalar(0.1);
  info.m_friction = scalar(0.9);
  info.m_restitution = scalar(0.9);
  info.m_timeStep = scalar(0.5);
  info.m_maxErrorReduction = scalar(0.1);
  info.m_deformable_erp = scalar(0.9);
  info.m_deformable_cfm = scalar(0.9);
  info.m_deformable_maxErrorReduction = scalar(0.9);
  info.m_articulatedWarmstartingFactor = scalar(0.1);
  info.m_restingContactRestitutionThreshold = 99;
  info.m_minimumSolverBatchSize = 1;
  info.m_singleAxisRollingFrictionThreshold = scalar(0.5);
  w.probeSame("without effect", 2);
  LOG(info.m_timeStep);
  info.m_reportSolverAnalytics = 1;
  w.probeSame("m_reportSolverAnalytics", 2);
}

API_CASE(SolverInfo, ResidualThreshold, StockPath("m_leastSquaresResidualThreshold")) {
  balls(w);
  w.world.getSolverInfo().m_leastSquaresResidualThreshold = scalar(1e-4);
  w.step(3);
}

API_CASE(SolverMode, Modes, OnDevice()) {
  const Balls b = balls(w);
  b.rolling->setRollingFriction(0);  // its rows have modes of their own
  int& mode = w.world.getSolverInfo().m_solverMode;
  LOG(mode == (SOLVER_USE_WARMSTARTING | SOLVER_SIMD));
  w.probe("as made", 3);
  const std::vector<std::pair<const char*, int>> modes = {
      {"SOLVER_USE_2_FRICTION_DIRECTIONS", SOLVER_USE_2_FRICTION_DIRECTIONS},
      {"SOLVER_ENABLE_FRICTION_DIRECTION_CACHING", SOLVER_ENABLE_FRICTION_DIRECTION_CACHING},
      {"SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION", SOLVER_DISABLE_VELOCITY_DEPENDENT_FRICTION_DIRECTION},
      {"SOLVER_ALLOW_ZERO_LENGTH_FRICTION_DIRECTIONS", SOLVER_ALLOW_ZERO_LENGTH_FRICTION_DIRECTIONS},
      {"SOLVER_DISABLE_IMPLICIT_CONE_FRICTION", SOLVER_DISABLE_IMPLICIT_CONE_FRICTION}};
  const int before = mode;
  for (const auto& [name, bit] : modes) {
    mode = before | bit;
    w.probeAny(name, 3);
    mode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
    w.probeAny(std::string(name) + " with SOLVER_USE_2_FRICTION_DIRECTIONS", 3);
    mode |= SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS;
    w.probeAny(std::string(name) + " with SOLVER_INTERLEAVE_CONTACT_AND_FRICTION_CONSTRAINTS", 3);
  }
  mode = before & ~SOLVER_USE_WARMSTARTING;
  w.probe("no SOLVER_USE_WARMSTARTING", 3);
  mode = before | SOLVER_FRICTION_SEPARATE | SOLVER_CACHE_FRIENDLY | SOLVER_USE_ARTICULATED_WARMSTARTING;
  w.probe("warm starting, and bits that rigid bodies don't have", 3);
  mode = before;
  w.probeSame("without them", 3);
  mode = before & ~SOLVER_SIMD;  // another rounding in stock
  w.probeAny("no SOLVER_SIMD", 3);
}

API_CASE(SolverMode, RandomOrder, StockPath("SOLVER_RANDMIZE_ORDER")) {
  balls(w);
  w.world.getSolverInfo().m_solverMode |= SOLVER_RANDMIZE_ORDER;
  w.step(3);
}

// ---- btDispatcherInfo and the dispatcher's flags

API_CASE(DispatcherInfo, Fields, Shares("continuous collision detection (CCD)")) {
  const Balls b = balls(w);
  b.bouncing->setCcdMotionThreshold(scalar(0.01));
  b.bouncing->setCcdSweptSphereRadius(scalar(0.4));
  b.bouncing->setLinearVelocity(vector(0, -60, 0));
  b.bouncing->setWorldTransform(turnedAt(vector(0, 0.7, 3)));
  w.scale = 6;  // of the speed
  w.start();
  btDispatcherInfo& info = w.world.getDispatchInfo();
  w.probe("as made");
  LOG(info.m_timeStep);
  LOG(info.m_stepCount);
  LOG(info.m_dispatchFunc == btDispatcherInfo::DISPATCH_DISCRETE);
  LOG(info.m_timeOfImpact);
  LOG(info.m_debugDraw == nullptr);
  LOG(info.m_allowedCcdPenetration);
  info.m_useContinuous = false;
  w.probe("m_useContinuous");
  info.m_useContinuous = true;
  info.m_deterministicOverlappingPairs = true;
  w.probeAny("m_deterministicOverlappingPairs");
  info.m_enableSatConvex = true;
  info.m_enableSPU = false;
  info.m_useEpa = false;
  info.m_useConvexConservativeDistanceUtil = true;
  info.m_convexConservativeDistanceThreshold = scalar(0.5);
  info.m_timeOfImpact = scalar(0.5);
  info.m_stepCount = 7;
  w.probeSame("of algorithms that no pair has here");
  info.m_allowedCcdPenetration = scalar(0.1);
  w.probeAny("m_allowedCcdPenetration");
  LOG(btDispatcherInfo().m_useContinuous);
}

API_CASE(DispatcherInfo, Continuous, StockPath("continuous dispatch")) {
  balls(w);
  w.world.getDispatchInfo().m_dispatchFunc = btDispatcherInfo::DISPATCH_CONTINUOUS;
  w.step(2);
}

// What algorithms are asked for: the contacts of a step, or the points of a distance test.
API_CASE(Dispatcher, Queries, OnDevice()) {
  const Balls b = balls(w);
  w.step();
  for (const ebtDispatcherQueryType type : {BT_CONTACT_POINT_ALGORITHMS, BT_CLOSEST_POINT_ALGORITHMS}) {
    const btCollisionObjectWrapper one(nullptr, b.deep->getCollisionShape(), b.deep, b.deep->getWorldTransform(), -1,
                                       -1);
    const btCollisionObjectWrapper two(nullptr, b.rolling->getCollisionShape(), b.rolling,
                                       b.rolling->getWorldTransform(), -1, -1);
    btCollisionAlgorithm* algorithm = w.dispatcher.findAlgorithm(&one, &two, nullptr, type);
    LOG(algorithm != nullptr);
    algorithm->~btCollisionAlgorithm();
    w.dispatcher.freeCollisionAlgorithm(algorithm);
  }
  w.step();
}

API_CASE(Dispatcher, Flags, OnDevice()) {
  balls(w);
  const int before = w.dispatcher.getDispatcherFlags();
  LOG(before);
  w.probe("as made", 2);
  w.dispatcher.setDispatcherFlags(before & ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
  w.probeAny("no CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD", 2);
  w.dispatcher.setDispatcherFlags(before | btCollisionDispatcher::CD_STATIC_STATIC_REPORTED |
                                  btCollisionDispatcher::CD_DISABLE_CONTACTPOOL_DYNAMIC_ALLOCATION);
  w.probeAny("the others", 2);
}

// ---- objects of other modules

API_CASE(CollisionObjectTypes, SoftBody, StockPath("soft body")) {
  OwnObject object(btCollisionObject::CO_SOFT_BODY, balls(w).deep->getCollisionShape());
  w.world.addCollisionObject(&object, 0, 0);
  w.step(2);
  w.world.removeCollisionObject(&object);
}
API_CASE(CollisionObjectTypes, Link, StockPath("multibody link")) {
  OwnObject object(btCollisionObject::CO_FEATHERSTONE_LINK, balls(w).deep->getCollisionShape());
  w.world.addCollisionObject(&object, 0, 0);
  w.step(2);
  w.world.removeCollisionObject(&object);
}
API_CASE(CollisionObjectTypes, Own, StockPath("collision object of the application's own type")) {
  btCollisionShape* shape = balls(w).deep->getCollisionShape();
  OwnObject object(btCollisionObject::CO_USER_TYPE, shape), fluid(btCollisionObject::CO_HF_FLUID, shape);
  w.world.addCollisionObject(&object, 0, 0);
  w.world.addCollisionObject(&fluid, 0, 0);
  w.step(2);
  w.world.removeCollisionObject(&object);
  w.world.removeCollisionObject(&fluid);
}

// The types that a world may say it has; btgpu's say what they derive from.
API_CASE(WorldTypes, Ours, NoStep()) {
  LOG(w.world.getWorldType() == BT_DISCRETE_DYNAMICS_WORLD);
  for (const btDynamicsWorldType other :
       {BT_SIMPLE_DYNAMICS_WORLD, BT_CONTINUOUS_DYNAMICS_WORLD, BT_SOFT_RIGID_DYNAMICS_WORLD, BT_GPU_DYNAMICS_WORLD,
        BT_SOFT_MULTIBODY_DYNAMICS_WORLD, BT_DEFORMABLE_MULTIBODY_DYNAMICS_WORLD}) {
    LOG(w.world.getWorldType() == other);
  }
}

// ---- global variables

API_CASE(Globals, Sleeping, OnDevice()) {
  const Balls b = balls(w);
  b.deep->setWorldTransform(turnedAt(vector(0, 0.5, 0)));
  {
    const Global<btScalar> soon(gDeactivationTime, scalar(0.04));
    w.step(6);
    LOG(b.deep->getActivationState());
  }
  {
    const Global<bool> never(gDisableDeactivation, true);
    w.step(3);
    LOG(b.deep->getActivationState());
  }
}

API_CASE(Globals, Thresholds, OnDevice()) {
  const Balls b = balls(w);
  const Global<btScalar> margin(gDbvtMargin, scalar(0.2));
  const Global<btScalar> breaking(gContactBreakingThreshold, scalar(0.1));
  b.bouncing->setWorldTransform(turnedAt(vector(0, 0.53, 3)));
  w.step(2);
  w.logContacts("then");
}

API_CASE(Globals, StartedAndEnded, OnDevice()) {
  lab = &w;
  const Global<ContactStartedCallback> started(gContactStartedCallback, contactStarted);
  const Global<ContactEndedCallback> ended(gContactEndedCallback, contactEnded);
  balls(w);
  w.step(8);
}

API_CASE(Globals, ContactAdded, Shares("gContactAddedCallback")) {
  lab = &w;
  const Global<ContactAddedCallback> added(gContactAddedCallback, contactAdded);
  const Balls b = balls(w);
  b.rolling->setCollisionFlags(b.rolling->getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  w.step(3);
  w.logContacts("then", true, true);  // pairs with contacts by the CPU come first
}

API_CASE(Globals, ContactsWithCfm, Shares("gContactAddedCallback")) {
  lab = &w;
  const Global<ContactAddedCallback> added(gContactAddedCallback, contactWithCfm);
  const Balls b = balls(w);
  b.rolling->setCollisionFlags(b.rolling->getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  w.step(2);
}

API_CASE(Globals, ContactProcessed, Shares("gContactProcessedCallback")) {
  lab = &w;
  const Global<ContactProcessedCallback> processed(gContactProcessedCallback, contactProcessed);
  const Global<ContactDestroyedCallback> destroyed(gContactDestroyedCallback, contactDestroyed);
  const Balls b = balls(w);
  w.step(3);
  b.bouncing->setWorldTransform(turnedAt(vector(0, 5, 3)));
  w.step(2);
}

API_CASE(Globals, Combined, Shares("material combine callback")) {
  lab = &w;
  const Global<CalculateCombinedCallback> restitution(gCalculateCombinedRestitutionCallback, combined<50>);
  const Global<CalculateCombinedCallback> friction(gCalculateCombinedFrictionCallback, combined<70>);
  const Global<CalculateCombinedCallback> rolling(gCalculateCombinedRollingFrictionCallback, combined<20>);
  const Global<CalculateCombinedCallback> spinning(gCalculateCombinedSpinningFrictionCallback, combined<10>);
  const Global<CalculateCombinedCallback> damping(gCalculateCombinedContactDampingCallback, combined<1000>);
  const Global<CalculateCombinedCallback> stiffness(gCalculateCombinedContactStiffnessCallback, combined<30000>);
  const Balls b = balls(w);
  b.deep->setContactStiffnessAndDamping(500, 20);
  w.step(2);
  w.logContacts("then");
}

API_CASE(Globals, CompoundChildren, Shares("Compound shape")) {
  const Global<btShapePairCallback> compound(gCompoundChildShapePairCallback, childPair);
  const Global<btShapePairCallback> both(gCompoundCompoundChildShapePairCallback, childPair);
  w.world.setGravity(vector(0, -10, 0));
  btCompoundShape* shape = w.objects.shape<btCompoundShape>();
  shape->addChildShape(btTransform::getIdentity(), w.objects.sphere(scalar(0.5)));
  w.objects.add(0, w.objects.box(vector(9, 1, 9)), vector(0, -1, 0));
  w.objects.add(1, shape, vector(0, 0.49, 0));
  w.step(2);
  w.logContacts("then");
}

// ---- types of shapes that applications give their own

API_CASE(CustomShapes, Types, NoStep()) {
  LOG(btBroadphaseProxy::isConvex(CUSTOM_CONVEX_SHAPE_TYPE));
  LOG(btBroadphaseProxy::isPolyhedral(CUSTOM_POLYHEDRAL_SHAPE_TYPE));
  LOG(btBroadphaseProxy::isConcave(CUSTOM_CONCAVE_SHAPE_TYPE));
}

// ---- debug drawing

API_CASE(DebugDraw, Modes, Shares("joints")) {
  const Balls b = balls(w);
  b.deep->setCustomDebugColor(vector(0.2, 0.4, 0.6));
  b.rolling->setActivationState(DISABLE_DEACTIVATION);
  auto* hinge = w.objects.joint<btHingeConstraint>(false, *b.bouncing, vector(0, 1, 0), vector(0, 0, 1), false);
  hinge->setLimit(scalar(-0.5), scalar(0.5));
  w.objects.joint<btPoint2PointConstraint>(false, *b.deep, vector(0, 0.5, 0));
  btRigidBody* hidden = w.objects.add(1, w.objects.box(vector(1, 1, 1)), vector(9, 9, 0));
  hidden->setCollisionFlags(hidden->getCollisionFlags() | btCollisionObject::CF_DISABLE_VISUALIZE_OBJECT);
  Drawer drawer(w);
  LOG(w.world.getDebugDrawer() == nullptr);
  w.world.setDebugDrawer(&drawer);
  LOG(w.world.getDebugDrawer() == &drawer);
  w.step(2);
  const std::vector<std::pair<const char*, int>> modes = {
      {"DBG_NoDebug", btIDebugDraw::DBG_NoDebug},
      {"DBG_DrawWireframe", btIDebugDraw::DBG_DrawWireframe},
      {"DBG_DrawAabb", btIDebugDraw::DBG_DrawAabb},
      {"DBG_DrawFeaturesText", btIDebugDraw::DBG_DrawFeaturesText},
      {"DBG_DrawContactPoints", btIDebugDraw::DBG_DrawContactPoints},
      {"DBG_NoDeactivation", btIDebugDraw::DBG_NoDeactivation},
      {"DBG_NoHelpText", btIDebugDraw::DBG_NoHelpText},
      {"DBG_DrawText", btIDebugDraw::DBG_DrawText},
      {"DBG_ProfileTimings", btIDebugDraw::DBG_ProfileTimings},
      {"DBG_EnableSatComparison", btIDebugDraw::DBG_EnableSatComparison},
      {"DBG_DisableBulletLCP", btIDebugDraw::DBG_DisableBulletLCP},
      {"DBG_EnableCCD", btIDebugDraw::DBG_EnableCCD},
      {"DBG_DrawConstraints", btIDebugDraw::DBG_DrawConstraints},
      {"DBG_DrawConstraintLimits", btIDebugDraw::DBG_DrawConstraintLimits},
      {"DBG_FastWireframe", btIDebugDraw::DBG_FastWireframe},
      {"DBG_DrawNormals", btIDebugDraw::DBG_DrawNormals},
      {"DBG_DrawFrames", btIDebugDraw::DBG_DrawFrames}};
  for (const auto& [name, bit] : modes) {
    for (const int with : {0, int(btIDebugDraw::DBG_DrawWireframe)}) {
      drawer.setDebugMode(bit | with);
      w.world.debugDrawWorld();
      drawer.finish(name);
    }
    w.step();  // some modes look into steps: DBG_NoDeactivation, DBG_ProfileTimings
  }
  drawer.setDebugMode(btIDebugDraw::DBG_DrawConstraints | btIDebugDraw::DBG_DrawConstraintLimits);
  w.world.debugDrawConstraint(hinge);
  w.world.debugDrawObject(turnedAt(vector(1, 2, 3)), b.deep->getCollisionShape(), vector(1, 0, 0));
  w.world.btCollisionWorld::debugDrawWorld();
  drawer.finish("by hand");
  w.world.setDebugDrawer(nullptr);
}

}  // namespace btgpu::test::api
