// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <algorithm>
#include <limits>
#include <random>

#include "70_solve_velocities_reference.h"
#include "reference_maths.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kRounding = 1.0 / 16777216;

// The largest of some values, and where it is.
struct Largest {
  double value = 0;
  size_t index = 0;

  // What is no number counts as infinite.
  void take(double v, size_t i) {
    if (std::isnan(v)) v = std::numeric_limits<double>::infinity();
    if (v > value) *this = {v, i};
  }
  void take(float4 v, size_t i) { take(length(toVec(v)), i); }
};

// Of each kind of value that the solver finds, by body, by manifold and by joint row.
struct Sizes {
  Largest linear, angular, push, turn, impulse, jointImpulse;
};

void takeImpulses(Largest& largest, const ContactPoint& a, const ContactPoint& b, size_t manifold) {
  largest.take(std::fabs(double(a.localPointB.w) - b.localPointB.w), manifold);
  largest.take(std::fabs(double(a.normalWorldOnB.w) - b.normalWorldOnB.w), manifold);
  largest.take(std::fabs(double(a.lateralFrictionDir1.w) - b.lateralFrictionDir1.w), manifold);
}

Sizes differencesOf(const SolveReference& a, const SolveReference& b) {
  Sizes d;
  for (size_t i = 0; i < b.bodies.size(); ++i) {
    const SolverBody &x = a.bodies[i], &y = b.bodies[i];
    d.linear.take(x.deltaLinear - y.deltaLinear, i);
    d.angular.take(x.deltaAngular - y.deltaAngular, i);
    d.push.take(x.pushLinear - y.pushLinear, i);
    d.turn.take(x.turnAngular - y.turnAngular, i);
  }
  for (size_t m = 0; m < b.manifolds.size(); ++m) {
    for (int k = 0; k < b.manifolds[m].pointCount; ++k) {
      takeImpulses(d.impulse, a.manifolds[m].points[k], b.manifolds[m].points[k], m);
    }
  }
  for (size_t r = 0; r < b.joints.impulses.size(); ++r) {
    d.jointImpulse.take(std::fabs(double(a.joints.impulses[r]) - b.joints.impulses[r]), r);
  }
  return d;
}

Sizes sizesOf(const SolveReference& a) {
  SolveReference zero;
  zero.bodies.resize(a.bodies.size());
  zero.manifolds = a.manifolds;
  for (Manifold& m : zero.manifolds) {
    for (ContactPoint& p : m.points) p.localPointB.w = p.normalWorldOnB.w = p.lateralFrictionDir1.w = 0;
  }
  zero.joints.impulses.resize(a.joints.impulses.size());
  return differencesOf(a, zero);
}

// The rule of the reference's header. `noise`: what another float computation is off.
void checkValues(Contract& c, const Sizes& error, const Sizes& noise, const Sizes& size) {
  const auto check = [&c](const char* what, const char* of, const Largest& e, const Largest& n, const Largest& s) {
    c.at("{} {}", of, e.index);
    c.within(what, e.value, 8 * n.value + 8 * kRounding * s.value);
  };
  check("error of the linear velocity", "body", error.linear, noise.linear, size.linear);
  check("error of the angular velocity", "body", error.angular, noise.angular, size.angular);
  check("error of the push velocity", "body", error.push, noise.push, size.push);
  check("error of the turn velocity", "body", error.turn, noise.turn, size.turn);
  // Impulses of contacts and joints come from the same velocities.
  const double impulseNoise = std::max(noise.impulse.value, noise.jointImpulse.value);
  const double impulseSize = std::max(size.impulse.value, size.jointImpulse.value);
  check("error of an impulse", "manifold", error.impulse, {impulseNoise, 0}, {impulseSize, 0});
  check("error of the impulse", "joint row", error.jointImpulse, {impulseNoise, 0}, {impulseSize, 0});
}

