// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Ray tests, sweeps, contact tests and ghost objects after a step, and inside a tick callback and an action,
// answer as in stock; without host queries they see the poses of the last step on the stock path.
#include <BulletCollision/CollisionDispatch/btGhostObject.h>

#include <set>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

btScalar s(double v) { return static_cast<btScalar>(v); }

// What was asked, and what came out: indices in the world's array, and numbers.
struct Answer {
  std::string what;
  std::set<int> objects;
  double number = 0;
};

struct Hits : btCollisionWorld::ContactResultCallback {
  std::set<int> objects;
  double deepest = 0;
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int,
                           const btCollisionObjectWrapper* b, int, int) override {
    objects.insert(a->getCollisionObject()->getWorldArrayIndex());
    objects.insert(b->getCollisionObject()->getWorldArrayIndex());
    deepest = std::min(deepest, double(point.getDistance()));
    return 0;
  }
};

void askRays(btCollisionWorld& world, std::vector<Answer>& answers) {
  for (int i = 0; i < 6; ++i) {
    const btVector3 from(s(3 * i + 0.1), 30, s(0.05)), to(s(3 * i + 0.2), -5, s(0.1));
    btCollisionWorld::ClosestRayResultCallback ray(from, to);
    world.rayTest(from, to, ray);
    Answer answer{"ray " + std::to_string(i), {}, double(ray.m_closestHitFraction)};
    if (ray.hasHit()) answer.objects.insert(ray.m_collisionObject->getWorldArrayIndex());
    answers.push_back(answer);
  }
  const btVector3 from(-5, s(0.4), 0), to(30, s(0.4), 0);
  btCollisionWorld::AllHitsRayResultCallback all(from, to);
  world.rayTest(from, to, all);
  Answer answer{"ray through all", {}, 0};
  for (int i = 0; i < all.m_collisionObjects.size(); ++i)
    answer.objects.insert(all.m_collisionObjects[i]->getWorldArrayIndex());
  answers.push_back(answer);
}

void askSweep(btCollisionWorld& world, std::vector<Answer>& answers) {
  btSphereShape sphere(s(0.3));
  const btVector3 from(s(3.1), 30, 0), to(s(3.1), -5, 0);
  btCollisionWorld::ClosestConvexResultCallback sweep(from, to);
  world.convexSweepTest(&sphere, btTransform(btQuaternion::getIdentity(), from),
                        btTransform(btQuaternion::getIdentity(), to), sweep);
  Answer answer{"sweep", {}, double(sweep.m_closestHitFraction)};
  if (sweep.hasHit()) answer.objects.insert(sweep.m_hitCollisionObject->getWorldArrayIndex());
  answers.push_back(answer);
}

void askContacts(btCollisionWorld& world, std::vector<Answer>& answers) {
  btSphereShape probeShape(s(1.2));
  btCollisionObject probe;
  probe.setCollisionShape(&probeShape);
  probe.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(6, 1, 0)));
  Hits hits;
  world.contactTest(&probe, hits);
  hits.objects.erase(-1);
  answers.push_back({"contact test", hits.objects, hits.deepest});
  Hits pair;
  world.contactPairTest(world.getCollisionObjectArray()[0], world.getCollisionObjectArray()[1], pair);
  answers.push_back({"contact pair test", pair.objects, pair.deepest});
}

void askAll(btCollisionWorld& world, std::vector<Answer>& answers) {
  askRays(world, answers);
  askSweep(world, answers);
  askContacts(world, answers);
}

// Balls and boxes that fall past the rays and come to rest, three units apart.
template <typename World>
struct Scene : btActionInterface {
  WorldOf<World> w;
  std::vector<Answer> answers;
  bool inCallbacks = false;

  template <typename... Settings>
  explicit Scene(const Settings&... settings) : w(settings...) {
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    btCollisionShape* shapes[] = {w.objects.sphere(s(0.5)), w.objects.sphere(s(0.7))};
    for (int i = 0; i < 6; ++i) {
      btRigidBody* body = w.objects.add(1, shapes[i % 2], btVector3(s(3 * i), s(0.8 + 1.7 * i), 0));
      body->setLinearVelocity(btVector3(s(0.2 * i), 0, s(0.01 * i)));
    }
    w.objects.bodies()[2]->setRestitution(s(0.5));
    w.world.addAction(this);
    w.world.setInternalTickCallback(tick, this);
  }
  ~Scene() override { w.world.removeAction(this); }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  static void tick(btDynamicsWorld* world, btScalar) {
    auto* scene = static_cast<Scene*>(world->getWorldUserInfo());
    if (scene->inCallbacks) askAll(*world, scene->answers);
  }
  void updateAction(btCollisionWorld* world, btScalar) override {
    if (inCallbacks) askAll(*world, answers);
  }
  void debugDraw(btIDebugDraw*) override {}
};

