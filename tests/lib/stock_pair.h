// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Two collision objects in stock Bullet's narrowphase: the algorithm that its default configuration chooses
// for their shapes, run once on a new manifold.
#pragma once

#include <memory>
#include <vector>

#include "tests/lib/bullet_values.h"

namespace btgpu {

struct StockContact {
  Double3 normalOnB, pointOnA, pointOnB;  // world axes; points relative to A's position
  double distance;
};

class StockPair {
 public:
  StockPair(btCollisionShape& a, btCollisionShape& b) : m_dispatcher(&m_configuration) {
    m_a.setCollisionShape(&a);
    m_b.setCollisionShape(&b);
  }

  std::vector<StockContact> collide(const BodyPose& poseA, const BodyPose& poseB) {
    m_a.setWorldTransform(toBullet(poseA));
    m_b.setWorldTransform(toBullet(poseB));
    const btCollisionObjectWrapper wrapA(nullptr, m_a.getCollisionShape(), &m_a, m_a.getWorldTransform(), -1, -1);
    const btCollisionObjectWrapper wrapB(nullptr, m_b.getCollisionShape(), &m_b, m_b.getWorldTransform(), -1, -1);
    btCollisionAlgorithm* algorithm = m_dispatcher.findAlgorithm(&wrapA, &wrapB, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    btManifoldResult result(&wrapA, &wrapB);
    algorithm->processCollision(&wrapA, &wrapB, m_info, &result);
    const auto contacts = takeContacts(*algorithm);
    algorithm->~btCollisionAlgorithm();
    m_dispatcher.freeCollisionAlgorithm(algorithm);
    return contacts;
  }

  // Of the last manifold: within this distance Bullet makes a contact.
  float breakingThreshold() const { return m_breakingThreshold; }

 private:
  std::vector<StockContact> takeContacts(btCollisionAlgorithm& algorithm) {
    std::vector<StockContact> contacts;
    btManifoldArray manifolds;
    algorithm.getAllContactManifolds(manifolds);
    for (int m = 0; m < manifolds.size(); ++m) {
      const btPersistentManifold& manifold = *manifolds[m];
      EXPECT_EQ(manifold.getBody0(), &m_a) << "stock has A and B the other way round";
      m_breakingThreshold = manifold.getContactBreakingThreshold();
      const Double3 origin = toDouble(m_a.getWorldTransform().getOrigin());
      for (int i = 0; i < manifold.getNumContacts(); ++i) {
        const btManifoldPoint& p = manifold.getContactPoint(i);
        contacts.push_back({toDouble(p.m_normalWorldOnB), toDouble(p.getPositionWorldOnA()) - origin,
                            toDouble(p.getPositionWorldOnB()) - origin, p.getDistance()});
      }
    }
    return contacts;
  }

  btDefaultCollisionConfiguration m_configuration;
  btCollisionDispatcher m_dispatcher;
  btDispatcherInfo m_info;
  btCollisionObject m_a, m_b;
  float m_breakingThreshold = 0;
};

}  // namespace btgpu
