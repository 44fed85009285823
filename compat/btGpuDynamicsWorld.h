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

#include "btGpuQueries.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

#define BTGPU_API __attribute__((visibility("default")))

namespace btgpu {
class FallbackList;
}

/// One check of the cross-check.
struct btGpuCheck {
  const char* m_name = "";          ///< "contact.normal"; docs/compare.md lists them
  double m_value = 0, m_limit = 0;  ///< it fails where the value exceeds the limit
  bool m_failed = false;            ///< of a step: and that step is to blame
  /// Where this step differs most: one body, a pair, or null where the check saw nothing; positions in the world's
  /// array of collision objects. By how much, in the check's own measure (docs/crosscheck.md).
  const btCollisionObject *m_bodyA = nullptr, *m_bodyB = nullptr;
  int m_indexA = -1, m_indexB = -1;
  double m_difference = 0;
};

/// One step that was done once more by stock Bullet. Pointers are good until something leaves the world.
struct btGpuCrosscheckStep {
  unsigned long long m_step = 0;         ///< number of the (sub)step, from 1; those on the stock path count
  std::vector<std::string> m_unchecked;  ///< what of it could not be compared, by name; empty: everything was
  std::vector<btGpuCheck> m_checks;
  /// The body whose velocities after the solver differ most, relative to 1 + speed. Kind: "free" and "single" (one
  /// manifold, to a fixed body) have limits; for "coupled" ones the order of the rows makes a difference.
  const btCollisionObject* m_body = nullptr;
  const char* m_bodyKind = "";
  double m_bodyDifference = 0;
  /// The joint whose rows are worse off than stock's: rms of their velocity errors.
  const btTypedConstraint* m_joint = nullptr;
  double m_jointError = 0, m_jointStockError = 0;
  /// The pair whose deepest points' distances differ most, relative to the smaller body's size.
  const btCollisionObject *m_contactA = nullptr, *m_contactB = nullptr;
  double m_contactDifference = 0;
  double m_milliseconds = 0;  ///< that the check took

  bool failed() const {
    for (const btGpuCheck& check : m_checks) {
      if (check.m_failed) return true;
    }
    return false;
  }
};

struct btGpuCrosscheckSummary {
  unsigned long long m_steps = 0;         ///< all of the world
  unsigned long long m_checkedSteps = 0;  ///< compared with stock, entirely or partly
  unsigned long long m_partlySteps = 0;   ///< of these, partly
  unsigned long long m_stockSteps = 0;    ///< ran on the stock path: nothing to compare
  unsigned long long m_failedSteps = 0;   ///< of the checked ones
  btGpuCrosscheckStep m_first;            ///< the first that failed; its pointers may be stale
  std::vector<btGpuCheck> m_checks;       ///< of the whole run
  double m_milliseconds = 0;              ///< that all checks took
  std::string m_error;                    ///< why the checks ended before the run did; empty: they did not

  /// Something was checked, no step failed, and neither did the run. Partly checked steps and those on the stock path
  /// are for the caller to judge.
  bool agreed() const {
    for (const btGpuCheck& check : m_checks) {
      if (check.m_failed) return false;
    }
    return m_checkedSteps > 0 && m_failedSteps == 0 && m_error.empty();
  }
};

/// How contacts and joints are solved.
enum class btGpuSolver {
  Parity,         ///< as Bullet's own solver: projected Gauss-Seidel over coloured constraints
  Fast,           ///< soft constraints in substeps (docs/fast_mode.md)
  MassSplitting,  ///< Jacobi with split masses
  TwoLevel,       ///< Gauss-Seidel over the batches of the paper's two-level batching
};

/// How btGpuSolver::TwoLevel splits the constraints into groups that are solved side by side.
enum class btGpuGroupSplit {
  Space,  ///< by the cells of a grid that the bodies are in
  Index,  ///< by the lowest bits of the bodies' indices, and a table of which sets may be solved at once
};
/// What is a launch then.
enum class btGpuBatchLaunches {
  Phase,  ///< all groups that may be solved at once, each going through its batches
  Batch,  ///< one batch of each of them
};

