// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Objects come and go: indices of those that stay never change, freed ones are used again, and the device is
// told which slots hold another body.
#include <algorithm>
#include <random>

#include "tests/translation/reader_world.h"

namespace btgpu::test {
namespace {

TEST(Slots, FollowTheOrderOfComing) {
  FourBodies w;
  for (std::uint32_t i = 0; i < 4; ++i) EXPECT_EQ(w.slot(w.bodies[i]), i);
  EXPECT_EQ(w.slot(nullptr), kNoSlot);
  EXPECT_EQ(w.slot(w.make(1, w.box, btVector3(0, 0, 0))), kNoSlot) << "not in the world";
  EXPECT_EQ(w.reader.input().bodyCount, 4u);
}

TEST(Slots, AnEmptyWorldHasNone) {
  ReaderWorld w;
  EXPECT_EQ(w.step(), Upload{});
  EXPECT_EQ(w.reader.input().bodyCount, 0u);
}

// Bullet moves the last object into the gap: its place in the world changes, its slot does not.
TEST(Slots, RemovalTouchesTheRemovedOnly) {
  FourBodies w;
  w.world.removeRigidBody(w.bodies[1]);
  EXPECT_EQ(w.step(), (Upload{{"infos", {1}}}));
  EXPECT_EQ(w.slot(w.bodies[1]), kNoSlot);
  EXPECT_EQ(w.slot(w.bodies[0]), 0u);
  EXPECT_EQ(w.slot(w.bodies[2]), 2u);
  EXPECT_EQ(w.slot(w.bodies[3]), 3u);
  EXPECT_EQ(w.reader.input().bodyCount, 4u);
  EXPECT_EQ(w.step(), Upload{});
}

TEST(Slots, AllRemoved) {
  FourBodies w;
  for (btRigidBody* body : w.bodies) w.world.removeRigidBody(body);
  EXPECT_EQ(w.step(), (Upload{{"infos", {0, 1, 2, 3}}}));
  EXPECT_EQ(w.step(), Upload{});
  EXPECT_EQ(w.slot(w.add(1, w.box, btVector3(0, 0, 0))), kNoSlot);
  EXPECT_EQ(w.step().at("born"), (Slots{0}));
}

// The removed body's index in the very step in which it is given away again.
TEST(Slots, IndexReusedInTheSameStep) {
  FourBodies w;
  w.bodies[1]->setLinearVelocity(btVector3(1, 2, 3));
  w.bodies[1]->setFriction(s(0.1));
  w.step();
  w.world.removeRigidBody(w.bodies[1]);
  btRigidBody* fresh = w.add(2, w.ball, btVector3(0, 7, 0));
  const Upload upload = w.step();
  EXPECT_EQ(w.slot(fresh), 1u);
  EXPECT_EQ(w.slot(w.bodies[1]), kNoSlot);
  // Everything in which the two differ; the shapes are known.
  EXPECT_EQ(
      upload,
      (Upload{
          {"born", {1}}, {"infos", {1}}, {"poses", {1}}, {"velocities", {1}}, {"masses", {1}}, {"materials", {1}}}));
  EXPECT_EQ(w.step(), Upload{});
}

// Even one that is the same in all but its identity: contacts of the old one must not go on.
TEST(Slots, IndexReusedByABodyLikeTheOldOne) {
  FourBodies w;
  w.world.removeRigidBody(w.bodies[2]);
  btRigidBody* twin = w.add(1, w.box, btVector3(6, 0, 0));
  EXPECT_EQ(w.step(), (Upload{{"born", {2}}, {"infos", {2}}}));
  EXPECT_EQ(w.slot(twin), 2u);
}

TEST(Slots, RemovedAndAddedAgainBetweenStepsIsANewBody) {
  FourBodies w;
  w.world.removeRigidBody(w.bodies[1]);
  w.world.addRigidBody(w.bodies[1]);
  EXPECT_EQ(w.step(), (Upload{{"born", {1}}, {"infos", {1}}}));
  EXPECT_EQ(w.slot(w.bodies[1]), 1u);
}

// Broadphases that hand out the same id again (sweep and prune) do not tell; the world does.
TEST(Slots, NotedAsAddedIsANewBody) {
  FourBodies w;
  w.reader.noteAdded(w.bodies[2]);
  EXPECT_EQ(w.step(), (Upload{{"born", {2}}, {"infos", {2}}}));
  EXPECT_EQ(w.step(), Upload{});
  w.reader.noteAdded(w.make(1, w.bodies[0]->getCollisionShape(), btVector3(0, 0, 0)));  // not known yet
  EXPECT_EQ(w.step(), Upload{});
  w.reader.noteAdded(w.bodies[3]);  // and gone again before the step
  w.world.removeRigidBody(w.bodies[3]);
  EXPECT_EQ(w.step(), (Upload{{"infos", {3}}}));
}

// Allocators like to give the same address again.
TEST(Slots, AnotherBodyAtTheSameAddress) {
  FourBodies w;
  alignas(16) unsigned char memory[sizeof(btRigidBody)];
  const btRigidBody::btRigidBodyConstructionInfo light(1, nullptr, w.box, btVector3(1, 1, 1));
  const btRigidBody::btRigidBodyConstructionInfo heavy(8, nullptr, w.ball, btVector3(2, 2, 2));
  auto* body = new (memory) btRigidBody(light);
  body->setLinearVelocity(btVector3(1, 0, 0));
  w.world.addRigidBody(body);
  w.step();
  w.world.removeRigidBody(body);
  body->~btRigidBody();
  body = new (memory) btRigidBody(heavy);
  w.world.addRigidBody(body);
  const Upload upload = w.step();
  EXPECT_EQ(upload.at("born"), (Slots{4}));
  EXPECT_EQ(upload.at("masses"), (Slots{4}));
  EXPECT_EQ(upload.at("velocities"), (Slots{4}));
  w.world.removeRigidBody(body);
  body->~btRigidBody();
}

// What a body does depends on slots (the order of rows), so slots may not depend on what address the allocator gave.
TEST(Slots, AreTheSameAtWhateverAddress) {
  for (const bool sameAddress : {false, true}) {
    FourBodies w;
    w.world.removeRigidBody(w.bodies[1]);
    w.step();  // slot 1 is free
    w.world.removeRigidBody(w.bodies[3]);
    btRigidBody* fresh = sameAddress ? w.bodies[3] : w.make(1, w.box, btVector3(9, 0, 0));
    w.world.addRigidBody(fresh);
    w.reader.noteAdded(fresh);
    w.step();
    EXPECT_EQ(w.slot(fresh), 1u) << sameAddress;
    EXPECT_EQ(w.slot(w.add(1, w.box, btVector3(12, 0, 0))), kNoSlot);
    w.step();
    EXPECT_EQ(w.slot(static_cast<btRigidBody*>(w.world.getCollisionObjectArray()[3])), 3u) << sameAddress;
  }
}

TEST(Slots, ClearForgetsEverything) {
  FourBodies w;
  w.world.removeRigidBody(w.bodies[0]);
  w.step();
  w.reader.clear();
  w.device = WorldInput();
  EXPECT_EQ(w.reader.input().bodyCount, 0u);
  const Upload upload = w.step();
  EXPECT_EQ(upload.at("born"), (Slots{0, 1, 2}));
  EXPECT_EQ(upload.at("shapes").size(), 2u);
}

// Hundreds of steps with everything at once; after each the device knows the world as it is
// (ReaderWorld::read) and the slots are those of a plain model: freed ones lowest first, in the order of the
// world's array.
TEST(Slots, RandomComingAndGoing) {
  std::mt19937 random(11);
  ReaderWorld w;
  std::vector<btCollisionShape*> shapes;
  for (int i = 1; i < 6; ++i) {
    shapes.push_back(w.shape<btBoxShape>(btVector3(s(i), 1, 1)));
    shapes.push_back(w.shape<btSphereShape>(s(0.1 * i)));
  }
  const auto anyShape = [&] { return shapes[random() % shapes.size()]; };
  const auto anyPlace = [&] { return btVector3(s(random() % 100), s(random() % 100), s(random() % 100)); };
  std::vector<btRigidBody*> bodies;
  for (int i = 0; i < 60; ++i) bodies.push_back(w.make(i % 5, anyShape(), anyPlace()));

  std::map<const btCollisionObject*, std::uint32_t> model;
  std::uint32_t slotCount = 0;
  for (int round = 0; round < 400; ++round) {
    SCOPED_TRACE(round);
    std::set<const btCollisionObject*> reborn;
    for (btRigidBody* body : bodies) {
      switch (random() % 12) {
        case 0:
          if (body->isInWorld()) {
            w.world.removeRigidBody(body);
          } else {
            w.world.addRigidBody(body);
            reborn.insert(body);
          }
          break;
        case 1:
          if (!body->isInWorld()) break;
          w.world.removeRigidBody(body);
          w.world.addRigidBody(body);
          reborn.insert(body);
          break;
        case 2:
          body->getWorldTransform().setOrigin(anyPlace());
          break;
        case 3:
          body->setLinearVelocity(anyPlace());
          break;
        case 4:
          body->setCollisionShape(anyShape());
          break;
        case 5:
          body->setFriction(s(0.01 * (random() % 100)));
          break;
        default:
          break;
      }
    }
    if (random() % 8 == 0) shapes[0]->setLocalScaling(btVector3(s(1 + random() % 4), 1, 1));

    const Upload upload = w.step();
    std::map<const btCollisionObject*, std::uint32_t> expected;
    std::set<std::uint32_t> free;
    for (std::uint32_t slot = 0; slot < slotCount; ++slot) free.insert(slot);
    const btCollisionObjectArray& objects = w.world.getCollisionObjectArray();
    for (int i = 0; i < objects.size(); ++i) {
      const auto it = model.find(objects[i]);
      if (it == model.end()) continue;
      expected.insert(*it);
      free.erase(it->second);
    }
    std::set<std::uint32_t> born;
    for (int i = 0; i < objects.size(); ++i) {
      if (!expected.count(objects[i])) {
        if (free.empty()) free.insert(slotCount++);
        expected[objects[i]] = *free.begin();
        free.erase(free.begin());
      }
      if (reborn.count(objects[i])) born.insert(expected[objects[i]]);
    }
    model = expected;
    for (const auto& [object, slot] : model) ASSERT_EQ(w.slot(object), slot);
    ASSERT_EQ(w.reader.input().bodyCount, slotCount);
    const Slots bornSlots = upload.count("born") ? upload.at("born") : Slots{};
    ASSERT_EQ(bornSlots, Slots(born.begin(), born.end()));
    ASSERT_TRUE(w.missing.empty()) << w.missingText();
    if (HasFailure()) return;
  }
  EXPECT_GT(slotCount, 20u);
}

}  // namespace
}  // namespace btgpu::test
