// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Substeps of one stepSimulation: the device runs ahead while nothing needs the state in between. What comes out must
// be, bit for bit, what it is in a world whose substeps come one by one because a tick callback wants to see each.
#include <BulletCollision/CollisionDispatch/btGhostObject.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

constexpr int kSubsteps = 4;
const btScalar kTimeStep = btScalar(1.0 / 120.0);

btScalar s(double v) { return static_cast<btScalar>(v); }
btVector3 at(double x, double y, double z) { return {s(x), s(y), s(z)}; }

void nothing(btDynamicsWorld*, btScalar) {}

enum class Mode { Batched, OneByOne };

// A step of four substeps, or as many as are said.
void stepAll(btDynamicsWorld& world, int substeps = kSubsteps) {
  EXPECT_EQ(world.stepSimulation(btScalar(substeps) * kTimeStep, substeps + 2, kTimeStep), substeps);
}

struct SubstepWorld : GpuWorld {
  explicit SubstepWorld(Mode mode, const btGpuSettings& settings = {}) : GpuWorld(settings) {
    world.setGravity(btVector3(0, -10, 0));
    if (mode == Mode::OneByOne) world.setInternalTickCallback(nothing);
  }
  btRigidBody* add(double mass, btCollisionShape* shape, const btVector3& place) {
    btRigidBody* body = objects.add(s(mass), shape, place);
    body->setUserIndex(static_cast<int>(objects.bodies().size()) - 1);
    return body;
  }
  unsigned long long prefetched() const { return world.statistics().m_prefetchedSteps; }
};

// Towers, a heap of balls and capsules that falls in on itself, and a kinematic body.
void buildMixed(SubstepWorld& w) {
  w.add(0, w.objects.plane(btVector3(0, 1, 0), 0), at(0, 0, 0));
  auto* box = w.objects.box(at(0.5, 0.5, 0.5));
  for (int i = 0; i < 9; ++i) w.add(2, box, at(3 * (i / 3), 0.5 + 1.01 * (i % 3), 0));
  btCollisionShape *ball = w.objects.sphere(s(0.4)), *capsule = w.objects.capsule(s(0.3), s(0.5));
  for (int i = 0; i < 12; ++i) {
    w.add(1, i % 2 ? ball : capsule, at(-4 + 0.3 * (i % 3), 1 + 0.8 * (i / 3), 0.2 * (i % 2)));
  }
  btRigidBody* kinematic = w.add(0, box, at(12, 0.5, 0));
  kinematic->setCollisionFlags(kinematic->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
}

// The numbers of a contact point that an application can read.
std::vector<btScalar> numbersOf(const btManifoldPoint& p) {
  std::vector<btScalar> n = {
      p.m_distance1,        p.m_appliedImpulse,      p.m_appliedImpulseLateral1, p.m_appliedImpulseLateral2,
      p.m_combinedFriction, p.m_combinedRestitution, btScalar(p.m_lifeTime),     btScalar(p.m_contactPointFlags)};
  for (const btVector3& v : {p.m_localPointA, p.m_localPointB, p.m_positionWorldOnA, p.m_positionWorldOnB,
                             p.m_normalWorldOnB, p.m_lateralFrictionDir1, p.m_lateralFrictionDir2}) {
    n.insert(n.end(), {v.x(), v.y(), v.z()});
  }
  return n;
}

struct Contact {
  std::vector<btScalar> numbers;
  void* userData;
  bool operator==(const Contact& o) const { return numbers == o.numbers && userData == o.userData; }
};
using Contacts = std::map<std::pair<int, int>, std::vector<Contact>>;

// By the user indices of body 0 and 1; those with points.
template <typename Value, typename Read>
std::map<std::pair<int, int>, std::vector<Value>> readPoints(btDynamicsWorld& world, const Read& read) {
  std::map<std::pair<int, int>, std::vector<Value>> values;
  btDispatcher& dispatcher = *world.getDispatcher();
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& m = *dispatcher.getManifoldByIndexInternal(i);
    for (int k = 0; k < m.getNumContacts(); ++k) {
      values[{m.getBody0()->getUserIndex(), m.getBody1()->getUserIndex()}].push_back(read(m.getContactPoint(k)));
    }
  }
  return values;
}

Contacts contactsOf(btDynamicsWorld& world) {
  return readPoints<Contact>(world, [](const btManifoldPoint& p) {
    return Contact{numbersOf(p), p.m_userPersistentData};
  });
}

