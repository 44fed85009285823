// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "crosscheck.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "../gpu_engine/slots.h"
#include "../translation/contacts.h"
#include "../translation/oracle/quiet_callbacks.h"
#include "crosscheck_text.h"
#include "environment.h"
#include "solver_choice.h"

BTGPU_TRANSLATION_BEGIN
namespace {

std::atomic<int> worldCount{0};

// 0: not at all.
int wantedEvery(const btGpuSettings& settings) {
  if (settings.m_crosscheckEvery != 0) return std::max(0, settings.m_crosscheckEvery);
  const char* text = environment("BTGPU_CROSSCHECK");
  if (!text) return 0;
  char* end = nullptr;
  const long every = std::strtol(text, &end, 10);
  if (*end == '\0' && every >= 0 && every <= 1000000) return static_cast<int>(every);
  static std::atomic<bool> said{false};
  if (!said.exchange(true)) {
    std::fprintf(stderr, "btgpu: BTGPU_CROSSCHECK=%s is no number of steps; nothing is checked\n", text);
  }
  return 0;
}

// Adds the time that it lives.
class Timer {
 public:
  explicit Timer(double& milliseconds) : m_milliseconds(milliseconds) {}
  ~Timer() {
    m_milliseconds += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - m_start).count();
  }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  double& m_milliseconds;
  std::chrono::steady_clock::time_point m_start = std::chrono::steady_clock::now();
};

bool isQuarantined(const BodySlot& slot) { return slot.quarantined || slot.deviceQuarantined; }

const btCollisionObject* objectAt(const WorldReader& reader, uint slot) {
  return slot < reader.slots().size() ? reader.slots()[slot].object : nullptr;
}

btGpuCheck describeCheck(const WorldReader& reader, const StepCheck& from) {
  btGpuCheck check;
  check.m_name = from.name;
  check.m_value = from.value;
  check.m_limit = from.limit;
  check.m_failed = from.failed;
  check.m_bodyA = objectAt(reader, from.worst.a);
  check.m_bodyB = objectAt(reader, from.worst.b);
  if (check.m_bodyA) check.m_indexA = check.m_bodyA->getWorldArrayIndex();
  if (check.m_bodyB) check.m_indexB = check.m_bodyB->getWorldArrayIndex();
  check.m_difference = from.worst.difference;
  return check;
}

}  // namespace

std::shared_ptr<CrossCheck> CrossCheck::make(const btGpuSettings& settings) {
  const int every = wantedEvery(settings);
  if (every == 0) return nullptr;
  const char* file = environment("BTGPU_CROSSCHECK_FILE");
  auto check = std::make_shared<CrossCheck>(
      every, !settings.m_crosscheckFile.empty() || !file ? settings.m_crosscheckFile : file,
      settings.m_crosscheckOtherDepths);
  check->m_limitsLifted = solverOf(settings) == Solver::MassSplitting;
  return check;
}

CrossCheck::CrossCheck(int every, std::string file, double otherDepths)
    : m_every(every),
      m_world(++worldCount),
      m_file(std::move(file)),
      m_shadow(std::make_unique<ShadowWorld>()),
      m_check(*m_shadow, otherDepths, Limits::WithChance) {}

CrossCheck::~CrossCheck() {
  saySummary();
  const QuietCallbacks quiet;
  m_shadow.reset();
}

