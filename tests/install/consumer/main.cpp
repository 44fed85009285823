// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The smallest application: one class name differs from a program for stock Bullet.
#include <btGpuDynamicsWorld.h>
#include <btGpuSoftRigidDynamicsWorld.h>

#include <cstdio>

int main() {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btGpuDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  btStaticPlaneShape ground(btVector3(0, 1, 0), 0);
  btSphereShape ball(1);
  btRigidBody floor(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &ground));
  btRigidBody body(btRigidBody::btRigidBodyConstructionInfo(1, nullptr, &ball, btVector3(1, 1, 1)));
  body.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 5, 0)));
  world.addRigidBody(&floor);
  world.addRigidBody(&body);
  for (int i = 0; i < 300; ++i) world.stepSimulation(btScalar(1.0 / 60));
  const double height = body.getWorldTransform().getOrigin().y();
  const auto statistics = world.statistics();
  std::printf("ball at %.4f, %llu steps on %s\n", height, statistics.m_deviceSteps, statistics.m_device.c_str());
  world.removeRigidBody(&body);
  world.removeRigidBody(&floor);
  return statistics.m_deviceSteps == 300 && height > 0.99 && height < 1.01 ? 0 : 1;
}