void expectSameAnswers(const std::vector<Answer>& ours, const std::vector<Answer>& stock, double tolerance) {
  ASSERT_EQ(ours.size(), stock.size());
  for (size_t i = 0; i < ours.size(); ++i) {
    ASSERT_EQ(ours[i].what, stock[i].what);
    ASSERT_EQ(ours[i].objects, stock[i].objects) << "answer " << i << ": " << ours[i].what;
    ASSERT_NEAR(ours[i].number, stock[i].number, tolerance) << "answer " << i << ": " << ours[i].what;
  }
}

// Fractions of a ray of 35 units and depths: poses within float noise, Bullet's casts stop at 1e-4 of the
// ray.
constexpr double kCastTolerance = 2e-4;

TEST(Queries, AfterEachStep) {
  Scene<btGpuDynamicsWorld> gpu;
  Scene<btDiscreteDynamicsWorld> stock;
  for (int i = 0; i < 90; ++i) {
    gpu.w.run(1);
    stock.w.run(1);
    askAll(gpu.w.world, gpu.answers);
    askAll(stock.w.world, stock.answers);
  }
  expectSameAnswers(gpu.answers, stock.answers, kCastTolerance);
  std::set<std::set<int>> different;
  for (const Answer& answer : stock.answers) different.insert(answer.objects);
  EXPECT_GT(different.size(), 8u) << "the questions should have several answers";
  expectAllOnDevice(gpu.w.world, {"actions"});
}

TEST(Queries, InsideCallbacks) {
  Scene<btGpuDynamicsWorld> gpu;
  Scene<btDiscreteDynamicsWorld> stock;
  gpu.inCallbacks = stock.inCallbacks = true;
  gpu.w.run(90);
  stock.w.run(90);
  EXPECT_EQ(stock.answers.size(), 90u * 2 * 10);
  expectSameAnswers(gpu.answers, stock.answers, kCastTolerance);
  expectAllOnDevice(gpu.w.world, {"actions"});
}

// A body that the application moved is found where it is once a step has been made.
TEST(Queries, BodyMovedByTheApplication) {
  Scene<btGpuDynamicsWorld> gpu;
  Scene<btDiscreteDynamicsWorld> stock;
  const auto run = [](auto& scene) {
    scene.w.run(5);
    btRigidBody* body = scene.w.objects.bodies()[4];
    body->setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(s(0.1), 20, 0)));
    body->setLinearVelocity(btVector3(0, 0, 0));
    scene.w.run(1);
    askAll(scene.w.world, scene.answers);
  };
  run(gpu);
  run(stock);
  expectSameAnswers(gpu.answers, stock.answers, kCastTolerance);
  EXPECT_EQ(stock.answers.front().objects, std::set<int>{4});
}

// Turned off, the broadphase stays as it was, and the simulation is the same.
TEST(Queries, TurnedOff) {
  btGpuSettings off;
  off.m_hostQueries = false;
  Scene<btGpuDynamicsWorld> gpu(off);
  Scene<btGpuDynamicsWorld> with;
  const auto cast = [](btCollisionWorld& world) {
    const btVector3 from(15, 30, 0), to(15, -5, 0);
    btCollisionWorld::ClosestRayResultCallback ray(from, to);
    world.rayTest(from, to, ray);
    return ray.hasHit() ? ray.m_collisionObject->getWorldArrayIndex() : -1;
  };
  // A body that left its box in the broadphase: found with host queries, not found without.
  for (Scene<btGpuDynamicsWorld>* scene : {&gpu, &with}) {
    btRigidBody* body = scene->w.objects.bodies()[5];
    body->setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(15, 20, 5)));
    body->setLinearVelocity(btVector3(0, 0, -30));
    body->setGravity(btVector3(0, 0, 0));
    scene->w.run(1);
  }
  while (double(with.w.objects.bodies()[5]->getWorldTransform().getOrigin().z()) > 0.1) {
    gpu.w.run(1);
    with.w.run(1);
  }
  EXPECT_EQ(cast(with.w.world), 5);
  EXPECT_NE(cast(gpu.w.world), 5) << "the setting should keep the host's broadphase as it was";
  gpu.w.run(60);
  with.w.run(60);
  for (size_t i = 0; i < 7; ++i) {
    expectSame(stateOf(*gpu.w.objects.bodies()[i]), stateOf(*with.w.objects.bodies()[i]), "body " + std::to_string(i));
  }
  expectAllOnDevice(gpu.w.world, {"actions"});
  // Turned on again, they are right after the next step.
  btGpuDynamicsWorld::configure(&gpu.w.world, btGpuSettings());
  gpu.w.run(1);
  with.w.run(1);
  askAll(gpu.w.world, gpu.answers);
  askAll(with.w.world, with.answers);
  expectSameAnswers(gpu.answers, with.answers, 0);
}

// A ghost that bodies fall through, one that moves with the application, one of Bullet's plain kind.
template <typename World>
struct Ghosts {
  btGhostPairCallback pairCallback;  // outlives the world
  WorldOf<World> w;
  btPairCachingGhostObject column, mover;
  btGhostObject plain;
  std::vector<int> overlaps;

