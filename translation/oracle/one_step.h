// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>
#include <vector>

#include "convex_gap.h"
#include "residuals.h"
#include "tolerances.h"

BTGPU_TRANSLATION_BEGIN

// Where something differs most: a pair, a body (b is NO_INDEX), or a joint's index in a and nothing in b.
struct Worst {
  uint a = NO_INDEX, b = NO_INDEX;
  double difference = 0;  // in the check's own unit

  bool found() const { return a != NO_INDEX; }
  void offer(double candidate, uint first, uint second = NO_INDEX);
};

// What one check saw in the run and in the last step.
class Measure {
 public:
  void startStep() {
    m_stepOutliers = 0;
    m_worst = Worst();
  }
  void add(double difference, bool outlier, uint a, uint b = NO_INDEX);

  double share() const;                         // of the outliers, in the run
  double chance(double limit) const;            // by which chance may lift a share of `limit` among so many
  double largest() const { return m_largest; }  // difference in the run
  long stepOutliers() const { return m_stepOutliers; }
  const Worst& worst() const { return m_worst; }  // of the last step

 private:
  long m_outliers = 0, m_total = 0, m_stepOutliers = 0;
  double m_largest = 0;
  Worst m_worst;
};

// Of a ratio of two sums over steps: how far off it may be, as the steps tell.
class RatioSpread {
 public:
  void add(double ours, double stock);  // of a step
  double standardError() const;

 private:
  double m_ours = 0, m_stock = 0, m_oursOurs = 0, m_oursStock = 0, m_stockStock = 0;
};

// A body after btgpu's step.
struct BodyEnd {
  bool known = false;  // false: it has left the world or is in quarantine, and is not compared
  bool lost = false;   // into quarantine, by this very step: it came out not finite
  int activation = 0;
  btTransform transform = btTransform::getIdentity();
};

BodyEnd captureEnd(const btCollisionObject& object);

// One step of btgpu, by slots.
struct StepRecord {
  btScalar timeStep;
  const std::vector<BodyState>& before;
  const std::vector<JointState>& joints;
  const WorldInput& input;  // with the joints' rows of the step
  const StepResults& results;
  const std::vector<BodyEnd>& after;
  const std::vector<Manifold>* cache;  // btgpu's manifolds before the step; null: not known, contacts are not compared
  bool sleepKnown;                     // the activation states are those after the timers
  bool converged;                      // also measure the distance to stock run to convergence
};

// A check of the last step.
struct StepCheck {
  const char* name;
  double value, limit;
  bool failed;  // this step is to blame
  Worst worst;  // of this step
};

// A body's velocities after the solver.
struct BodyDifference {
  Worst worst;            // relative to 1 + speed
  const char* kind = "";  // "free", "single" (one manifold, to a fixed body) or "coupled": only those have no limit
};

// A joint's rows after the solver: rms of their velocity errors.
struct JointDifference {
  Worst worst;  // ours beyond stock's
  double ours = 0, stock = 0;
};

// Limits on shares and ratios are for runs of many thousand pairs. `Exact` applies them as they are; `WithChance`
// allows runs of any length, down to the first step, what chance may add.
enum class Limits { Exact, WithChance };

// Holds steps of btgpu against steps of stock from the same state, caches included; contacts and solver are compared
// apart. btgpu's world is never touched. What stock's own result depends on, the order of its rows, is measured as
// well, by solving now and then with the manifolds in reverse order.
class OneStepCheck {
 public:
  explicit OneStepCheck(OracleWorld& oracle, double otherDepthsAllowed = 0, Limits limits = Limits::Exact);

  // The oracle has the objects and joints of the step.
  void compare(const StepRecord& step);

  // Of the last step: ours and stock's residual, and the largest difference of poses.
  double ourResidual() const { return m_ourLast.rms(); }
  double stockResidual() const { return m_stockLast.rms(); }
  double lastPose() const { return m_pose.worst().difference; }
  const BodyDifference& worstBody() const { return m_worstBody; }
  const JointDifference& worstJoint() const { return m_worstJoint; }
  const Worst& worstDepth() const { return m_depth.worst(); }
  // Checks that single steps can fail. A check on a share of the bodies or pairs is on that of the run so far.
  std::vector<StepCheck> stepChecks() const;

  // All checks, of the whole run.
  std::vector<Check> checks() const;

 private:
  void startStep(const StepRecord& step);
  Check ofResidual() const;
  Check ofEnergy() const;
  Check ofShare(const char* name, const Measure& m) const;
  void compareContacts();
  using ShapePair = OracleWorld::ShapePair;
  std::vector<PlacedShape> placed(const ShapePair& shapes, uint slot) const;
  bool isFoundToo(const ShapePair& shapes, const Manifold& ours, const ContactPoint& mine, double size) const;
  // What agrees with stock's contact, or is known to be right where stock's is not.
  struct Verdict {
    bool depth = false, normal = false;
  };
  void comparePair(const Manifold& ours, const btPersistentManifold* stock, const ShapePair& shapes);
  Verdict judge(const Manifold& ours, const btPersistentManifold& stock, const ShapePair& shapes, double size) const;
  Verdict judgePoint(const Manifold& m, const ContactPoint& ours, const btManifoldPoint& stock, const ShapePair& shapes,
                     double size) const;
  Verdict compareGaps(const ShapePair& shapes, const Manifold& m, const ContactPoint& ours,
                      const btManifoldPoint& stock, double size) const;
  void compareSolver();
  void compareVelocities(const std::vector<Velocity>& stock);
  void compareJoints(const std::vector<Velocity>& stock);
  void compareEnergy(const std::vector<Velocity>& stock);
  void compareOrders(const std::vector<BodyState>& predicted);
  Residual stockResidualOf(const std::vector<Velocity>& stock);
  void compareEnd();
  std::vector<Manifold> readSolved();
  bool awake(const Manifold& m) const;
  Residual residualOf(const std::vector<Manifold>& solved, const std::vector<Velocity>& velocities);

  OracleWorld& m_oracle;
  double m_depthLimit;
  Limits m_limits;
  const StepRecord* m_step = nullptr;                 // that is compared
  const std::vector<Manifold>* m_contacts = nullptr;  // ours of the step
  size_t m_ofPairs = 0;                               // manifolds of the device's pairs; those of the host lie behind
  std::vector<bool> m_jointed;                        // bodies of joints
  std::vector<Velocity> m_before, m_ours;             // before and after the step
  std::vector<double> m_sizes;                        // of the bodies: their angular motion disc, at most 10

  Measure m_missing, m_depth, m_normal, m_free, m_single, m_pose, m_lost, m_sleep;
  BodyDifference m_worstBody;
  JointDifference m_worstJoint;
  // Sums over the run; `sampled`, of stock's rows in reverse order: in the steps where both were run.
  double m_addedEnergy = 0, m_enteringEnergy = 0, m_sampledAdded = 0, m_sampledEntering = 0;
  double m_lastEntering = 0, m_lastAllowed = 0;  // energy of the last step
  int m_steps = 0;
  Residual m_ourResidual, m_stockResidual;  // all steps
  RatioSpread m_residualSpread, m_distanceSpread;
  Residual m_ourLast, m_stockLast;                 // the last step
  Residual m_forwardResidual, m_reversedResidual;  // stock in both orders, in the steps where both were run
  double m_ourDistance = 0, m_stockDistance = 0, m_reversedDistance = 0;
};

BTGPU_TRANSLATION_END