// Age of each point, by pair: one whose manifold is of an earlier substep is younger.
std::map<std::pair<int, int>, std::vector<int>> agesOf(btDynamicsWorld& world) {
  return readPoints<int>(world, [](const btManifoldPoint& p) { return p.m_lifeTime; });
}

void expectSameBodies(const SubstepWorld& a, const SubstepWorld& b, const std::string& what) {
  ASSERT_EQ(a.objects.bodies().size(), b.objects.bodies().size());
  for (size_t i = 0; i < a.objects.bodies().size(); ++i) {
    expectSame(stateOf(*a.objects.bodies()[i]), stateOf(*b.objects.bodies()[i]), what + ", body " + std::to_string(i));
  }
}

void expectSameRays(SubstepWorld& a, SubstepWorld& b, const std::string& what) {
  for (int i = 0; i < 40; ++i) {
    const btVector3 from = at(-5 + 0.5 * i, 10, 0.05 * i - 1), to = at(-5 + 0.45 * i, -1, 0.1);
    btCollisionWorld::ClosestRayResultCallback hitA(from, to), hitB(from, to);
    a.world.rayTest(from, to, hitA);
    b.world.rayTest(from, to, hitB);
    ASSERT_EQ(hitA.hasHit(), hitB.hasHit()) << what << ", ray " << i;
    EXPECT_EQ(hitA.m_closestHitFraction, hitB.m_closestHitFraction) << what << ", ray " << i;
    if (hitA.hasHit()) {
      EXPECT_EQ(hitA.m_collisionObject->getUserIndex(), hitB.m_collisionObject->getUserIndex()) << what;
    }
  }
}

void expectSameWorlds(SubstepWorld& a, SubstepWorld& b, const std::string& what) {
  expectSameBodies(a, b, what);
  EXPECT_TRUE(contactsOf(a.world) == contactsOf(b.world)) << what << ": contacts";
}

class Substeps : public ::testing::Test {
 protected:
  void SetUp() override { m_deactivationTime = gDeactivationTime; }
  void TearDown() override {
    gDeactivationTime = m_deactivationTime;
    gContactStartedCallback = nullptr;
    gContactEndedCallback = nullptr;
    gContactAddedCallback = nullptr;
  }

 private:
  btScalar m_deactivationTime = 0;
};

TEST_F(Substeps, SameAsOneByOneUntilAllSleep) {
  gDeactivationTime = s(0.5);  // some bodies fall asleep within a batch, whichever its length
  SubstepWorld batched(Mode::Batched), single(Mode::OneByOne);
  buildMixed(batched);
  buildMixed(single);
  size_t touching = 0;
  bool asleep = false, moving = false;
  unsigned long long steps = 0;
  for (int i = 0; i < 90; ++i) {
    const int substeps = i % 5 + 1;
    stepAll(batched.world, substeps);
    stepAll(single.world, substeps);
    const std::string what = "step " + std::to_string(i);
    expectSameWorlds(batched, single, what);
    expectSameRays(batched, single, what);
    if (HasFailure()) return;
    touching = std::max(touching, contactsOf(batched.world).size());
    for (const btRigidBody* b : batched.objects.bodies()) {
      (b->getActivationState() == ISLAND_SLEEPING ? asleep : moving) = true;
    }
    // All but the first of each, and but those after the first of all, which brought the bodies.
    steps += static_cast<unsigned long long>(substeps - 1);
    EXPECT_EQ(batched.prefetched(), steps) << what;
  }
  EXPECT_GT(touching, 15u);
  EXPECT_TRUE(asleep && moving);
  EXPECT_EQ(single.prefetched(), 0u);
  expectAllOnDevice(batched.world);
  EXPECT_EQ(batched.world.statistics().m_deviceSteps, 270u);
}

TEST_F(Substeps, WithoutHostQueriesOrContacts) {
  for (const bool contacts : {true, false}) {
    btGpuSettings settings;
    settings.m_hostQueries = false;
    settings.m_contacts = contacts;
    SubstepWorld batched(Mode::Batched, settings), single(Mode::OneByOne, settings);
    buildMixed(batched);
    buildMixed(single);
    batched.world.setForceUpdateAllAabbs(false);
    single.world.setForceUpdateAllAabbs(false);
    for (int i = 0; i < 30; ++i) {
      stepAll(batched.world);
      stepAll(single.world);
      expectSameWorlds(batched, single, "step " + std::to_string(i));
    }
    EXPECT_EQ(contactsOf(batched.world).empty(), !contacts);
    EXPECT_EQ(batched.prefetched(), 30u * 3 - 1);
  }
}

