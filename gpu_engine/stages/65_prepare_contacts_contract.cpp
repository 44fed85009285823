// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// How far float rows may be off, from what goes into them. A float operation is off by half an ulp, that is by
// kRounding of its result; a chain of n operations by n times that, relative to the largest value on the way.
#include <limits>

#include "65_prepare_contacts_reference.h"
#include "reference_maths.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kRounding = 1.0 / 16777216;
// Arms: a rotation matrix from a quaternion (8 operations an entry) times a vector (5).
constexpr double kArm = 13 * kRounding;
// A velocity along a direction: arm, cross product (3), sums with the forces (3), a dot product (5).
constexpr double kVelocity = kArm + 11 * kRounding;
// n . ((I (r x n)) x r): the arm twice, two cross products (3 each), a matrix (5), a dot product (5), sums
// (4).
constexpr double kCompliance = 2 * kArm + 20 * kRounding;
// Speed of a slip that gives the friction its direction: the root of Bullet's SIMD_EPSILON in a float build.
constexpr double kLeastSlip = 3.4526698e-4;
// A direction through a body's axes and back: matrix (8) and product (5), twice, for both bodies.
constexpr double kTurned = 52 * kRounding;

// Sizes that go into the rows of one point.
struct PointScale {
  double velocity = 0;    // of the contact points, forces of the step included, without cancellation
  double compliance = 0;  // the sum of the parts of J M^-1 J^T, without cancellation
  double inertia = 0;     // norm of both inverse inertias
  double spin = 0;        // of both angular velocities
  double anchor = 0;      // speed that closes the gap of a friction anchor
};

PointScale scaleOf(const PrepareInput& in, const Manifold& m, const ContactPoint& p) {
  PointScale s;
  for (const auto& [body, local] : {std::pair{m.bodyA, p.localPointA}, std::pair{m.bodyB, p.localPointB}}) {
    const BodyStep& step = in.steps[body];
    const double r = length(toVec(local));
    const double inertia =
        length(toVec(step.inverseInertia0)) + length(toVec(step.inverseInertia1)) + length(toVec(step.inverseInertia2));
    const double spin = length(toVec(step.angularVelocity)) + length(toVec(step.externalAngular));
    s.velocity += length(toVec(step.linearVelocity)) + length(toVec(step.externalLinear)) + r * spin;
    s.compliance += step.linearVelocity.w + inertia * r * r;
    s.inertia += inertia;
    s.spin += spin;
    if (p.flags & POINT_FRICTION_ANCHOR) {
      s.anchor += (r + length(toVec(in.poses[body].position))) * in.params.frictionErp / in.params.timeStep;
    }
  }
  if (p.flags & POINT_MOTION) {
    s.velocity += std::max(std::fabs(double(p.normalWorldOnB.w)), std::fabs(double(p.lateralFrictionDir1.w)));
  }
  return s;
}

// Fields of one point in one of the arrays of rows, on both sides.
struct Fields {
  Contract& contract;
  const std::vector<float>&device, &expected;
  size_t slot, fields, first;

  double e(size_t f) const { return expected[rowIndex(slot, fields, first + f)]; }
  void near(size_t f, double limit, const char* what) const {
    contract.near(what, device[rowIndex(slot, fields, first + f)], e(f), limit);
  }
  void nearVec(size_t f, double limit, const char* what) const {
    for (size_t c = 0; c < 3; ++c) near(f + c, limit, what);
  }
};

// The relative error of sor / (J M^-1 J^T) grows where the sum is small against its parts.
double jacLimit(const StepParams& p, const PointScale& s, double jac) {
  return (kCompliance * s.compliance * jac / p.sor + 4 * kRounding) * jac;
}

void checkNormal(const StepParams& p, const PointScale& s, const Fields& rows, const ContactPoint& point) {
  const double jac = rows.e(ROW_NORMAL_JAC), cfm = rows.e(ROW_NORMAL_CFM);
  // The sum of the parts includes cfm = ROW_NORMAL_CFM / jac, which is exact to a few roundings.
  const double jacError = jacLimit(p, s, jac) + 4 * kRounding * cfm;
  rows.near(ROW_NORMAL_JAC, jacError, "jac");
  rows.near(ROW_NORMAL_CFM, jac > 0 ? cfm * (jacError / jac + 4 * kRounding) : 0, "cfm");
  const double gap = (std::fabs(double(point.localPointA.w)) + p.linearSlop) / p.timeStep;
  const double relative = jac > 0 ? jacError / jac : 0;
  // The velocity counts once by itself and once, times the restitution, as the bounce.
  const double rhsError =
      relative * std::fabs(rows.e(ROW_NORMAL_RHS)) +
      jac * (kVelocity * s.velocity * (1 + std::fabs(double(point.combined.y))) + 4 * kRounding * gap);
  rows.near(ROW_NORMAL_RHS, rhsError, "rhs");
  rows.near(ROW_PUSH_RHS, (relative + 8 * kRounding) * std::fabs(rows.e(ROW_PUSH_RHS)), "push rhs");
  rows.near(ROW_NORMAL_IMPULSE, kRounding * std::fabs(rows.e(ROW_NORMAL_IMPULSE)), "impulse");
}

