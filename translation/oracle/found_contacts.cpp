// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "found_contacts.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

BTGPU_TRANSLATION_BEGIN
namespace {

class AllContacts : public btManifoldResult {
 public:
  using btManifoldResult::btManifoldResult;
  void addContactPoint(const btVector3& normalOnB, const btVector3&, btScalar depth) override {
    found.push_back({normalOnB, double(depth)});
  }
  std::vector<FoundContact> found;
};

}  // namespace

std::vector<FoundContact> contactsFound(btCollisionWorld& world, const btCollisionObject& a,
                                        const btCollisionObject& b) {
  const btCollisionObjectWrapper ofA(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1, -1);
  const btCollisionObjectWrapper ofB(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1, -1);
  btDispatcher& dispatcher = *world.getDispatcher();
  btCollisionAlgorithm* algorithm = dispatcher.findAlgorithm(&ofA, &ofB, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  if (!algorithm) return {};
  AllContacts result(&ofA, &ofB);
  algorithm->processCollision(&ofA, &ofB, world.getDispatchInfo(), &result);
  algorithm->~btCollisionAlgorithm();
  dispatcher.freeCollisionAlgorithm(algorithm);
  return std::move(result.found);
}

BTGPU_TRANSLATION_END