// Each change between two stepSimulations is found, and takes part from the first substep on.
TEST_F(Substeps, ChangesInBetween) {
  SubstepWorld batched(Mode::Batched), single(Mode::OneByOne);
  buildMixed(batched);
  buildMixed(single);
  for (int i = 0; i < 30; ++i) {
    for (SubstepWorld* w : {&batched, &single}) {
      const auto& bodies = w->objects.bodies();
      if (i % 3 == 0) bodies[3]->applyCentralImpulse(at(1, 2, 0.5));
      if (i % 4 == 0) bodies[15]->applyCentralForce(at(0, 30, 0));
      if (i == 10) w->world.removeRigidBody(bodies[6]);
      if (i == 13) w->world.addRigidBody(bodies[6]);
      if (i == 16) w->world.getSolverInfo().m_numIterations = 7;
      stepAll(w->world);
    }
    expectSameWorlds(batched, single, "step " + std::to_string(i));
  }
  EXPECT_EQ(batched.prefetched(), 30u * 3 - 2) << "all but those of the first substeps with new bodies";
}

// ---- motion states --------------------------------------------------------------------------------------------------

// Records what it is told; in one substep it may do something else.
struct Recorder : btMotionState {
  void getWorldTransform(btTransform& t) const override { t = last; }
  void setWorldTransform(const btTransform& t) override {
    last = t;
    told.push_back(t);
    if (static_cast<int>(told.size()) == when) action();
  }
  btTransform last = btTransform::getIdentity();
  std::vector<btTransform> told;
  int when = -1;
  std::function<void()> action;
};

struct RecordedWorld : SubstepWorld {
  explicit RecordedWorld(Mode mode, const btGpuSettings& settings = {}) : SubstepWorld(mode, settings) {
    buildMixed(*this);
    for (btRigidBody* body : objects.bodies()) {
      recorders.push_back(std::make_unique<Recorder>());
      recorders.back()->last = body->getWorldTransform();
      body->setMotionState(recorders.back().get());
    }
  }
  ~RecordedWorld() {
    for (btRigidBody* body : objects.bodies()) body->setMotionState(nullptr);
  }
  std::vector<std::unique_ptr<Recorder>> recorders;
};

void expectSameTales(const RecordedWorld& a, const RecordedWorld& b, size_t except = 1000) {
  for (size_t i = 0; i < a.recorders.size(); ++i) {
    if (i == except) continue;
    const auto &x = a.recorders[i]->told, &y = b.recorders[i]->told;
    ASSERT_EQ(x.size(), y.size()) << "body " << i;
    for (size_t k = 0; k < x.size(); ++k) EXPECT_TRUE(x[k] == y[k]) << "body " << i << ", substep " << k;
  }
}

TEST_F(Substeps, MotionStatesHearOfEachSubstep) {
  RecordedWorld batched(Mode::Batched), single(Mode::OneByOne);
  for (int i = 0; i < 12; ++i) {
    stepAll(batched.world);
    stepAll(single.world);
  }
  expectSameTales(batched, single);
  EXPECT_EQ(batched.recorders[3]->told.size(), 12u * kSubsteps);
  const auto& told = batched.recorders[18]->told;
  EXPECT_FALSE(told[21] == told[22]) << "each substep has a state of its own";
  EXPECT_EQ(batched.prefetched(), 12u * 3 - 1);
}

struct Meddling {
  const char* what;
  std::function<void(RecordedWorld&)> action;
};

