// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Stage 48 against Bullet's own manifolds.
#include <btBulletCollisionCommon.h>

#include <memory>

#include "gpu_engine/stages/42_collide_primitives.h"
#include "tests/stages/48_reduce_and_match_contacts_fixture.h"
#include "tests/support/bullet_convert.h"

namespace btgpu {
namespace {

TEST_F(MatchContactsTest, AFifthPointReplacesTheOneThatBulletReplacesSmall) {
  const float4 corners[] = {below(1, 1.1f, -0.01f), below(1.2f, -1, -0.01f), below(-1, -1.3f, -0.01f),
                            below(-1.4f, 1, -0.01f)};
  const float4 fifths[] = {below(1.5f, -1.4f, -0.01f),  below(-1.7f, 1.5f, -0.01f), below(1.6f, 1.5f, -0.01f),
                           below(-1.5f, -1.8f, -0.01f), below(0.1f, -0.2f, -0.01f), below(0.1f, 1.2f, -0.03f)};
  Stage48Input in;
  const int brick = in.world.world.box({1, 0.25f, 1, 0});
  std::vector<int> expected;
  btCollisionObject objectA, objectB;
  for (const float4 fifth : fifths) {
    for (int deepest = -1; deepest < 4; ++deepest) {
      in.world.add(brick, at(0, 0, 0), brick, at(0, -0.5f, 0));
      std::vector<float4> four(corners, corners + 4);
      if (deepest >= 0)
        four[static_cast<size_t>(deepest)] = four[static_cast<size_t>(deepest)] + float4{0, 0.01f, 0, -0.01f};
      in.contacts.push_back(candidates(kUp, four));
      btPersistentManifold bullet(&objectA, &objectB, 0, 0.02f, 1e18f);
      const auto pointOf = [](float4 p) {
        return btManifoldPoint({p.x, p.y + p.w, p.z}, {p.x, p.y + 0.5f, p.z}, {0, 1, 0}, p.w);
      };
      for (const float4 p : four) bullet.addManifoldPoint(pointOf(p));
      expected.push_back(bullet.addManifoldPoint(pointOf(fifth)));
      // The deepest point is never given up, unless the new one is deeper.
      EXPECT_TRUE(deepest < 0 || fifth.w < -0.02f || expected.back() != deepest);
    }
  }
  nextStep(in, device(in));
  for (size_t i = 0; i < in.contacts.size(); ++i) in.contacts[i] = candidates(kUp, {fifths[i / 5]});
  const auto manifolds = expectAsReference(in);
  for (size_t i = 0; i < manifolds.size(); ++i) {
    ASSERT_EQ(manifolds[i].pointCount, 4);
    for (int k = 0; k < 4; ++k) EXPECT_EQ(manifolds[i].points[k].lifeTime, k == expected[i] ? 1 : 2) << i << ", " << k;
  }
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(std::unique(expected.begin(), expected.end()) - expected.begin(),
            4);  // each of the four was replaced
}

void expectAsBullet(const Manifold& m, const btPersistentManifold& bullet) {
  ASSERT_EQ(m.pointCount, bullet.getNumContacts());
  for (int k = 0; k < m.pointCount; ++k) {
    const ContactPoint& p = m.points[k];
    const btManifoldPoint& b = bullet.getContactPoint(k);
    EXPECT_LE((toBullet(p.localPointA) - b.m_localPointA).length(), 1e-5f) << k;
    EXPECT_LE((toBullet(p.localPointB) - b.m_localPointB).length(), 1e-5f) << k;
    EXPECT_NEAR(p.localPointA.w, b.getDistance(), 1e-5f) << k;
    EXPECT_LE((toBullet(p.lateralFrictionDir1) - b.m_lateralFrictionDir1).length(), 1e-6f) << k;
    EXPECT_LE((toBullet(p.lateralFrictionDir2) - b.m_lateralFrictionDir2).length(), 1e-6f) << k;
    EXPECT_EQ(p.localPointB.w, b.m_appliedImpulse) << k;
    EXPECT_EQ(p.normalWorldOnB.w, b.m_appliedImpulseLateral1) << k;
    EXPECT_EQ(p.lateralFrictionDir1.w, b.m_appliedImpulseLateral2) << k;
    EXPECT_EQ(p.lifeTime, b.getLifeTime()) << k;
    EXPECT_EQ(p.flags & POINT_BULLET_FLAGS, b.m_contactPointFlags) << k;
    EXPECT_FLOAT_EQ(p.combined.x, b.m_combinedFriction) << k;
    EXPECT_FLOAT_EQ(p.combined.y, b.m_combinedRestitution) << k;
  }
}

// Gives Bullet's points the impulses that nextStep gave ours.
void copyImpulses(const Manifold& m, btPersistentManifold& bullet) {
  for (int k = 0; k < m.pointCount && k < bullet.getNumContacts(); ++k) {
    bullet.getContactPoint(k).m_appliedImpulse = m.points[k].localPointB.w;
    bullet.getContactPoint(k).m_appliedImpulseLateral1 = m.points[k].normalWorldOnB.w;
    bullet.getContactPoint(k).m_appliedImpulseLateral2 = m.points[k].lateralFrictionDir1.w;
  }
}

// 48 moving pairs over 60 steps: the same candidates, at most four, go into a real btPersistentManifold
// through btManifoldResult.
TEST_F(MatchContactsTest, FollowsBulletsManifoldForSixtySteps) {
  std::mt19937 random(7);
  constexpr size_t kPairs = 48;
  Stage48Input in = randomInput(random, kPairs);
  btBoxShape shape({1, 1, 1});
  std::vector<std::unique_ptr<btCollisionObject>> objects;
  std::vector<std::unique_ptr<btPersistentManifold>> manifolds;
  for (uint body = 0; body < 2 * kPairs; ++body) {
    objects.push_back(std::make_unique<btCollisionObject>());
    objects[body]->setCollisionShape(&shape);
    objects[body]->setFriction(in.world.world.material(body).friction = uniform(random, 0, 2));
    // Every fourth pair has friction anchors, which hold the point that a new one would replace.
    if (body % 8 == 3) {
      in.world.world.info(body).flags |= BODY_FRICTION_ANCHOR;
      objects[body]->setCollisionFlags(objects[body]->getCollisionFlags() | btCollisionObject::CF_HAS_FRICTION_ANCHOR);
    }
    objects[body]->setRestitution(in.world.world.material(body).restitution = uniform(random, 0, 1));
  }
  for (size_t i = 0; i < kPairs; ++i) {
    manifolds.push_back(
        std::make_unique<btPersistentManifold>(objects[2 * i].get(), objects[2 * i + 1].get(), 0, 0.02f, 1e18f));
  }
  size_t replaced = 0, dropped = 0, matched = 0;
  for (int step = 0; step < 60; ++step) {
    for (size_t i = 0; i < kPairs; ++i) {
      BodyPose& a = in.world.world.pose(in.world.pairs[i].bodyA);
      a.position += uniform3(random, -0.006f, 0.006f);
      a.orientation = turnProduct(turnAbout(uniform3(random, -1, 1), uniform(random, -0.004f, 0.004f)), a.orientation);
      RawContacts& raw = in.contacts[i];
      if (random() % 4 == 0) raw = randomCandidates(random, static_cast<int>(random() % 5), 0.2f);
      raw.count = std::min(raw.count, MANIFOLD_POINTS);
      for (int k = 0; k < raw.count; ++k) {
        const float w = raw.points[k].w;
        raw.points[k] += uniform3(random, -0.004f, 0.004f);
        raw.points[k].w = w;
      }
    }
    auto ours = device(in);
    for (size_t i = 0; i < kPairs; ++i) {
      SCOPED_TRACE(testing::Message() << "step " << step << ", pair " << i);
      const Pair& pair = in.world.pairs[i];
      btCollisionObject &a = *objects[pair.bodyA], &b = *objects[pair.bodyB];
      a.setWorldTransform(toBullet(in.world.world.pose(pair.bodyA)));
      b.setWorldTransform(toBullet(in.world.world.pose(pair.bodyB)));
      const btCollisionObjectWrapper wrapA(nullptr, &shape, &a, a.getWorldTransform(), -1, -1);
      const btCollisionObjectWrapper wrapB(nullptr, &shape, &b, b.getWorldTransform(), -1, -1);
      btManifoldResult result(&wrapA, &wrapB);
      result.setPersistentManifold(manifolds[i].get());
      const RawContacts& raw = in.contacts[i];
      const int before = manifolds[i]->getNumContacts();
      for (int k = 0; k < raw.count; ++k) {
        result.addContactPoint(toBullet(raw.normal), toBullet(raw.points[k]) + a.getWorldTransform().getOrigin(),
                               raw.points[k].w);
      }
      replaced += before == 4 && raw.count > 0;
      const int added = manifolds[i]->getNumContacts();
      result.refreshContactPoints();
      dropped += manifolds[i]->getNumContacts() < added;
      for (int k = 0; k < manifolds[i]->getNumContacts(); ++k)
        matched += manifolds[i]->getContactPoint(k).getLifeTime() > 5;
      expectAsBullet(ours[i], *manifolds[i]);
    }
    if (HasFailure()) return;
    nextStep(in, std::move(ours));
    for (size_t i = 0; i < kPairs; ++i) copyImpulses(in.world.oldManifolds[i], *manifolds[i]);
  }
  EXPECT_GT(replaced, 50u);
  EXPECT_GT(dropped, 50u);
  EXPECT_GT(matched, 50u);
}

// Pairs with a sphere that roll, slide and bounce along a path for 60 steps, through stages 42 and 48 on one
// side and Bullet's collision world on the other.
TEST_F(MatchContactsTest, FollowsBulletsDispatcherForSixtySteps) {
  PairWorld p;
  WorldBuilder& b = p.world;
  const int ball = b.sphere(0.5f), small = b.sphere(0.25f), floor = b.plane(kUp, 0), brick = b.box({1, 0.5f, 1, 0});
  p.add(ball, at(0, 0, 0), small, at(0, -0.75f, 0));
  p.add(ball, at(0, 0, 0), floor, at(0, -0.5f, 0));
  p.add(ball, at(0, 0, 0), brick, at(0, -1, 0));
  btSphereShape bulletBall(0.5f), bulletSmall(0.25f);
  btStaticPlaneShape bulletFloor({0, 1, 0}, 0);
  btBoxShape bulletBrick({1, 0.5f, 1});
  b.shape(brick).margin = static_cast<float>(bulletBrick.getMargin());
  btCollisionShape* shapes[] = {&bulletBall, &bulletSmall, &bulletBall, &bulletFloor, &bulletBall, &bulletBrick};

  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  dispatcher.setDispatcherFlags(dispatcher.getDispatcherFlags() &
                                ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
  btDbvtBroadphase broadphase;
  btCollisionWorld world(&dispatcher, &broadphase, &configuration);
  btCollisionObject objects[6];
  for (uint i = 0; i < 6; ++i) {
    objects[i].setCollisionShape(shapes[i]);
    objects[i].setFriction(0.5f);
    objects[i].setUserIndex(static_cast<int>(i));
    objects[i].setWorldTransform(toBullet(b.pose(i)));
    world.addCollisionObject(&objects[i], 1 << i / 2, 1 << i / 2);  // pairs meet only each other
  }

  int touching[3] = {};
  for (int step = 0; step < 60; ++step) {
    // Down into contact, along it, and up again; rolling all the while.
    const float t = static_cast<float>(step) / 60, height = 0.05f * std::cos(6.2831853f * 2 * t) + 0.03f;
    for (uint i = 0; i < 6; i += 2)
      b.pose(i) = {{0.1f * t, height, 0.05f * t * t, 0}, turnAbout({0.2f, 0.1f, 1, 0}, 0.3f * t)};

    StageBench bench = benchForPairs(queue(), p);
    bench.run<CollidePrimitives>(~0u);
    bench.run<ReduceAndMatchContacts>();
    Stage48Input next{p, {}};
    nextStep(next, bench.read(bench.world().manifolds, 3));

    for (uint i = 0; i < 6; ++i) objects[i].setWorldTransform(toBullet(b.pose(i)));
    world.performDiscreteCollisionDetection();
    ASSERT_EQ(dispatcher.getNumManifolds(), 3);
    for (int k = 0; k < 3; ++k) {
      btPersistentManifold& bullet = *dispatcher.getManifoldByIndexInternal(k);
      const auto pair = static_cast<size_t>(bullet.getBody0()->getUserIndex() / 2);
      SCOPED_TRACE(testing::Message() << "step " << step << ", pair " << pair);
      const Manifold ours = bench.read(bench.world().manifolds, 3)[pair];
      ASSERT_EQ(static_cast<int>(ours.bodyA), bullet.getBody0()->getUserIndex());
      expectAsBullet(ours, bullet);
      touching[pair] += ours.pointCount > 0;
      copyImpulses(next.world.oldManifolds[pair], bullet);
    }
    if (HasFailure()) break;
    p = next.world;
  }
  for (const int steps : touching) {
    EXPECT_GT(steps, 10);
    EXPECT_LT(steps, 50);
  }
  for (auto& object : objects) world.removeCollisionObject(&object);
}

}  // namespace
}  // namespace btgpu
