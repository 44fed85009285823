// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// For applications whose world is a btSoftRigidDynamicsWorld. Porting is changing the class name:
//
//   btSoftRigidDynamicsWorld* world = new btGpuSoftRigidDynamicsWorld(dispatcher, broadphase, solver, configuration);
//
// While it holds no soft body, its steps run on an OpenCL device; with one they run on Bullet's own CPU path, and
// fallbackReport() says so.
#ifndef BT_GPU_SOFT_RIGID_DYNAMICS_WORLD_H
#define BT_GPU_SOFT_RIGID_DYNAMICS_WORLD_H

#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include "btGpuDynamicsWorld.h"

extern template class BTGPU_API btGpuWorld<btSoftRigidDynamicsWorld>;

/// A btSoftRigidDynamicsWorld whose steps run on an OpenCL device.
ATTRIBUTE_ALIGNED16(class)
BTGPU_API btGpuSoftRigidDynamicsWorld : public btGpuWorld<btSoftRigidDynamicsWorld> {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  btGpuSoftRigidDynamicsWorld(btDispatcher * dispatcher, btBroadphaseInterface * pairCache,
                              btConstraintSolver * constraintSolver, btCollisionConfiguration * collisionConfiguration,
                              btSoftBodySolver* softBodySolver = nullptr);
  btGpuSoftRigidDynamicsWorld(btDispatcher * dispatcher, btBroadphaseInterface * pairCache,
                              btConstraintSolver * constraintSolver, btCollisionConfiguration * collisionConfiguration,
                              btSoftBodySolver * softBodySolver, const btGpuSettings& settings);
};

static_assert(sizeof(btGpuSoftRigidDynamicsWorld) == sizeof(btSoftRigidDynamicsWorld),
              "applications and the preload library rely on a world of the same size");

#endif