// In a motion state, in the middle of a batch: the same as if substeps came one by one, and what the device had begun
// is thrown away.
TEST_F(Substeps, MotionStateChangesTheWorld) {
  const Meddling all[] = {
      {"impulse", [](RecordedWorld& w) { w.objects.bodies()[8]->applyCentralImpulse(at(2, 3, 1)); }},
      {"force", [](RecordedWorld& w) { w.objects.bodies()[14]->applyForce(at(0, 90, 5), at(0.1, 0, 0)); }},
      {"kinematic",
       [](RecordedWorld& w) {
         btTransform t = btTransform::getIdentity();
         t.setOrigin(at(7.2, 0.6, 0));
         w.objects.bodies().back()->setWorldTransform(t);
         w.objects.bodies().back()->activate(true);
       }},
      {"removal", [](RecordedWorld& w) { w.world.removeRigidBody(w.objects.bodies()[5]); }},
      {"new body", [](RecordedWorld& w) { w.add(3, w.objects.sphere(s(0.6)), at(0.2, 4.2, 0)); }},
      {"shape", [](RecordedWorld& w) { w.objects.bodies()[20]->setCollisionShape(w.objects.sphere(s(0.5))); }},
      {"settings", [](RecordedWorld& w) { w.world.getSolverInfo().m_numIterations = 3; }},
      {"ignored pair",
       [](RecordedWorld& w) { w.objects.bodies()[9]->setIgnoreCollisionCheck(w.objects.bodies()[8], true); }},
      {"friction", [](RecordedWorld& w) { w.objects.bodies()[12]->setFriction(s(0.05)); }},
      {"cleared forces", [](RecordedWorld& w) { w.world.clearForces(); }},
      {"NaN", [](RecordedWorld& w) { w.objects.bodies()[13]->setLinearVelocity(btVector3(0, s(NAN), 0)); }},
      {"AABB setting", [](RecordedWorld& w) { w.world.setForceUpdateAllAabbs(false); }},
  };
  for (const Meddling& m : all) {
    for (const int substep : {1, 2, 3}) {
      const std::string what = std::string(m.what) + " in substep " + std::to_string(substep);
      RecordedWorld batched(Mode::Batched), single(Mode::OneByOne);
      for (RecordedWorld* w : {&batched, &single}) {
        w->recorders[3]->when = 20 * kSubsteps + substep;
        w->recorders[3]->action = [w, &m] { m.action(*w); };
        for (int i = 0; i < 20; ++i) stepAll(w->world);
      }
      const auto before = batched.prefetched();
      for (int i = 0; i < 2; ++i) {
        stepAll(batched.world);
        stepAll(single.world);
        // NaN equals nothing. Contacts of an ignored pair are not looked at any more, but the host saw them later.
        if (std::string(m.what) != "NaN") expectSameBodies(batched, single, what);
        EXPECT_TRUE(agesOf(batched.world) == agesOf(single.world)) << what;
        if (std::string(m.what) != "ignored pair") {
          EXPECT_TRUE(contactsOf(batched.world) == contactsOf(single.world)) << what;
        }
      }
      // The host's broadphase predicts a body that is left out too, when it runs.
      expectSameTales(batched, single, std::string(m.what) == "NaN" ? 13 : 1000);
      EXPECT_LT(batched.prefetched() - before, 2u * 3) << what << ": not noticed";
      // With the other AABB setting substeps come one by one from then on.
      EXPECT_EQ(batched.prefetched() - before > 0, std::string(m.what) != "AABB setting" || substep > 1) << what;
      if (HasFailure()) return;
    }
  }
}

// ---- the CPU's part grows in the middle of a batch: it has to find the contacts of the last substep -----------------
// From there on the order of manifolds in the dispatcher counts, which depends on when each was made.

class SubstepsLeavingTheDevice : public Substeps {
 protected:
  static constexpr int kWhen = 25 * kSubsteps + 2;

  // Runs both worlds; `action` comes in the middle of a batch. Compares what the substep after that left.
  void run(const btGpuSettings& settings, const std::function<void(RecordedWorld&)>& action,
           const std::function<void(RecordedWorld&)>& undo) {
    std::unique_ptr<RecordedWorld> worlds[2];
    std::map<std::pair<int, int>, std::vector<int>> ages[2];
    for (const Mode mode : {Mode::Batched, Mode::OneByOne}) {
      auto& w = worlds[static_cast<int>(mode)];
      w = std::make_unique<RecordedWorld>(mode, settings);
      w->recorders[3]->when = kWhen;
      w->recorders[3]->action = [&] { action(*w); };
      w->recorders[4]->when = kWhen + 1;
      w->recorders[4]->action = [&] { ages[static_cast<int>(mode)] = agesOf(w->world); };
      for (int i = 0; i < 28; ++i) stepAll(w->world);
      undo(*w);
      for (int i = 0; i < 3; ++i) stepAll(w->world);
    }
    EXPECT_TRUE(ages[0] == ages[1]);
    EXPECT_GT(ages[0].size(), 8u);
    EXPECT_GT(worlds[0]->prefetched(), 26u * 3);
    for (size_t i = 0; i < worlds[0]->recorders.size(); ++i) {
      const auto &x = worlds[0]->recorders[i]->told, &y = worlds[1]->recorders[i]->told;
      ASSERT_EQ(x.size(), y.size());
      for (int k = 0; k < kWhen && k < static_cast<int>(x.size()); ++k) {
        EXPECT_TRUE(x[static_cast<size_t>(k)] == y[static_cast<size_t>(k)]) << "body " << i << ", substep " << k;
      }
      // One substep on, the solver's other order shows in what its ten iterations leave open.
      if (x.size() > kWhen) { EXPECT_LE(distance(x[kWhen].getOrigin(), y[kWhen].getOrigin()), 1e-4) << "body " << i; }
    }
  }
};

