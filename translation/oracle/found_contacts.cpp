// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "found_contacts.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

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

class DeepestContact : public btDiscreteCollisionDetectorInterface::Result {
 public:
  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3& normalOnB, const btVector3&, btScalar depth) override {
    any = true;
    found = {normalOnB, double(depth)};
  }
  bool any = false;
  FoundContact found{};
};

class TriangleContacts : public btTriangleCallback {
 public:
  TriangleContacts(const PlacedShape& a, const btTransform& at, btScalar margin) : m_a(a), m_at(at), m_margin(margin) {}
  void processTriangle(btVector3* corners, int, int) override {
    btTriangleShape triangle(corners[0], corners[1], corners[2]);
    triangle.setMargin(m_margin);
    FoundContact contact;
    if (contactFoundFinely(m_a, {&triangle, m_at}, contact)) found.push_back(contact);
  }
  std::vector<FoundContact> found;

 private:
  const PlacedShape& m_a;
  const btTransform& m_at;
  btScalar m_margin;
};

}  // namespace

bool contactFoundFinely(const PlacedShape& a, const PlacedShape& b, FoundContact& found) {
  constexpr btScalar kLarger = 64;  // exact in float
  // Not changed, but btUniformScalingShape does not know const.
  const btUniformScalingShape largeA(const_cast<btConvexShape*>(a.shape), kLarger);
  const btUniformScalingShape largeB(const_cast<btConvexShape*>(b.shape), kLarger);
  btVoronoiSimplexSolver simplex;
  btGjkEpaPenetrationDepthSolver epa;
  btGjkPairDetector detector(&largeA, &largeB, &simplex, &epa);
  btGjkPairDetector::ClosestPointInput input;
  input.m_transformA = btTransform(a.at.getBasis(), btVector3(0, 0, 0));
  input.m_transformB = btTransform(b.at.getBasis(), (b.at.getOrigin() - a.at.getOrigin()) * kLarger);
  DeepestContact result;
  detector.getClosestPoints(input, result, nullptr);
  found = {result.found.normal, result.found.distance / double(kLarger)};
  return result.any;
}

std::vector<FoundContact> contactsFoundFinely(const PlacedShape& a, const btConcaveShape& mesh, const btTransform& at) {
  TriangleContacts contacts(a, at, mesh.getMargin());
  btVector3 lower, upper;
  a.shape->getAabb(at.inverseTimes(a.at), lower, upper);
  const btScalar margin = mesh.getMargin() + gContactBreakingThreshold;
  const btVector3 by(margin, margin, margin);
  mesh.processAllTriangles(&contacts, lower - by, upper + by);
  return std::move(contacts.found);
}

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
