// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "bullet3_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "bullet_file.h"

namespace btgpu::tool {
namespace {

// Half extent of the box that stands for a plane, as in Bullet3's own demos.
constexpr btScalar kPlaneBox = 400;

[[noreturn]] void refuse(const std::string& what) {
  throw InputError(fmt::format("bullet3: can't hold {}; leave bullet3 out of --worlds", what));
}

void copy(const btVector3& from, float* to) {
  for (int i = 0; i < 3; ++i) to[i] = static_cast<float>(from[i]);
}

// Adds the shape, once for all bodies that share it; `transform` becomes the pose of the shape that stands for it.
int convertShape(const btRigidBody& body, Bullet3Scene& scene, std::map<const void*, int>& known,
                 btTransform& transform) {
  const btCollisionShape* shape = body.getCollisionShape();
  Bullet3Shape converted{};
  if (shape->getShapeType() == BOX_SHAPE_PROXYTYPE) {
    copy(static_cast<const btBoxShape*>(shape)->getHalfExtentsWithMargin(), converted.halfExtents);
  } else if (shape->getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
    converted.radius = static_cast<float>(static_cast<const btSphereShape*>(shape)->getRadius());
  } else if (shape->getShapeType() == STATIC_PLANE_PROXYTYPE && body.isStaticObject()) {
    const auto* plane = static_cast<const btStaticPlaneShape*>(shape);
    const btVector3& n = plane->getPlaneNormal();
    const btTransform turn(shortestArcQuat(btVector3(0, 1, 0), n), n * (plane->getPlaneConstant() - kPlaneBox));
    transform = transform * turn;
    copy(btVector3(kPlaneBox, kPlaneBox, kPlaneBox), converted.halfExtents);
  } else {
    refuse(fmt::format("a shape of the type {}", shape->getName()));
  }
  const auto [it, isNew] = known.emplace(shape, static_cast<int>(scene.shapes.size()));
  if (isNew) scene.shapes.push_back(converted);
  return it->second;
}

}  // namespace

Bullet3Scene convertToBullet3(const btDiscreteDynamicsWorld& world, btScalar timeStep) {
  if (world.getNumConstraints() > 0) refuse("joints");
  if (std::fabs(timeStep - btScalar(1) / 60) > btScalar(1e-6)) refuse("a time step other than 1/60");
  Bullet3Scene scene;
  copy(world.getGravity(), scene.gravity);
  std::map<const void*, int> known;
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    const btRigidBody* body = btRigidBody::upcast(world.getCollisionObjectArray()[i]);
    if (!body) refuse("an object that is no rigid body");
    if (body->isKinematicObject()) refuse("a kinematic body");
    btTransform transform = body->getWorldTransform();
    Bullet3Body converted{};
    converted.shape = convertShape(*body, scene, known, transform);
    converted.mass = body->isStaticObject() ? 0.0f : static_cast<float>(1 / body->getInvMass());
    copy(transform.getOrigin(), converted.position);
    const btQuaternion q = transform.getRotation();
    for (int k = 0; k < 4; ++k) converted.orientation[k] = static_cast<float>(q[k]);
    copy(body->getLinearVelocity(), converted.linearVelocity);
    copy(body->getAngularVelocity(), converted.angularVelocity);
    scene.bodies.push_back(converted);
  }
  std::stable_partition(scene.bodies.begin(), scene.bodies.end(), [](const Bullet3Body& b) { return b.mass == 0; });
  return scene;
}

}  // namespace btgpu::tool