TEST_F(SubstepsLeavingTheDevice, ForTheStockPath) {
  for (const bool contacts : {true, false}) {
    btGpuSettings settings;
    settings.m_contacts = contacts;
    run(
        settings,
        [settings](RecordedWorld& w) {
          btGpuSettings stock = settings;
          stock.m_stockOnly = true;
          btGpuDynamicsWorld::configure(&w.world, stock);
        },
        [settings](RecordedWorld& w) {
          EXPECT_EQ(w.world.statistics().m_stockSteps, 2u * kSubsteps + 2u);
          btGpuDynamicsWorld::configure(&w.world, settings);
        });
  }
}

bool noContact(btManifoldPoint&, const btCollisionObjectWrapper*, int, int, const btCollisionObjectWrapper*, int, int) {
  return false;
}

TEST_F(SubstepsLeavingTheDevice, ForAContactCallback) {
  run(
      {},
      [](RecordedWorld& w) {
        gContactAddedCallback = noContact;
        for (const size_t i : {2u, 17u}) {
          btRigidBody* body = w.objects.bodies()[i];
          body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        }
      },
      [](RecordedWorld& w) {
        gContactAddedCallback = nullptr;
        EXPECT_FALSE(w.world.fallbackReport().empty());
        EXPECT_EQ(w.world.statistics().m_stockSteps, 0u);
      });
}

// ---- in the middle of a batch, on the device ------------------------------------------------------------------------

// Balls fly at each other: pairs explode in the middle of a batch. Aside a tower, whose contacts have a past.
void buildImplosion(SubstepWorld& w, double substepsToCentre) {
  w.world.setGravity(btVector3(0, 0, 0));
  w.add(0, w.objects.plane(btVector3(0, 1, 0), -60), at(0, 0, 0))->setUserIndex(1000);
  auto* box = w.objects.box(at(0.5, 0.5, 0.5));
  for (int i = 0; i < 3; ++i) w.add(1, box, at(0, -59.5 + i, 0))->setGravity(btVector3(0, -10, 0));
  auto* ball = w.objects.sphere(s(0.5));
  for (int i = 0; i < 90; ++i) {
    // A spiral on a sphere: no two are near each other.
    const double y = 1 - 2 * (i + 0.5) / 90, r = std::sqrt(1 - y * y), turn = 2.399963 * i;
    const btVector3 out = at(r * std::cos(turn), y, r * std::sin(turn));
    w.add(1, ball, out * 20)->setLinearVelocity(out * s(-20 / (substepsToCentre * double(kTimeStep))));
  }
}

TEST_F(Substeps, OverflowInEachSubstep) {
  bool seen[kSubsteps + 1] = {};
  for (const double substeps : {0.5, 1.5, 2.5, 3.5}) {
    SubstepWorld batched(Mode::Batched), single(Mode::OneByOne);
    for (SubstepWorld* w : {&batched, &single}) {
      buildImplosion(*w, substeps);
      // One step far apart, so that no body is new.
      for (btRigidBody* b : w->objects.bodies()) b->translate(b->getLinearVelocity() * -kTimeStep);
      stepAll(w->world, 1);
      EXPECT_EQ(w->world.statistics().m_repeatedSteps, 0u);
      EXPECT_LT(w->world.statistics().m_pairs, 300u);
      stepAll(w->world);
    }
    expectSameWorlds(batched, single, "over the centre after " + std::to_string(substeps));
    EXPECT_EQ(batched.world.statistics().m_repeatedSteps, single.world.statistics().m_repeatedSteps);
    EXPECT_GT(batched.world.statistics().m_repeatedSteps, 0u);
    seen[batched.prefetched()] = true;
    // And on from there.
    for (int i = 0; i < 3; ++i) {
      stepAll(batched.world);
      stepAll(single.world);
      expectSameWorlds(batched, single, "later");
    }
  }
  EXPECT_TRUE(seen[1] || seen[2]) << "some overflow hit a substep with another one ahead of it";
}

