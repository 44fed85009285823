// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What comes up the seam after a step.
#pragma once

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "../kernels/shared/body.h"
#include "../kernels/shared/contact.h"
#include "../kernels/shared/step.h"

namespace btgpu {

// Manifolds in the engine's memory, there until its next beginStep or reset.
struct ManifoldView {
  const Manifold* first = nullptr;
  size_t count = 0;
  const uint* indices = nullptr;  // of the manifolds meant, counted from `first`; null: all from there on

  size_t size() const { return count; }
  const Manifold& operator[](size_t i) const { return first[indices ? indices[i] : i]; }
};

// One value a body, in the engine's memory until its next beginStep or reset. A copy, and what is assigned from a
// vector, has memory of its own.
template <typename T>
class BodyResults {
 public:
  BodyResults() = default;
  BodyResults(const BodyResults& other) { *this = std::vector<T>(other.begin(), other.end()); }
  BodyResults& operator=(const BodyResults& other) {
    if (this != &other) *this = std::vector<T>(other.begin(), other.end());
    return *this;
  }
  BodyResults& operator=(std::vector<T> values) {
    m_own = std::move(values);
    m_data = m_own.data();
    m_size = m_own.size();
    return *this;
  }
  // Shows memory of somebody else's.
  void show(T* data, size_t size) {
    m_data = data;
    m_size = size;
  }

  size_t size() const { return m_size; }
  const T* data() const { return m_data; }
  const T* begin() const { return m_data; }
  const T* end() const { return m_data + m_size; }
  const T& operator[](size_t i) const { return m_data[i]; }
  T& operator[](size_t i) { return m_data[i]; }
  operator std::vector<T>() const { return {begin(), end()}; }

 private:
  std::vector<T> m_own;
  T* m_data = nullptr;
  size_t m_size = 0;
};

// A value that a stage left on the device, off from its reference by more than its contract allows.
struct StageDifference {
  std::string stage;    // "65_prepare_contacts"
  std::string element;  // "slot 7, point 2 (bodies 3 and 9): normal jac"
  double device = 0, reference = 0, limit = 0;
};
inline std::string textOf(const StageDifference& d) {
  char numbers[128];
  std::snprintf(numbers, sizeof numbers, ": %.9g instead of %.9g, limit %.3g", d.device, d.reference, d.limit);
  return d.stage + ": " + d.element + numbers;
}

struct StepResults {
  // Indexed by body, length WorldInput::bodyCount.
  BodyResults<BodyPose> poses;  // relative to the region origin
  BodyResults<BodyVelocity> velocities;
  BodyResults<BodyActivation> activations;
  std::vector<uint> roots;  // with StepSettings::islandRoots: the lowest body of each one's island
  std::vector<std::uint32_t> quarantined;  // not empty if a body came out not finite: all in quarantine, ascending

  // With StepSettings::keepContacts: one manifold a pair that overlaps, in the order of the pairs, then those of the
  // host. Points beyond a manifold's count are whatever its place held before.
  std::vector<ulong> matchedKeys;          // of the pairs, from their slots
  std::vector<Manifold> matchedManifolds;  // as the solver got them, impulses of the last step
  std::vector<Manifold> manifolds;         // after the step

  // With StepSettings::sendsContacts(): the manifolds that have points, in the order of the pairs. A carried one,
  // between two bodies that were not active (CONTACT_CARRIED in its key), is as it was last sent and not sent again.
  std::vector<ulong> contactKeys;       // pairKeyOf(its bodies), ascending
  ManifoldView contacts;                // those not carried, in the same order; impulses of this step
  std::vector<Manifold> hostManifolds;  // as WorldInput::hostManifolds, with the impulses of this step

  // As WorldInput::joints and ::jointRows.
  std::vector<uint> jointSolved;     // 1 where the joint's island was awake: its impulses are new
  std::vector<float> jointImpulses;  // impulse of each row

  StepCounters counters{};
  bool prefetched = false;    // the step was already under way when it was begun
  int redos = 0;              // how often the step was repeated because an array was too small
  int launches = 0;           // kernels launched
  int waits = 0;              // times the host waited for the device
  std::string recoveredFrom;  // the error of a call that failed, if the step was done again because of it

  // With EngineSettings::checkStages: the first difference of the step, if there is one.
  std::vector<StageDifference> differences;
  // Of kernels that check themselves (docs/debugging.md), since the results before.
  unsigned long failedAssertions = 0;
  std::string firstAssertion;  // in one line
};

}  // namespace btgpu
