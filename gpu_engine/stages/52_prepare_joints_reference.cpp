// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "52_prepare_joints_reference.h"

#include "reference_maths.h"

namespace btgpu {
namespace {

using reference::toVec;
using reference::Vec;

// A sum, and what it would be if all summands were positive.
struct Sum {
  double value = 0, size = 0;
  void add(double v) {
    value += v;
    size += std::fabs(v);
  }
  void addDot(Vec a, Vec b) {
    for (int k = 0; k < 3; ++k) add(a[k] * b[k]);
  }
};

struct End {
  uint body;
  Vec linear, angular;
};

void addMobility(Sum& sum, const BodyStep& step, const End& end) {
  const double inverseMass = step.linearVelocity.w;
  sum.addDot(end.linear, end.linear * inverseMass);
  const float4 rows[] = {step.inverseInertia0, step.inverseInertia1, step.inverseInertia2};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) sum.add(end.angular[i] * toVec(rows[i])[k] * end.angular[k]);
  }
}

void addSpeed(Sum& sum, const BodyStep& step, const End& end) {
  sum.addDot(end.linear, toVec(step.linearVelocity));
  sum.addDot(end.linear, toVec(step.externalLinear));
  sum.addDot(end.angular, toVec(step.angularVelocity));
  sum.addDot(end.angular, toVec(step.externalAngular));
}

JointEffectReference effectOf(const Joint& joint, const JointRow& row, const std::vector<BodyStep>& steps) {
  Sum mobility, speed;
  for (const End& end : {End{joint.bodyA, toVec(row.linearA), toVec(row.angularA)},
                         End{joint.bodyB, toVec(row.linearB), toVec(row.angularB)}}) {
    if (end.body == NO_INDEX) continue;
    addMobility(mobility, steps[end.body], end);
    addSpeed(speed, steps[end.body], end);
  }
  JointEffectReference e;
  if (std::fabs(mobility.value) > joint.leastMobility) e.jac = 1 / mobility.value;
  e.jacSize = e.jac != 0 ? mobility.size / std::fabs(mobility.value) : 0;
  e.rhs = (double{row.linearA.w} - speed.value * joint.damping) * e.jac;
  e.rhsSize = (std::fabs(double{row.linearA.w}) + speed.size * joint.damping) * std::fabs(e.jac) * e.jacSize;
  if (!std::isfinite(e.jac) || !std::isfinite(e.rhs)) e = {};
  return e;
}

}  // namespace

std::vector<JointEffectReference> prepareJointsReference(const std::vector<Joint>& joints,
                                                         const std::vector<JointRow>& rows,
                                                         const std::vector<BodyStep>& steps) {
  std::vector<JointEffectReference> effects(rows.size());
  for (const Joint& joint : joints) {
    for (uint r = joint.firstRow; r < joint.firstRow + joint.rowCount; ++r) {
      effects[r] = effectOf(joint, rows[r], steps);
    }
  }
  return effects;
}

void checkPreparedJoints(Contract& contract, const std::vector<JointEffect>& device, const std::vector<float>& impulses,
                         const std::vector<JointEffectReference>& expected) {
  constexpr double kRoundings = 32.0 / 16777216;  // the contract
  for (size_t r = 0; r < expected.size(); ++r) {
    const JointEffectReference& e = expected[r];
    contract.at("joint row {}", r);
    contract.near("jac", device[r].jac, e.jac, kRoundings * std::fabs(e.jac) * e.jacSize);
    contract.near("rhs", device[r].rhs, e.rhs, kRoundings * e.rhsSize);
    contract.same("impulse", impulses[r], 0);
  }
}

}  // namespace btgpu