// A torque beyond what a float holds after two or three substeps.
TEST_F(Substeps, QuarantineInTheMiddle) {
  bool noticedInside = false;
  for (const double torque : {2e38, 1.5e38, 1e38}) {
    SubstepWorld batched(Mode::Batched), single(Mode::OneByOne);
    for (SubstepWorld* w : {&batched, &single}) {
      buildMixed(*w);
      for (int i = 0; i < 10; ++i) stepAll(w->world);
      btRigidBody* body = w->objects.bodies()[14];
      body->setFlags(body->getFlags() & ~BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY);
      body->setInvInertiaDiagLocal(btVector3(120, 120, 120));
      body->applyTorque(btVector3(0, s(torque), 0));
    }
    const auto before = batched.prefetched();
    for (int i = 0; i < 3; ++i) {
      stepAll(batched.world);
      stepAll(single.world);
      for (size_t k = 0; k < batched.objects.bodies().size(); ++k) {
        const btRigidBody &a = *batched.objects.bodies()[k], &b = *single.objects.bodies()[k];
        EXPECT_TRUE(a.getWorldTransform() == b.getWorldTransform()) << "body " << k;
        EXPECT_TRUE(a.getLinearVelocity() == b.getLinearVelocity()) << "body " << k;
      }
      EXPECT_TRUE(contactsOf(batched.world) == contactsOf(single.world));
      EXPECT_EQ(reportText(batched.world), reportText(single.world));
    }
    EXPECT_NE(reportText(batched.world).find("NaN or infinite result"), std::string::npos);
    noticedInside = noticedInside || batched.prefetched() - before == 8;
  }
  EXPECT_TRUE(noticedInside) << "a substep ahead was taken back";
}

// ---- contacts -------------------------------------------------------------------------------------------------------

// What the application left in a point stays with it over substeps that the host did not see.
TEST_F(Substeps, UserDataOfPoints) {
  static int names[4096];
  SubstepWorld batched(Mode::Batched), single(Mode::OneByOne);
  gDeactivationTime = s(0.6);
  size_t known = 0, moved = 0;
  for (SubstepWorld* w : {&batched, &single}) buildMixed(*w);
  for (int i = 0; i < 60; ++i) {
    for (SubstepWorld* w : {&batched, &single}) {
      if (i == 40) w->objects.bodies()[15]->activate(true);
      stepAll(w->world);
      int next = 0;
      btDispatcher& dispatcher = *w->world.getDispatcher();
      for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
        btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(m);
        for (int k = 0; k < manifold.getNumContacts(); ++k) {
          void*& data = manifold.getContactPoint(k).m_userPersistentData;
          if (!data && i % 2 == 0) {
            const int pair = manifold.getBody0()->getUserIndex() * 32 + manifold.getBody1()->getUserIndex();
            data = &names[4 * pair % 4096 + k];
          } else if (data && w == &batched) {
            ++known;
            moved += (static_cast<int*>(data) - names) % 4 != k;
          }
          ++next;
        }
      }
    }
    EXPECT_TRUE(contactsOf(batched.world) == contactsOf(single.world)) << "step " << i;
  }
  EXPECT_GT(known, 500u);
  EXPECT_GT(moved, 0u) << "some point came to another place";
  for (SubstepWorld* w : {&batched, &single}) {
    btDispatcher& dispatcher = *w->world.getDispatcher();
    for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
      btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(m);
      for (int k = 0; k < manifold.getNumContacts(); ++k) manifold.getContactPoint(k).m_userPersistentData = nullptr;
    }
  }
}

// ---- what wants to see each substep ---------------------------------------------------------------------------------

int calls = 0;
void countTick(btDynamicsWorld*, btScalar) { ++calls; }
void countContact(btPersistentManifold* const&) { ++calls; }