/// How pairs with overlapping AABBs are found. All find the same ones, in the same order.
enum class btGpuPairFinder {
  Bvh,               ///< a tree over a Morton curve; for any mix of sizes
  Grid,              ///< a uniform grid, large bodies apart; for bodies of about the same size
  Sweep,             ///< a sweep along the axis of largest variance; for bodies in a row
  IncrementalSweep,  ///< three axes, from the pairs of the step before; slower wherever it was measured
  BruteForce,        ///< each body with every other; for tests
};

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
  /// While everything sleeps, each step looks whether the application has moved, pushed or changed a sleeping object.
  /// Turned off, it looks only whether one has been activated (activate(), forceActivationState()), added or removed,
  /// which takes less than half the time, and of all else it takes notice in the first step after one has been
  /// (docs/compatibility.md, "Sleeping worlds"). Of no effect while anything is awake.
  bool m_watchSleepers = true;
  /// Unset: as the environment variable BTGPU_SOLVER says (parity, fast, mass_splitting or two_level), else Parity.
  std::optional<btGpuSolver> m_solver;
  /// Of TwoLevel. Unset: as the environment variable BTGPU_TWO_LEVEL says (space or index, phase or batch, as in
  /// "space,batch"), else Index and Phase, which were faster.
  std::optional<btGpuGroupSplit> m_groupSplit;
  std::optional<btGpuBatchLaunches> m_batchLaunches;
  /// Unset: as the environment variable BTGPU_PAIR_FINDER says (bvh, grid, sweep, incremental or brute_force), else
  /// Bvh.
  std::optional<btGpuPairFinder> m_pairFinder;
  /// Of btGpuSolver::Fast: substeps that each step is solved in, 1 to 64. More make joints and piles stiffer, and cost
  /// time in proportion.
  int m_fastSubsteps = 4;
  /// Of btGpuSolver::Fast: how stiff contacts are, as a damped spring on the masses that touch: its frequency (in 1 /
  /// time unit, twice that against a fixed body, at most a quarter of the substeps' own rate) and damping ratio; and
  /// the speed, in length / time unit, at which penetration is pushed out at most. All > 0.
  btScalar m_fastContactHertz = btScalar(60), m_fastContactDampingRatio = btScalar(2), m_fastPushSpeed = btScalar(3);
  /// The same for joints without limits; those with limits, motors and springs are as Bullet's.
  btScalar m_fastJointHertz = btScalar(60), m_fastJointDampingRatio = btScalar(2);
  /// Runs everything on Bullet's own CPU path.
  bool m_stockOnly = false;
  /// A world whose step is less work than this many contact manifolds (eight moving bodies count as one more) steps on
  /// Bullet's own CPU path, which is faster there. 0: never. Negative: as BTGPU_SMALL_WORLD says, else a measured
  /// limit; but 0 if m_device is set, another solver than Parity, or anything that looks at the device's steps, such as
  /// the cross-check or a profile.
  int m_smallWorld = -1;
  /// A batch of fewer queries than this (rayTestBatch) is answered on the CPU. Negative: a measured limit, a higher one
  /// while the world has no device yet, which would have to be opened first.
  int m_smallBatch = -1;
  /// Times each stage of the step by device events; slows the step.
  bool m_profile = false;
  /// Times host zones and device stages and writes them to this file: a table if it ends in .csv, else a trace for
  /// Perfetto (docs/profile.md). Empty: the environment variable BTGPU_PROFILE, if it is set. Slows the step.
  std::string m_profileFile;
  /// Keeps each step's contacts for comparison (btgpu compare); slows the step.
  bool m_keepContacts = false;

  /// Write island tags and companion ids (btCollisionObject::getIslandTag, getCompanionId) after each step, as stock
  /// does. Off by default: it takes a look at every object, and nobody but Bullet's own solver is known to read them.
  bool m_islandTags = false;
  /// Numbers or names of stages, "30,70" (docs/bisect.md): their references run on the host in their place. Empty: the
  /// environment variable BTGPU_HOST_STAGES.
  std::string m_hostStages;
  /// Holds what each stage of each step leaves on the device against its reference; very slow. Also with
  /// BTGPU_CHECK_STAGES=1 in the environment.
  bool m_checkStages = false;
  /// Kernels that check themselves, to find errors of btgpu's own; slow (docs/debugging.md).
  bool m_debugKernels = false;
  /// Room to start with; grown as needed.
  int m_bodyCapacity = 0, m_pairCapacity = 0;
  /// Does every so many-th step once more with stock Bullet, in a shadow world from the same state, and compares
  /// (docs/crosscheck.md). 0: as the environment variable BTGPU_CROSSCHECK says; negative: never.
  int m_crosscheckEvery = 0;
  /// Appends one JSON line a checked step to this file. Empty: BTGPU_CROSSCHECK_FILE, else none.
  std::string m_crosscheckFile;
  /// Called after each checked step on the thread that steps, before actions and the tick callback.
  std::function<void(const btGpuCrosscheckStep&)> m_crosscheckCallback;
  /// Share of pairs whose deepest contact point may be another than stock's where the usual limit is too strict, in
  /// worlds of boxes that tumble: as the expectations of the scenes `ragdoll` and `vehicle` for `btgpu compare`.
  double m_crosscheckOtherDepths = 0;
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
  unsigned long long m_smallSteps = 0;  ///< of m_stockSteps, those of a world too small to gain from a device
  /// Of m_deviceSteps, those that the device had begun before stepSimulation came to them: it runs one substep ahead
  /// while nothing needs the state in between (docs/pipeline.md, "Substeps").
  unsigned long long m_prefetchedSteps = 0;
  /// Of m_deviceSteps, those in which everything slept and nothing had changed, so that there was nothing to do.
  unsigned long long m_restingSteps = 0;
  unsigned long long m_repeatedSteps = 0;   ///< steps done twice because an array on the device was too small
  unsigned long long m_recoveredSteps = 0;  ///< steps done twice because a call of OpenCL failed, and then did not
  /// Steps in which a stage was off its reference by more than its contract (btGpuSettings::m_checkStages), and the
  /// first.
  unsigned long long m_stageDifferences = 0;
  std::string m_firstStageDifference;         ///< "step 12, 46_clip_faces: pair 88 (bodies 3 and 9): ..."
  unsigned long long m_failedAssertions = 0;  ///< of kernels that check themselves (btGpuSettings::m_debugKernels)
  std::string m_firstAssertion;               ///< the first of these, in words
  unsigned m_pairs = 0, m_contactManifolds = 0, m_contactPoints = 0, m_colours = 0;
  int m_launches = 0, m_waits = 0;
  /// Of rayTestBatch: rays that went to the device, and those that the CPU cast all by itself.
  unsigned long long m_deviceRays = 0, m_hostRays = 0;
  /// Likewise of convexSweepBatch.
  unsigned long long m_deviceSweeps = 0, m_hostSweeps = 0;
  /// Likewise of closestPointsBatch: pairs; a pair that contactPairTest was asked for is the CPU's.
  unsigned long long m_devicePairs = 0, m_hostPairs = 0;
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

