// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The one header that an application includes. Porting is changing the class name:
//
//   btDiscreteDynamicsWorld* world = new btGpuDynamicsWorld(dispatcher, broadphase, solver, configuration);
//
// Everything else stays as it is. Steps run on an OpenCL device; what the device can't do yet, and every step
// on a machine without one, runs on Bullet's own CPU path, and fallbackReport() says so by name.
#ifndef BT_GPU_DYNAMICS_WORLD_H
#define BT_GPU_DYNAMICS_WORLD_H

#include <btBulletDynamicsCommon.h>

#include <string>
#include <vector>

#define BTGPU_API __attribute__((visibility("default")))

namespace btgpu {
class FallbackList;
}

struct btGpuSettings {
  /// OpenCL device: an index as `btgpu info` lists them, "gpu", "cpu" or a part of the name. Empty: the
  /// environment variable BTGPU_DEVICE, else the first GPU, else the first CPU device.
  std::string m_device;
  /// Keeps the host's broadphase current, so that ray tests, sweeps and ghost objects answer as in stock.
  /// Turned off, these see the poses of the last step on the stock path.
  bool m_hostQueries = true;
  /// Keeps the contact manifolds in the dispatcher current: points, impulses and lifetimes, with the same
  /// btPersistentManifold as long as a pair lives. Turned off, the dispatcher has none, and their transfer is saved.
  bool m_contacts = true;
  /// Runs everything on Bullet's own CPU path.
  bool m_stockOnly = false;
  /// Times each stage of the step by device events; slows the step.
  bool m_profile = false;
  /// Keeps each step's contacts for comparison (btgpu compare); slows the step.
  bool m_keepContacts = false;
  /// Room to start with; grown as needed.
  int m_bodyCapacity = 0, m_pairCapacity = 0;
};

/// Something that did not run on the device.
struct btGpuFallback {
  std::string m_what;              ///< "joints", "Capsule shape", "constraint solver", ...
  std::string m_reason;            ///< why, in words
  unsigned long long m_count = 0;  ///< steps in which it was so (quarantine: bodies)
  /// True: the whole step ran on the stock path because of it. False: the step ran on the device, and only this on the
  /// CPU.
  bool m_wholeStep = true;
};

/// Counts since the world was made, and figures of the last step on the device.
struct btGpuStatistics {
  unsigned long long m_deviceSteps = 0, m_stockSteps = 0;
  /// Of m_deviceSteps, those that the device had begun before stepSimulation came to them: it runs one substep ahead
  /// while nothing needs the state in between (docs/pipeline.md, "Substeps").
  unsigned long long m_prefetchedSteps = 0;
  unsigned long long m_repeatedSteps = 0;   ///< steps done twice because an array on the device was too small
  unsigned long long m_recoveredSteps = 0;  ///< steps done twice because a call of OpenCL failed, and then did not
  unsigned m_pairs = 0, m_contactManifolds = 0, m_contactPoints = 0, m_colours = 0;
  int m_launches = 0, m_waits = 0;
  double m_translateMs = 0;  ///< host time that reading Bullet's objects and writing them back took
  double m_deviceMs = 0;     ///< from the launch of the step to its results on the host
  double m_waitMs = 0;       ///< of that, the time in which the host had nothing to do but wait
  std::string m_device;      ///< name of the device; empty while none is in use
};

/// Device time of one stage of the step (docs/pipeline.md).
struct btGpuStageTime {
  std::string m_stage;        ///< "30_find_pairs"
  double m_milliseconds = 0;  ///< on the device, sum over all steps since the profile was last taken
  int m_launches = 0;
};

/// A btDiscreteDynamicsWorld whose steps run on an OpenCL device. It adds no member, so it is as large as its
/// base.
ATTRIBUTE_ALIGNED16(class)
BTGPU_API btGpuDynamicsWorld : public btDiscreteDynamicsWorld {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  btGpuDynamicsWorld(btDispatcher * dispatcher, btBroadphaseInterface * pairCache,
                     btConstraintSolver * constraintSolver, btCollisionConfiguration * collisionConfiguration);
  btGpuDynamicsWorld(btDispatcher * dispatcher, btBroadphaseInterface * pairCache,
                     btConstraintSolver * constraintSolver, btCollisionConfiguration * collisionConfiguration,
                     const btGpuSettings& settings);
  /// Touches nothing but btgpu's own table: bodies, dispatcher and broadphase may be gone already.
  virtual ~btGpuDynamicsWorld();

  virtual void addCollisionObject(
      btCollisionObject * collisionObject, int collisionFilterGroup = btBroadphaseProxy::StaticFilter,
      int collisionFilterMask = btBroadphaseProxy::AllFilter ^ btBroadphaseProxy::StaticFilter) override;

  /// Replaces the settings of a world; a change of device takes effect with the next step.
  static void configure(btGpuDynamicsWorld * world, const btGpuSettings& settings);

  /// What did not run on the device since the world was made, by name; empty if everything did.
  std::vector<btGpuFallback> fallbackReport() const;
  btGpuStatistics statistics() const;

  /// Stage times since the last call, in the order of the stages; empty unless btGpuSettings::m_profile is
  /// set.
  std::vector<btGpuStageTime> takeProfile();

  /// As in the base class, on several threads.
  virtual void applyGravity() override;
  virtual void clearForces() override;

 protected:
  virtual void internalSingleStepSimulation(btScalar timeStep) override;
  virtual void saveKinematicState(btScalar timeStep) override;

 private:
  const char* overriddenStage() const;
  bool overridesUpdateAabbs() const;
  bool mayBatchSubsteps();
  bool deviceStep(btScalar timeStep);
  bool findHostContacts(btScalar timeStep, bool hostPairsDone, btgpu::FallbackList& missing);
  void updateHostBroadphase(btScalar timeStep);
  void catchUpContacts();
  void stockStep(btScalar timeStep);
  void giveIslandTags();
};

static_assert(sizeof(btGpuDynamicsWorld) == sizeof(btDiscreteDynamicsWorld),
              "applications and the preload library rely on a world of the same size");

#endif  // BT_GPU_DYNAMICS_WORLD_H
