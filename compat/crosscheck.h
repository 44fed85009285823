// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The oracle in the application: each checked step of a btGpuDynamicsWorld is done once more by stock Bullet, in a
// shadow world from the same state, and compared as `btgpu compare` does (docs/crosscheck.md).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "../gpu_engine/engine.h"
#include "../translation/oracle/one_step.h"
#include "../translation/oracle/shadow_world.h"
#include "../translation/read_joints.h"
#include "../translation/read_world.h"
#include "btGpuDynamicsWorld.h"

BTGPU_TRANSLATION_BEGIN

class CrossCheck {
 public:
  // Null if neither the settings nor the environment want it.
  static std::shared_ptr<CrossCheck> make(const btGpuSettings& settings);

  explicit CrossCheck(int every, std::string file, double otherDepths);
  ~CrossCheck();  // says the summary
  CrossCheck(const CrossCheck&) = delete;
  CrossCheck& operator=(const CrossCheck&) = delete;

  // True if the next step is to be checked; the engine must keep its contacts.
  bool isDue() const { return (m_summary.m_steps + 1) % static_cast<unsigned>(m_every) == 0 && m_error.empty(); }

  // Just before the engine begins a step that is due: the world as the step finds it. `engineHolds`: its manifolds are
  // those of the world's last step; `last`: the results of that.
  void beforeStep(btDiscreteDynamicsWorld& world, const WorldReader& reader, const JointReader& joints, Engine& engine,
                  bool engineHolds, const StepResults& last);
  // After such a step, with everything written back. `sleepKnown`: the activation states are final. Returns what is to
  // be told.
  btGpuCrosscheckStep afterStep(const WorldReader& reader, const JointReader& joints, const StepResults& results,
                                btScalar timeStep, bool sleepKnown);
  void skipStep();   // on the device and not due
  void stockStep();  // on the stock path

  btGpuCrosscheckSummary summary() const;

 private:
  void readCache(const WorldReader& reader, Engine& engine, bool engineHolds, const StepResults& last);
  void compare(const WorldReader& reader, const StepResults& results, btScalar timeStep, bool sleepKnown);
  btGpuCrosscheckStep describe(const WorldReader& reader, const JointReader& joints) const;
  void count(const btGpuCrosscheckStep& step);
  void giveUp(const char* error);
  void writeLine(const std::string& line);
  void saySummary();

  int m_every;
  int m_world;  // number in the process
  std::string m_file, m_error;
  std::unique_ptr<ShadowWorld> m_shadow;
  OneStepCheck m_check;
  bool m_limitsLifted = false;      // of checks that count iterations (liftLimitsOfIterations)
  std::vector<BodyState> m_before;  // by slot
  std::vector<JointState> m_joints;
  std::vector<BodyEnd> m_after;
  std::vector<Manifold> m_cache;
  bool m_cacheKnown = false, m_resultsKept = false;
  std::vector<std::string> m_unchecked;  // of the running step
  double m_milliseconds = 0;             // of the running step
  btGpuCrosscheckSummary m_summary;      // without the checks of the whole run
};

BTGPU_TRANSLATION_END