// A direction along the slip is as uncertain as the slip; all are then turned into the bodies' axes and back. Infinite
// where rounding decides whether there is a slip at all: then either choice is as good.
double directionLimit(const PrepareInput& in, const PointScale& s, const Manifold& m, const ContactPoint& p) {
  const BodyStep &a = in.steps[m.bodyA], &b = in.steps[m.bodyB];
  const Vec ra = rotationOf(in.poses[m.bodyA].orientation) * toVec(p.localPointA);
  const Vec rb = rotationOf(in.poses[m.bodyB].orientation) * toVec(p.localPointB);
  const Vec slip = toVec(a.linearVelocity) + toVec(a.externalLinear) +
                   cross(toVec(a.angularVelocity) + toVec(a.externalAngular), ra) - toVec(b.linearVelocity) -
                   toVec(b.externalLinear) - cross(toVec(b.angularVelocity) + toVec(b.externalAngular), rb);
  const Vec n = toVec(p.normalWorldOnB);
  const double lateral = length(slip - n * dot(n, slip)), error = 2 * kVelocity * s.velocity;
  const double kept = kTurned + 16 * kRounding;
  if ((in.params.flags & STEP_NO_VELOCITY_FRICTION) || lateral + error < kLeastSlip) return kept;
  if (lateral - error < kLeastSlip) return std::numeric_limits<double>::infinity();
  return error / lateral + kept;
}

void checkTangent(const StepParams& p, const PointScale& s, double direction, const Fields& f, size_t jacAt,
                  const char* jacName, const char* rhsName, const char* impulseName) {
  const double jac = f.e(jacAt), rhs = f.e(jacAt + 1);
  // The direction enters the compliance twice.
  const double jacError = jacLimit(p, s, jac) + 2 * direction * s.compliance * jac * jac / p.sor;
  f.near(jacAt, jacError, jacName);
  // The gap: arms, their sum with the positions (3), a dot product (5), two factors.
  const double speed = (kVelocity + direction) * s.velocity + (kArm + 10 * kRounding + direction) * s.anchor;
  f.near(jacAt + 1, jac > 0 ? jacError / jac * std::fabs(rhs) + jac * speed : 0, rhsName);
  f.near(jacAt + 2, 0, impulseName);
}

void checkTorsion(const PointScale& s, const Fields& f) {
  f.near(ROW_TORSION_FRICTION, 0, "torsional friction");
  f.near(ROW_TORSION_IMPULSE, 0, "torsional impulse");
  if (f.e(ROW_TORSION_FRICTION) == 0) return;  // the row is unused
  const double axis = kTurned + 16 * kRounding, jac = f.e(ROW_TORSION_JAC);
  const double jacError = jac * (jac * s.inertia * (2 * axis + 12 * kRounding) + 2 * kRounding);
  f.nearVec(ROW_TORSION_AXIS, axis, "torsional axis");
  f.near(ROW_TORSION_JAC, jacError, "torsional jac");
  f.near(ROW_TORSION_RHS, jacError / jac * std::fabs(f.e(ROW_TORSION_RHS)) + jac * s.spin * (axis + 8 * kRounding),
         "torsional rhs");
}