void CrossCheck::beforeStep(btDiscreteDynamicsWorld& world, const WorldReader& reader, const JointReader& joints,
                            Engine& engine, bool engineHolds, const StepResults& last) {
  m_milliseconds = 0;
  m_unchecked.clear();
  const Timer timer(m_milliseconds);
  const QuietCallbacks quiet;
  try {
    m_shadow->follow(world, reader);
    m_shadow->followJoints(reader, joints);
    m_before = std::vector<BodyState>(m_shadow->slotCount());
    for (std::size_t i = 0; i < m_before.size(); ++i) {
      if (const btCollisionObject* clone = m_shadow->object(i)) m_before[i] = captureState(*clone);
      if (reader.slots()[i].object && !m_shadow->object(i)) m_unchecked = {"bodies in quarantine"};
    }
    m_joints.clear();
    for (const Joint& joint : reader.input().joints) m_joints.push_back({joint.enabled != 0, 0, {}});
    readCache(reader, engine, engineHolds, last);
    if (!m_cacheKnown) m_unchecked.push_back("contacts: those of the step before are not known");
  } catch (const std::exception& e) { giveUp(e.what()); }
}

// btgpu's manifolds that the step starts from. Those of bodies that left are dropped by the device too, and those of
// new ones, unless they come along with them.
void CrossCheck::readCache(const WorldReader& reader, Engine& engine, bool engineHolds, const StepResults& last) {
  const WorldInput& input = reader.input();
  m_cache.clear();
  m_cacheKnown = true;
  if (input.replaceManifolds) {
    m_cache = input.manifolds;
  } else if (engineHolds && m_resultsKept) {
    m_cache.assign(last.manifolds.begin(),
                   last.manifolds.begin() + static_cast<std::ptrdiff_t>(last.counters.pairCount));
    nameSlots(input.infos.values, last.matchedKeys, m_cache);
  } else if (engineHolds) {
    m_cacheKnown = engine.readManifolds(m_cache) == Status::Ok;
  }
  const auto isGone = [&](uint slot) {
    return slot >= m_shadow->slotCount() || !m_shadow->object(ownerOf(input.infos.values, slot)) ||
           (!input.replaceManifolds && std::binary_search(input.born.begin(), input.born.end(), slot));
  };
  // Where the application filters pairs, what its callback refuses is no pair any more.
  const auto isNoPair = [&](const Manifold& m) {
    const auto& infos = input.infos.values;
    const ulong key = pairKeyOf(ownerOf(infos, m.bodyA), ownerOf(infos, m.bodyB));
    const auto isListed = [&](ulong k) {
      return std::binary_search(input.listedPairs.begin(), input.listedPairs.end(), k);
    };
    return input.onlyListedPairs && !isListed(key) && !isListed(key | PAIR_KEEPS_CONTACTS);
  };
  m_cache.erase(std::remove_if(m_cache.begin(), m_cache.end(),
                               [&](const Manifold& m) { return isGone(m.bodyA) || isGone(m.bodyB) || isNoPair(m); }),
                m_cache.end());
}

btGpuCrosscheckStep CrossCheck::afterStep(const WorldReader& reader, const JointReader& joints,
                                          const StepResults& results, btScalar timeStep, bool sleepKnown) {
  ++m_summary.m_steps;
  btGpuCrosscheckStep step;
  if (m_error.empty()) {
    try {
      compare(reader, results, timeStep, sleepKnown);
      step = describe(reader, joints);
      count(step);
    } catch (const std::exception& e) { giveUp(e.what()); }
  }
  return step;
}

void CrossCheck::compare(const WorldReader& reader, const StepResults& results, btScalar timeStep, bool sleepKnown) {
  const Timer timer(m_milliseconds);
  const QuietCallbacks quiet;
  m_after = std::vector<BodyEnd>(m_shadow->slotCount());
  for (std::size_t i = 0; i < m_after.size(); ++i) {
    const BodySlot& slot = reader.slots()[i];
    if (!slot.object || !m_shadow->object(i)) continue;
    if (!isQuarantined(slot)) m_after[i] = captureEnd(*slot.object);
    m_after[i].lost = slot.deviceQuarantined;  // those that were so before are not in the shadow
  }
  if (!results.quarantined.empty() && m_unchecked.empty()) m_unchecked = {"bodies in quarantine"};
  if (!sleepKnown) m_unchecked.push_back("sleep: its timers run after the actions");
  m_check.compare({timeStep, m_before, m_joints, reader.input(), results, m_after, m_cacheKnown ? &m_cache : nullptr,
                   sleepKnown, false});
  m_resultsKept = true;
}