/// What btgpu adds to a world class of Bullet's, which is its base: steps run on an OpenCL device. It adds no member,
/// so it is as large as its base. Instances: btGpuDynamicsWorld, and btGpuSoftRigidDynamicsWorld.h.
template <typename Base>
ATTRIBUTE_ALIGNED16(class)
BTGPU_API btGpuWorld : public Base {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  /// Touches nothing but btgpu's own table: bodies, dispatcher and broadphase may be gone already.
  virtual ~btGpuWorld();

  virtual void addCollisionObject(
      btCollisionObject * collisionObject, int collisionFilterGroup = btBroadphaseProxy::StaticFilter,
      int collisionFilterMask = btBroadphaseProxy::AllFilter ^ btBroadphaseProxy::StaticFilter) override;

  /// Replaces the settings of a world; a change of device takes effect with the next step.
  static void configure(btGpuWorld * world, const btGpuSettings& settings);

  /// What did not run on the device since the world was made, by name; empty if everything did.
  std::vector<btGpuFallback> fallbackReport() const;
  btGpuStatistics statistics() const;

  /// What the cross-check has found so far; all zero without it.
  btGpuCrosscheckSummary crosscheck() const;

  /// Stage times since the last call, in the order of the stages; empty unless btGpuSettings::m_profile is
  /// set.
  std::vector<btGpuStageTime> takeProfile();

  /// The first hit of each of `count` rays, any number: hits[i] is what rayTest(rays[i], ClosestRayResultCallback)
  /// would find now, right after a step or at any other time, in callbacks too; to the bit in a float world, but that
  /// of several hits as near that of the first object in the world counts. Hits and rays may not overlap. Objects whose
  /// shape the device lacks are asked by Bullet itself, on several threads, and named in the fallback report; without a
  /// device everything is. Does not throw; not for two threads at once.
  void rayTestBatch(const btGpuRay* rays, btGpuRayHit* hits, int count) const;
  void rayTestBatch(const std::vector<btGpuRay>& rays, std::vector<btGpuRayHit>& hits) const;

  /// The same of convexSweepTest, by the functions that find contacts on the device: hits[i] is what stock would find
  /// to within the 0.001 length units before a surface at which its sweeps end. Shapes and objects' shapes that the
  /// device lacks are Bullet's, and named; without a device all are.
  void convexSweepBatch(const btGpuSweep* sweeps, btGpuSweepHit* hits, int count) const;
  void convexSweepBatch(const std::vector<btGpuSweep>& sweeps, std::vector<btGpuSweepHit>& hits) const;

  /// Closest points of pairs of objects, by the same functions that find contacts on the device; of pairs with a shape
  /// that it lacks by contactPairTest, one after the other.
  void closestPointsBatch(const btGpuClosestQuery* queries, btGpuClosestPoints* answers, int count) const;
  void closestPointsBatch(const std::vector<btGpuClosestQuery>& queries, std::vector<btGpuClosestPoints>& answers)
      const;

  /// As in the base class; a zone of the profile (docs/profile.md).
  virtual int stepSimulation(btScalar timeStep, int maxSubSteps = 1,
                             btScalar fixedTimeStep = btScalar(1.) / btScalar(60.)) override;
  virtual void synchronizeMotionStates() override;

  /// As in the base class, on several threads.
  virtual void applyGravity() override;
  virtual void clearForces() override;

 protected:
  template <typename... Arguments>
  explicit btGpuWorld(const btGpuSettings& settings, Arguments... arguments) : Base(arguments...) {
    begin(settings);
  }

  virtual void internalSingleStepSimulation(btScalar timeStep) override;
  virtual void saveKinematicState(btScalar timeStep) override;

 private:
  void begin(const btGpuSettings& settings);
};

extern template class BTGPU_API btGpuWorld<btDiscreteDynamicsWorld>;

/// A btDiscreteDynamicsWorld whose steps run on an OpenCL device.
ATTRIBUTE_ALIGNED16(class)
BTGPU_API btGpuDynamicsWorld : public btGpuWorld<btDiscreteDynamicsWorld> {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  btGpuDynamicsWorld(btDispatcher * dispatcher, btBroadphaseInterface * pairCache,
                     btConstraintSolver * constraintSolver, btCollisionConfiguration * collisionConfiguration);
  btGpuDynamicsWorld(btDispatcher * dispatcher, btBroadphaseInterface * pairCache,
                     btConstraintSolver * constraintSolver, btCollisionConfiguration * collisionConfiguration,
                     const btGpuSettings& settings);
};

static_assert(sizeof(btGpuDynamicsWorld) == sizeof(btDiscreteDynamicsWorld),
              "applications and the preload library rely on a world of the same size");

#endif
