// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "parts.h"

#include <algorithm>
#include <cmath>

namespace scenes {

int root(double n, int exponent) {
  const int below = std::max(1, static_cast<int>(std::pow(n, 1.0 / exponent)));
  const bool above = std::pow(below + 1, exponent) - n < n - std::pow(below, exponent);
  return above ? below + 1 : below;
}

std::vector<btVector3> prism(int sides, double radius, double halfHeight) {
  constexpr double kTurn = 6.283185307179586;
  std::vector<btVector3> points;
  for (int k = 0; k < sides; ++k) {
    for (const double y : {-halfHeight, halfHeight}) {
      points.emplace_back(s(radius * std::cos(kTurn * k / sides)), s(y), s(radius * std::sin(kTurn * k / sides)));
    }
  }
  return points;
}

void addGround(Objects& o) {
  o.world().setGravity(kGravity);
  o.add(0, o.box(btVector3(400, 400, 400)), btVector3(0, -400, 0));
}

void addFloor(Objects& o, double halfX, double halfZ) {
  o.world().setGravity(kGravity);
  o.add(0, o.box(btVector3(s(halfX), 1, s(halfZ))), btVector3(0, -1, 0));
}

void addFloor(Objects& o) { addFloor(o, 50, 50); }

void addPlane(Objects& o) {
  o.world().setGravity(kGravity);
  o.add(0, o.plane(btVector3(0, 1, 0), 0), btVector3(0, 0, 0));
}

btQuaternion randomRotation(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  btQuaternion q(s(unit(random)), s(unit(random)), s(unit(random)), s(unit(random)));
  if (q.length2() < s(0.01)) return btQuaternion::getIdentity();
  return q.normalized();
}

std::vector<btVector3> randomHull(std::mt19937& random, int count, const btVector3& half) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<btVector3> points;
  while (static_cast<int>(points.size()) < count) {
    const btVector3 p(s(unit(random)), s(unit(random)), s(unit(random)));
    if (p.length2() > s(0.01) && p.length2() < 1) points.push_back(p.normalized() * half);
  }
  btVector3 mean(0, 0, 0);
  for (const btVector3& p : points) mean += p / s(count);
  for (btVector3& p : points) p -= mean;
  return points;
}

btTransform placedAt(double x, double y, double z) {
  return btTransform(btQuaternion::getIdentity(), btVector3(s(x), s(y), s(z)));
}

btTransform inFrameOf(const btRigidBody& body, const btTransform& world) {
  return body.getWorldTransform().inverse() * world;
}

btTransform frameAlong(const btVector3& from, const btVector3& axis, const btVector3& at) {
  return btTransform(shortestArcQuat(from, axis), at);
}

btHingeConstraint* addHinge(Objects& o, btRigidBody& a, btRigidBody& b, const btTransform& frame) {
  return o.joint<btHingeConstraint>(true, a, b, inFrameOf(a, frame), inFrameOf(b, frame));
}

btConvexHullShape* rock(Objects& o, std::mt19937& random) {
  std::uniform_real_distribution<double> size(0.25, 0.6);
  std::uniform_int_distribution<int> corners(8, 20);
  const double a = size(random), b = size(random), c = size(random);
  return o.hull(randomHull(random, corners(random), btVector3(s(a), s(b), s(c))));
}

void pile(Objects& o, Size n, double pitch, double bottom, const std::vector<btCollisionShape*>& shapes,
          std::mt19937& random) {
  std::uniform_real_distribution<double> jitter(-0.1, 0.1);
  std::uniform_int_distribution<size_t> which(0, shapes.size() - 1);
  for (int y = 0; y < n.y; ++y) {
    for (int x = 0; x < n.x; ++x) {
      for (int z = 0; z < n.z; ++z) {
        const double atX = pitch * (x - 0.5 * (n.x - 1)) + jitter(random);
        const double atZ = pitch * (z - 0.5 * (n.z - 1)) + jitter(random);
        const btQuaternion turn = randomRotation(random);
        const btVector3 at(s(atX), s(bottom + pitch * (y + 0.5)), s(atZ));
        o.add(1, shapes[which(random)], btTransform(turn, at));
      }
    }
  }
}

void addWalls(Objects& o, double halfX, double halfZ, double height) {
  constexpr double kHalf = 1;
  for (const double side : {-1.0, 1.0}) {
    o.add(0, o.box(btVector3(s(kHalf), s(height / 2), s(halfZ + 2 * kHalf))),
          btVector3(s(side * (halfX + kHalf)), s(height / 2), 0));
    o.add(0, o.box(btVector3(s(halfX), s(height / 2), s(kHalf))),
          btVector3(0, s(height / 2), s(side * (halfZ + kHalf))));
  }
}

}  // namespace scenes