struct CountingAction : btActionInterface {
  void updateAction(btCollisionWorld*, btScalar) override { ++calls; }
  void debugDraw(btIDebugDraw*) override {}
};

TEST_F(Substeps, OneByOneForTickCallbacks) {
  for (const bool pre : {true, false}) {
    calls = 0;
    SubstepWorld w(Mode::Batched);
    buildMixed(w);
    w.world.setInternalTickCallback(countTick, nullptr, pre);
    for (int i = 0; i < 3; ++i) stepAll(w.world);
    EXPECT_EQ(calls, 3 * kSubsteps);
    EXPECT_EQ(w.prefetched(), 0u);
    w.world.setInternalTickCallback(nullptr, nullptr, pre);
    stepAll(w.world);
    EXPECT_EQ(w.prefetched(), 3u);
  }
}

TEST_F(Substeps, OneByOneForActionsAndJoints) {
  calls = 0;
  CountingAction action;
  SubstepWorld w(Mode::Batched);
  buildMixed(w);
  w.world.addAction(&action);
  for (int i = 0; i < 3; ++i) stepAll(w.world);
  w.world.removeAction(&action);
  EXPECT_EQ(calls, 3 * kSubsteps);
  EXPECT_EQ(w.prefetched(), 0u);
  auto* joint = w.objects.joint<btPoint2PointConstraint>(true, *w.objects.bodies()[3], at(0, 1, 0));
  for (int i = 0; i < 3; ++i) stepAll(w.world);
  EXPECT_EQ(w.prefetched(), 0u);
  w.objects.remove(joint);
  for (int i = 0; i < 3; ++i) stepAll(w.world);
  EXPECT_EQ(w.prefetched(), 9u);
  EXPECT_EQ(w.world.statistics().m_stockSteps, 0u);
}

TEST_F(Substeps, OneByOneForContactCallbacks) {
  int expected = 0;
  for (const Mode mode : {Mode::OneByOne, Mode::Batched}) {
    calls = 0;
    SubstepWorld w(mode);
    buildMixed(w);
    gContactStartedCallback = countContact;
    gContactEndedCallback = countContact;
    for (int i = 0; i < 30; ++i) stepAll(w.world);
    gContactStartedCallback = nullptr;
    gContactEndedCallback = nullptr;
    EXPECT_EQ(w.prefetched(), 0u);
    if (mode == Mode::OneByOne) expected = calls;
  }
  EXPECT_EQ(calls, expected);
  EXPECT_GT(calls, 30);
}

// A class of the application's own: its shapes are the host's.
class OwnCylinder : public btCylinderShape {
 public:
  using btCylinderShape::btCylinderShape;
};

TEST_F(Substeps, OneByOneForShapesOfTheHost) {
  SubstepWorld w(Mode::Batched);
  buildMixed(w);
  OwnCylinder cylinder(at(0.5, 0.5, 0.5));
  btRigidBody* body = w.add(1, &cylinder, at(20, 1, 0));
  for (int i = 0; i < 3; ++i) stepAll(w.world);
  EXPECT_EQ(w.prefetched(), 0u);
  w.world.removeRigidBody(body);
  for (int i = 0; i < 3; ++i) stepAll(w.world);
  EXPECT_EQ(w.prefetched(), 9u) << "the body that left changed the first substep only";
}

TEST_F(Substeps, OneByOneForAabbsOfSleepers) {
  SubstepWorld w(Mode::Batched);
  buildMixed(w);
  w.world.setForceUpdateAllAabbs(false);
  for (int i = 0; i < 3; ++i) stepAll(w.world);
  EXPECT_EQ(w.prefetched(), 0u) << "the host's broadphase has to see them fall asleep";
}

struct SeesEachSubstep : btGpuDynamicsWorld {
  using btGpuDynamicsWorld::btGpuDynamicsWorld;
  void internalSingleStepSimulation(btScalar timeStep) override {
    btGpuDynamicsWorld::internalSingleStepSimulation(timeStep);
    ++calls;
  }
};
struct SynchronizesItself : btGpuDynamicsWorld {
  using btGpuDynamicsWorld::btGpuDynamicsWorld;
  void synchronizeMotionStates() override {
    btGpuDynamicsWorld::synchronizeMotionStates();
    ++calls;
  }
};
struct SavesItself : btGpuDynamicsWorld {
  using btGpuDynamicsWorld::btGpuDynamicsWorld;
  void saveKinematicState(btScalar) override { ++calls; }  // stock's is not called: the count is not known
  // A stepSimulation of its own.
  void stepTwice() {
    internalSingleStepSimulation(kTimeStep);
    internalSingleStepSimulation(kTimeStep);
  }
};