  Ghosts() {
    w.broadphase.getOverlappingPairCache()->setInternalGhostPairCallback(&pairCallback);
    w.world.setGravity(btVector3(0, -10, 0));
    w.objects.add(0, w.objects.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
    btCollisionShape* ball = w.objects.sphere(s(0.5));
    for (int i = 0; i < 8; ++i) {
      btRigidBody* body = w.objects.add(1, ball, btVector3(s(2 * i), s(6 + i), 0));
      body->setLinearVelocity(btVector3(s(-0.3 * i), 0, 0));
      // Damping shortens the way that the broadphase looks ahead.
      body->setDamping(s(0.1 * i), 0);
    }
    add(column, w.objects.box(btVector3(3, 2, 3)), btVector3(4, 3, 0));
    add(mover, w.objects.sphere(2), btVector3(0, 1, 0));
    add(plain, w.objects.box(btVector3(30, 1, 3)), btVector3(0, 2, 0));
  }
  ~Ghosts() {
    for (btGhostObject* ghost : {static_cast<btGhostObject*>(&column), static_cast<btGhostObject*>(&mover), &plain}) {
      w.world.removeCollisionObject(ghost);
    }
  }
  Ghosts(const Ghosts&) = delete;
  Ghosts& operator=(const Ghosts&) = delete;

  void add(btGhostObject& ghost, btCollisionShape* shape, const btVector3& at) {
    ghost.setCollisionShape(shape);
    ghost.setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
    ghost.setCollisionFlags(ghost.getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
    w.world.addCollisionObject(&ghost);
  }
  static std::set<int> inside(const btGhostObject& ghost) {
    std::set<int> objects;
    for (int i = 0; i < ghost.getNumOverlappingObjects(); ++i)
      objects.insert(ghost.getOverlappingObject(i)->getWorldArrayIndex());
    return objects;
  }
  std::vector<std::set<int>> step() {
    btTransform t = mover.getWorldTransform();
    t.getOrigin() += btVector3(s(0.1), 0, 0);
    mover.setWorldTransform(t);
    w.run(1);
    return {inside(column), inside(mover), inside(plain)};
  }
};

TEST(GhostObjects, OverlapAsInStock) {
  Ghosts<btGpuDynamicsWorld> gpu;
  Ghosts<btDiscreteDynamicsWorld> stock;
  size_t changes = 0;
  std::vector<std::set<int>> last;
  for (int i = 0; i < 150; ++i) {
    const auto ours = gpu.step(), theirs = stock.step();
    ASSERT_EQ(ours, theirs) << "step " << i;
    if (theirs != last) ++changes;
    last = theirs;
  }
  EXPECT_GT(changes, 10u) << "bodies should come and go";
  // Ghosts don't push.
  for (size_t i = 1; i < 9; ++i) {
    const BodyState a = stateOf(*gpu.w.objects.bodies()[i]), b = stateOf(*stock.w.objects.bodies()[i]);
    EXPECT_LE(distance(a.transform.getOrigin(), b.transform.getOrigin()), 1e-3) << "body " << i;
  }
  expectAllOnDevice(gpu.w.world);
}

// The contacts of a pair caching ghost, found as character controllers do it.
template <typename World>
std::set<int> touching(Ghosts<World>& ghosts) {
  btHashedOverlappingPairCache* cache = ghosts.column.getOverlappingPairCache();
  btDispatcher* dispatcher = ghosts.w.world.getDispatcher();
  dispatcher->dispatchAllCollisionPairs(cache, ghosts.w.world.getDispatchInfo(), dispatcher);
  std::set<int> objects;
  for (int i = 0; i < cache->getNumOverlappingPairs(); ++i) {
    const btBroadphasePair& pair = cache->getOverlappingPairArray()[i];
    btManifoldArray manifolds;
    if (pair.m_algorithm) pair.m_algorithm->getAllContactManifolds(manifolds);
    for (int k = 0; k < manifolds.size(); ++k) {
      if (manifolds[k]->getNumContacts() == 0) continue;
      objects.insert(manifolds[k]->getBody0()->getWorldArrayIndex());
      objects.insert(manifolds[k]->getBody1()->getWorldArrayIndex());
    }
  }
  return objects;
}

TEST(GhostObjects, ContactsOfItsPairs) {
  Ghosts<btGpuDynamicsWorld> gpu;
  Ghosts<btDiscreteDynamicsWorld> stock;
  size_t most = 0;
  for (int i = 0; i < 60; ++i) {
    gpu.step();
    stock.step();
    const std::set<int> ours = touching(gpu), theirs = touching(stock);
    ASSERT_EQ(ours, theirs) << "step " << i;
    most = std::max(most, theirs.size());
  }
  EXPECT_GT(most, 3u) << "several bodies should be in the ghost at once";
  expectAllOnDevice(gpu.w.world);
}

}  // namespace
}  // namespace btgpu::test