btGpuCrosscheckStep CrossCheck::describe(const WorldReader& reader, const JointReader& joints) const {
  btGpuCrosscheckStep step;
  step.m_step = m_summary.m_steps;
  step.m_unchecked = m_unchecked;
  for (const StepCheck& check : m_check.stepChecks()) step.m_checks.push_back(describeCheck(reader, check));
  const BodyDifference& body = m_check.worstBody();
  step.m_body = objectAt(reader, body.worst.a);
  step.m_bodyKind = body.kind;
  step.m_bodyDifference = body.worst.difference;
  const JointDifference& joint = m_check.worstJoint();
  if (joint.worst.found()) step.m_joint = joints.constraints()[joint.worst.a];
  step.m_jointError = joint.ours;
  step.m_jointStockError = joint.stock;
  const Worst& contact = m_check.worstDepth();
  step.m_contactA = objectAt(reader, contact.a);
  step.m_contactB = objectAt(reader, contact.b);
  step.m_contactDifference = contact.difference;
  step.m_milliseconds = m_milliseconds;
  return step;
}

void CrossCheck::count(const btGpuCrosscheckStep& step) {
  ++m_summary.m_checkedSteps;
  if (!step.m_unchecked.empty()) ++m_summary.m_partlySteps;
  m_summary.m_milliseconds += step.m_milliseconds;
  if (!m_file.empty()) writeLine(crosscheckJson(m_world, step));
  if (!step.failed()) return;
  if (m_summary.m_failedSteps++ > 0) return;
  m_summary.m_first = step;
  std::fprintf(stderr, "%s\n", crosscheckText(m_world, step).c_str());
}

void CrossCheck::skipStep() {
  ++m_summary.m_steps;
  m_resultsKept = false;
}

void CrossCheck::stockStep() {
  ++m_summary.m_steps;
  ++m_summary.m_stockSteps;
  m_resultsKept = false;
}

void CrossCheck::giveUp(const char* error) {
  m_error = error;
  std::fprintf(stderr, "btgpu: cross-check of world %d ends at step %llu: %s\n", m_world, m_summary.m_steps, error);
}

btGpuCrosscheckSummary CrossCheck::summary() const {
  btGpuCrosscheckSummary summary = m_summary;
  summary.m_error = m_error;
  if (summary.m_checkedSteps == 0) return summary;
  std::vector<Check> checks = m_check.checks();
  if (m_limitsLifted) liftLimitsOfIterations(checks);
  for (const Check& from : checks) {
    btGpuCheck check;
    check.m_name = tolerance(from.name).name;
    check.m_value = from.value;
    check.m_limit = from.limit;
    check.m_failed = !from.pass();
    summary.m_checks.push_back(check);
  }
  return summary;
}

// A file that can't be written is said once and left alone.
void CrossCheck::writeLine(const std::string& line) {
  std::FILE* file = std::fopen(m_file.c_str(), "a");
  const bool written = file && std::fwrite(line.data(), 1, line.size(), file) == line.size();
  const bool closed = !file || std::fclose(file) == 0;
  if (written && closed) return;
  std::fprintf(stderr, "btgpu: cross-check: can't write %s\n", m_file.c_str());
  m_file.clear();
}

void CrossCheck::saySummary() {
  if (m_summary.m_steps == 0) return;
  try {
    const btGpuCrosscheckSummary all = summary();
    if (!m_file.empty()) writeLine(crosscheckJson(m_world, all));
    std::fprintf(stderr, "%s\n", crosscheckText(m_world, all).c_str());
  } catch (const std::exception&) {  // no memory: in a destructor there is nobody to tell
  }
}

BTGPU_TRANSLATION_END