template <typename World>
unsigned long long prefetchedBy(WorldOf<World>& w) {
  w.objects.add(1, w.objects.sphere(1), btVector3(0, 5, 0));
  for (int i = 0; i < 3; ++i) stepAll(w.world);
  EXPECT_EQ(w.world.statistics().m_deviceSteps, 3u * kSubsteps);
  return w.world.statistics().m_prefetchedSteps;
}

TEST_F(Substeps, OneByOneForDerivedWorlds) {
  calls = 0;
  WorldOf<SeesEachSubstep> a;
  EXPECT_EQ(prefetchedBy(a), 0u);
  WorldOf<SynchronizesItself> b;
  EXPECT_EQ(prefetchedBy(b), 0u);
  WorldOf<SavesItself> c;
  EXPECT_EQ(prefetchedBy(c), 0u);
  EXPECT_EQ(calls, 12 + 12 + 3);
  c.world.stepTwice();
  EXPECT_EQ(c.world.statistics().m_prefetchedSteps, 0u);
}

// A count that did not come from stepSimulation is not believed, and an odd one neither.
struct CallsOddly : btGpuDynamicsWorld {
  using btGpuDynamicsWorld::btGpuDynamicsWorld;
  void run(btScalar said, btScalar timeStep, int count) {
    saveKinematicState(said);
    for (int i = 0; i < count; ++i) internalSingleStepSimulation(timeStep);
  }
};

TEST_F(Substeps, OddCounts) {
  WorldOf<CallsOddly> w;
  w.world.setGravity(btVector3(0, -10, 0));
  w.objects.add(1, w.objects.sphere(1), btVector3(0, 5, 0));
  w.world.run(kTimeStep, kTimeStep, 1);
  for (const btScalar said : {s(2.5), s(0), s(-4), s(1e9), s(NAN), s(INFINITY), s(0.1)}) {
    w.world.run(said * kTimeStep, kTimeStep, 3);
    EXPECT_EQ(w.world.statistics().m_prefetchedSteps, 0u) << double(said);
  }
  // More are announced than come; then fewer.
  w.world.run(s(6) * kTimeStep, kTimeStep, 2);
  EXPECT_EQ(w.world.statistics().m_prefetchedSteps, 1u);
  w.world.run(s(2) * kTimeStep, kTimeStep, 5);
  EXPECT_EQ(w.world.statistics().m_prefetchedSteps, 2u);
  // What was begun too much was thrown away.
  WorldOf<btDiscreteDynamicsWorld> stock;
  stock.world.setGravity(btVector3(0, -10, 0));
  stock.objects.add(1, stock.objects.sphere(1), btVector3(0, 5, 0));
  EXPECT_GT(w.world.statistics().m_deviceSteps, 20u);
  EXPECT_EQ(w.world.statistics().m_stockSteps, 0u);
}

TEST_F(Substeps, WorldGoesInTheMiddleOfABatch) {
  auto w = std::make_unique<WorldOf<CallsOddly>>();
  for (int i = 0; i < 50; ++i) w->objects.add(1, w->objects.sphere(s(0.5)), at(i, 5, 0));
  w->world.run(kTimeStep, kTimeStep, 1);
  w->world.run(s(6) * kTimeStep, kTimeStep, 2);
  EXPECT_EQ(w->world.statistics().m_prefetchedSteps, 1u);
  w.reset();
  // And another engine.
  w = std::make_unique<WorldOf<CallsOddly>>();
  w->objects.add(1, w->objects.sphere(1), btVector3(0, 5, 0));
  w->world.run(kTimeStep, kTimeStep, 1);
  w->world.run(s(6) * kTimeStep, kTimeStep, 2);
  btGpuSettings settings;
  settings.m_profile = true;
  btGpuDynamicsWorld::configure(&w->world, settings);
  w->world.run(s(6) * kTimeStep, kTimeStep, 6);
  EXPECT_EQ(w->world.statistics().m_stockSteps, 0u);
}

}  // namespace
}  // namespace btgpu::test