bool sameBits(const ContactPoint& a, const ContactPoint& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

float4 withXyz(float4 v, float4 xyz) { return {xyz.x, xyz.y, xyz.z, v.w}; }

// What the stage must leave alone, and what it only copies.
void checkKept(Contract& c, const Fields& rows, const ContactPoint& before, const ContactPoint& device,
               const ContactPoint& expected) {
  ContactPoint unchanged = device;
  unchanged.lateralFrictionDir1 = withXyz(device.lateralFrictionDir1, before.lateralFrictionDir1);
  unchanged.lateralFrictionDir2 = before.lateralFrictionDir2;
  unchanged.flags = before.flags;
  c.require(sameBits(unchanged, before), "the point as it was, but for its friction directions");
  c.same("flags", device.flags, expected.flags);
  for (size_t k = 0; k < 3; ++k) rows.near(ROW_NORMAL + k, 0, "normal");
  rows.near(ROW_FRICTION, 0, "friction");
  rows.near(ROW_PUSH_IMPULSE, 0, "push impulse");
}

struct Sides {
  const std::vector<Manifold>& before;
  const PrepareReference &device, &expected;
};

void checkPoint(Contract& c, const PrepareInput& in, const Sides& sides, size_t slot, uint k) {
  const Manifold& before = sides.before[in.slots[slot].manifold];
  const ContactPoint &a = sides.device.manifolds[in.slots[slot].manifold].points[k],
                     &e = sides.expected.manifolds[in.slots[slot].manifold].points[k];
  const PointScale scale = scaleOf(in, before, e);
  const Fields rows{c, sides.device.rows, sides.expected.rows, slot, SLOT_FIELDS, k * POINT_FIELDS};
  checkKept(c, rows, before.points[k], a, e);
  rows.nearVec(ROW_R_A, kArm * length(toVec(e.localPointA)), "arm A");
  rows.nearVec(ROW_R_B, kArm * length(toVec(e.localPointB)), "arm B");
  checkNormal(in.params, scale, rows, e);
  if (rows.e(ROW_NORMAL_JAC) == 0) {
    c.require(sameBits(a, before.points[k]), "a point that is not solved, as it was");
    return;
  }
  const double direction = directionLimit(in, scale, before, e);
  if (std::isinf(direction)) return;
  c.near("friction direction 1", a.lateralFrictionDir1, e.lateralFrictionDir1, direction);
  c.near("friction direction 2", a.lateralFrictionDir2, e.lateralFrictionDir2, direction);
  rows.nearVec(ROW_TANGENT1, direction, "direction 1");
  checkTangent(in.params, scale, direction, rows, ROW_TANGENT1_JAC, "friction 1, jac", "friction 1, rhs",
               "friction 1, impulse");
  if (in.params.flags & STEP_TWO_FRICTION) {
    const Fields second{c,    sides.device.tangent2, sides.expected.tangent2,
                        slot, SLOT_TANGENT2_FIELDS,  k * TANGENT2_FIELDS};
    second.nearVec(ROW_TANGENT2, direction, "direction 2");
    checkTangent(in.params, scale, direction, second, ROW_TANGENT2_JAC, "friction 2, jac", "friction 2, rhs",
                 "friction 2, impulse");
  }
  for (size_t r = 0; (in.params.flags & STEP_TORSION) && r < TORSION_ROWS; ++r) {
    checkTorsion(scale, {c, sides.device.torsion, sides.expected.torsion, slot, SLOT_TORSION_FIELDS,
                         (k * TORSION_ROWS + r) * TORSION_FIELDS});
  }
}

void checkBodies(Contract& c, const PrepareReference& device, const PrepareReference& expected) {
  c.sameArray("solver body", device.solverBodies, expected.solverBodies);
  for (size_t i = 0; i < expected.solverMasses.size(); ++i) {
    const SolverMass &a = device.solverMasses[i], &e = expected.solverMasses[i];
    const float4 rowsA[] = {a.row0, a.row1, a.row2}, rowsE[] = {e.row0, e.row1, e.row2};
    c.at("solver mass of body {}", i);
    for (int r = 0; r < 3; ++r) {  // each is a product of three factors
      c.near("inertia", rowsA[r], rowsE[r], 4 * kRounding * length(toVec(rowsE[r])));
      c.near("mass", rowsA[r].w, rowsE[r].w, 4 * kRounding * rowsE[r].w);
    }
  }
}

}  // namespace

void checkPreparedContacts(Contract& contract, const PrepareInput& in, const std::vector<Manifold>& before,
                           const PrepareReference& device, const PrepareReference& expected) {
  checkBodies(contract, device, expected);
  for (size_t slot = 0; slot < in.slots.size(); ++slot) {
    const SlotHeader& header = in.slots[slot];
    for (uint k = 0; contract.ok() && k < header.pointCount; ++k) {
      const Manifold& m = before[header.manifold];
      contract.at("slot {}, point {} (bodies {} and {})", slot, k, m.bodyA, m.bodyB);
      checkPoint(contract, in, {before, device, expected}, slot, k);
    }
  }
}

}  // namespace btgpu