bool isImpulse(size_t field) {
  return field == ROW_NORMAL_IMPULSE || field == ROW_PUSH_IMPULSE || field == ROW_TANGENT1_IMPULSE;
}

// Everything but the impulses must be as it was: rows, and of the points all but three w.
void checkKept(Contract& c, const SolveReference& before, const SolveReference& device) {
  for (size_t i = 0; i < before.rows.size(); ++i) {
    if (isImpulse(i / BTGPU_LANES % POINT_FIELDS)) continue;
    if (std::memcmp(&device.rows[i], &before.rows[i], sizeof(float)) == 0) continue;
    c.at("float {} of the rows", i);
    c.near("changed", device.rows[i], before.rows[i], 0);
  }
  for (size_t m = 0; m < before.manifolds.size(); ++m) {
    Manifold now = device.manifolds[m];
    const Manifold& was = before.manifolds[m];
    for (int k = 0; k < MANIFOLD_POINTS; ++k) {
      now.points[k].localPointB.w = was.points[k].localPointB.w;
      now.points[k].normalWorldOnB.w = was.points[k].normalWorldOnB.w;
      now.points[k].lateralFrictionDir1.w = was.points[k].lateralFrictionDir1.w;
    }
    c.at("manifold {}", m);
    c.require(std::memcmp(&now, &was, sizeof now) == 0, "as it was, but for its impulses");
  }
}

// The same rows, each right-hand side off by what rounding makes of velocities of that size.
SolveReference nudged(const SolveReference& state, double velocity, unsigned seed) {
  std::mt19937 random(seed);
  SolveReference out = state;
  const auto nudge = [&](std::vector<float>& rows, size_t fields, size_t jac, size_t rhs) {
    for (size_t i = 0; i < rows.size(); ++i) {
      if (i / BTGPU_LANES % fields != rhs) continue;
      const double change = 2 * kRounding * velocity * rows[i - (rhs - jac) * BTGPU_LANES];
      rows[i] += static_cast<float>(random() % 2 ? change : -change);
    }
  };
  nudge(out.rows, POINT_FIELDS, ROW_NORMAL_JAC, ROW_NORMAL_RHS);
  nudge(out.rows, POINT_FIELDS, ROW_TANGENT1_JAC, ROW_TANGENT1_RHS);
  nudge(out.tangent2, TANGENT2_FIELDS, ROW_TANGENT2_JAC, ROW_TANGENT2_RHS);
  return out;
}

void takeLarger(Sizes& sizes, const Sizes& others) {
  for (Largest Sizes::*kind :
       {&Sizes::linear, &Sizes::angular, &Sizes::push, &Sizes::turn, &Sizes::impulse, &Sizes::jointImpulse}) {
    (sizes.*kind).take((others.*kind).value, (others.*kind).index);
  }
}

}  // namespace

void checkSolvedVelocities(Contract& contract, const StepParams& params, int iterations,
                           const std::vector<SlotHeader>& slots, const std::vector<SolverMass>& masses,
                           const SolveReference& before, const SolveReference& device) {
  const auto inFloat = [&](SolveReference rows) {
    solveVelocitiesReference(params, iterations, slots, masses, rows);
    return rows;
  };
  SolveReference exact = before;
  solveVelocitiesExactly(params, iterations, slots, masses, exact);
  checkKept(contract, before, device);
  const Sizes error = differencesOf(device, exact), size = sizesOf(exact);
  Sizes noise = differencesOf(inFloat(before), exact);
  const auto within = [&] {
    Contract values("");
    checkValues(values, error, noise, size);
    return values.ok();
  };
  // The solver is not continuous: a contact that has just lost its last impulse keeps its friction, one with a trace of
  // it has it cut (Bullet skips friction rows without load). Where rounding decides that, other roundings show it.
  for (unsigned seed = 1; seed <= 8 && !within(); ++seed)
    takeLarger(noise, differencesOf(inFloat(nudged(before, size.linear.value, seed)), exact));
  checkValues(contract, error, noise, size);
}

}  // namespace btgpu
