// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "65_prepare_contacts_reference.h"

#include <algorithm>

#include "reference_maths.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kEpsilon = 1.1920929e-7;  // SIMD_EPSILON in a float build of Bullet

// A btSolverBody, and what of its btRigidBody the solver reads. One that Bullet does not move has no mass.
struct Body {
  uint flags;
  double inverseMass;
  Vec position;
  Vec linear, angular, externalLinear, externalAngular;
  Vec linearFactor, angularFactor, anisotropicFriction;
  Matrix inverseInertia, rotation;
};

Body makeBody(const PrepareInput& in, uint i) {
  const BodyStep& s = in.steps[i];
  return {in.infos[i].flags,
          s.linearVelocity.w,
          toVec(in.poses[i].position),
          toVec(s.linearVelocity),
          toVec(s.angularVelocity),
          toVec(s.externalLinear),
          toVec(s.externalAngular),
          toVec(in.masses[i].linearFactor),
          toVec(in.masses[i].angularFactor),
          toVec(in.materials[i].anisotropicFriction),
          {{toVec(s.inverseInertia0), toVec(s.inverseInertia1), toVec(s.inverseInertia2)}},
          rotationOf(in.poses[i].orientation)};
}

Vec scaled(Vec a, Vec b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
bool isZero(Vec v) { return dot(v, v) < kEpsilon * kEpsilon; }  // btVector3::fuzzyZero

// convertContact leaves out contacts in which neither body can be pushed.
bool canBePushed(const Body& b) { return !isZero(b.linearFactor * b.inverseMass); }

// btPlaneSpace1.
void planeSpace(Vec n, Vec& p, Vec& q) {
  p = std::fabs(n.z) > 0.7071067811865475244 ? Vec{0, -n.z, n.y} : Vec{-n.y, n.x, 0};
  p = p / length(p);
  q = cross(n, p);
}

// A direction seen from both bodies: Jacobian J of the relative velocity, and J M^-1 J^T.
struct Direction {
  const Body &a, &b;
  Vec n, armA, armB;  // linear part, r x n

  Direction(const Body& bodyA, const Body& bodyB, Vec direction, Vec ra, Vec rb)
      : a(bodyA), b(bodyB), n(direction), armA(cross(ra, direction)), armB(cross(rb, direction)) {}

  static double compliance(const Body& body, Vec direction, Vec arm, Vec r) {
    const Vec angular = scaled(body.inverseInertia * arm, body.angularFactor);
    return body.inverseMass + dot(direction, cross(angular, r));
  }
  double compliance(Vec ra, Vec rb) const { return compliance(a, n, armA, ra) + compliance(b, n, armB, rb); }
};

Vec applyAnisotropic(const Body& body, uint wanted, Vec direction) {
  if (!(body.flags & wanted)) return direction;
  return body.rotation * scaled(transposed(body.rotation) * direction, body.anisotropicFriction);
}
Vec applyAnisotropic(const Body& a, const Body& b, uint wanted, Vec direction) {
  return applyAnisotropic(b, wanted, applyAnisotropic(a, wanted, direction));
}

Vec velocityWithForces(const Body& b, Vec r) {
  return b.linear + b.externalLinear + cross(b.angular + b.externalAngular, r);
}

class Writer {
 public:
  Writer(std::vector<float>& array, size_t slot, size_t fields, size_t first)
      : m_array(array), m_slot(slot), m_fields(fields), m_first(first) {}
  void put(size_t field, double value) {
    m_array[rowIndex(m_slot, m_fields, m_first + field)] = static_cast<float>(value);
  }
  void put(size_t field, Vec v) {
    for (int k = 0; k < 3; ++k) put(field + static_cast<size_t>(k), v[k]);
  }

 private:
  std::vector<float>& m_array;
  size_t m_slot, m_fields, m_first;
};

struct Contact {
  const StepParams& params;
  const Body &a, &b;
  ContactPoint& point;
  Vec n, ra, rb;
  bool has(uint flag) const { return (params.flags & flag) != 0; }
};

// The part of convertContact that chooses the friction directions.
void chooseDirections(const Contact& c) {
  ContactPoint& p = c.point;
  if (c.has(STEP_FRICTION_CACHING) && (p.flags & POINT_LATERAL_FRICTION_INITIALIZED)) return;
  const bool two = c.has(STEP_TWO_FRICTION);
  const Vec velocity = velocityWithForces(c.a, c.ra) - velocityWithForces(c.b, c.rb);
  const Vec lateral = velocity - c.n * dot(velocity, c.n);
  Vec t1, t2 = toVec(p.lateralFrictionDir2);
  if (!c.has(STEP_NO_VELOCITY_FRICTION) && dot(lateral, lateral) > kEpsilon) {
    t1 = applyAnisotropic(c.a, c.b, BODY_ANISOTROPIC, lateral / length(lateral));
    if (two) {
      const Vec across = cross(t1, c.n);
      t2 = applyAnisotropic(c.a, c.b, BODY_ANISOTROPIC, across / length(across));
    }
  } else {
    planeSpace(c.n, t1, t2);
    t1 = applyAnisotropic(c.a, c.b, BODY_ANISOTROPIC, t1);
    if (two) t2 = applyAnisotropic(c.a, c.b, BODY_ANISOTROPIC, t2);
    if (two && c.has(STEP_NO_VELOCITY_FRICTION)) p.flags |= POINT_LATERAL_FRICTION_INITIALIZED;
  }
  p.lateralFrictionDir1 = toFloat4(t1, p.lateralFrictionDir1.w);
  p.lateralFrictionDir2 = toFloat4(t2, p.lateralFrictionDir2.w);
}

// setupContactConstraint.
void writeNormal(const Contact& c, bool solved, Writer out) {
  const StepParams& s = c.params;
  out.put(ROW_NORMAL, c.n);
  out.put(ROW_R_A, c.ra);
  out.put(ROW_R_B, c.rb);
  out.put(ROW_FRICTION, c.point.combined.x);
  for (const size_t field :
       {ROW_NORMAL_JAC, ROW_NORMAL_RHS, ROW_NORMAL_CFM, ROW_NORMAL_IMPULSE, ROW_PUSH_RHS, ROW_PUSH_IMPULSE}) {
    out.put(field, 0);
  }
  if (!solved) return;

  const double dt = s.timeStep;
  double cfm = s.globalCfm, erp = s.erp2;
  if (c.point.flags & (POINT_CFM | POINT_ERP)) {
    if (c.point.flags & POINT_CFM) cfm = c.point.combinedStiffness;
    if (c.point.flags & POINT_ERP) erp = c.point.combinedDamping;
  } else if (c.point.flags & POINT_STIFFNESS_DAMPING) {
    const double spring = dt * c.point.combinedStiffness;
    const double denominator = std::max(spring + c.point.combinedDamping, kEpsilon);
    cfm = 1 / denominator;
    erp = std::isinf(c.point.combinedStiffness) ? 1 : spring / denominator;
  }
  cfm /= dt;
  const Direction d(c.a, c.b, c.n, c.ra, c.rb);
  const double jac = s.sor / (d.compliance(c.ra, c.rb) + cfm);
  if (!std::isfinite(jac)) return;

  const Vec relative = c.a.linear + cross(c.a.angular, c.ra) - c.b.linear - cross(c.b.angular, c.rb);
  const double speed = dot(c.n, relative);
  const double bounce =
      std::fabs(speed) < s.restitutionVelocityThreshold ? 0 : std::max(0.0, -c.point.combined.y * speed);
  const double gap = double(c.point.localPointA.w) + s.linearSlop;
  const Vec withForces = velocityWithForces(c.a, c.ra) - velocityWithForces(c.b, c.rb);
  double velocityError = bounce - dot(c.n, withForces), positionError = 0;
  if (gap > 0)
    velocityError -= gap / dt;
  else
    positionError = -gap * erp / dt;
  const bool split = c.has(STEP_SPLIT_IMPULSE) && gap <= s.splitImpulsePenetrationThreshold;
  const double rhs = (velocityError + (split ? 0 : positionError)) * jac;
  if (!std::isfinite(rhs)) return;
  out.put(ROW_NORMAL_JAC, jac);
  out.put(ROW_NORMAL_RHS, rhs);
  out.put(ROW_NORMAL_CFM, cfm * jac);
  out.put(ROW_PUSH_RHS, split ? positionError * jac : 0);
  if (c.has(STEP_WARM_START)) out.put(ROW_NORMAL_IMPULSE, double(c.point.localPointB.w) * s.warmStartingFactor);
}

// setupFrictionConstraint. Bullet leaves the torque of the step out of the velocity here. `motion`: with POINT_MOTION.
void writeTangent(const Contact& c, Vec t, float motion, Writer out, size_t axis, size_t jacField, size_t rhsField,
                  size_t impulseField) {
  const Direction d(c.a, c.b, t, c.ra, c.rb);
  const double jac = c.params.sor / d.compliance(c.ra, c.rb);
  const double velocity = dot(t, c.a.linear + c.a.externalLinear) + dot(d.armA, c.a.angular) -
                          dot(t, c.b.linear + c.b.externalLinear) - dot(d.armB, c.b.angular);
  double wanted = -velocity;
  if (c.point.flags & POINT_MOTION) wanted += motion;
  if (c.point.flags & POINT_FRICTION_ANCHOR) {
    const Vec between = c.a.position + c.ra - (c.b.position + c.rb);
    wanted -= dot(between, t) * c.params.frictionErp / c.params.timeStep;
  }
  out.put(axis, t);
  out.put(jacField, jac);
  out.put(rhsField, wanted * jac);
  out.put(impulseField, 0);
}

// setupTorsionalFrictionConstraint: without the torque of the step, and without the angular factor.
void writeTorsion(const Contact& c, Vec axis, double friction, Writer out) {
  const double sum = dot(c.a.inverseInertia * axis, axis) + dot(c.b.inverseInertia * axis, axis);
  const bool live = c.point.combined.z > 0 && length(axis) > 0.001 && sum > 0;
  out.put(ROW_TORSION_AXIS, axis);
  out.put(ROW_TORSION_JAC, live ? 1 / sum : 0);
  out.put(ROW_TORSION_RHS, live ? dot(axis, c.a.angular - c.b.angular) / sum : 0);
  out.put(ROW_TORSION_FRICTION, live ? friction : 0);
  out.put(ROW_TORSION_IMPULSE, 0);
}

void writePoint(const Contact& c, bool solved, size_t slot, size_t k, PrepareReference& out) {
  if (solved) chooseDirections(c);
  const Writer rows(out.rows, slot, SLOT_FIELDS, k * POINT_FIELDS);
  writeNormal(c, solved, rows);
  if (!solved) return;
  writeTangent(c, toVec(c.point.lateralFrictionDir1), c.point.normalWorldOnB.w, rows, ROW_TANGENT1, ROW_TANGENT1_JAC,
               ROW_TANGENT1_RHS, ROW_TANGENT1_IMPULSE);
  if (c.has(STEP_TWO_FRICTION)) {
    const Writer second(out.tangent2, slot, SLOT_TANGENT2_FIELDS, k * TANGENT2_FIELDS);
    writeTangent(c, toVec(c.point.lateralFrictionDir2), c.point.lateralFrictionDir1.w, second, ROW_TANGENT2,
                 ROW_TANGENT2_JAC, ROW_TANGENT2_RHS, ROW_TANGENT2_IMPULSE);
  }
  if (!c.has(STEP_TORSION)) return;
  Vec t1, t2;
  planeSpace(c.n, t1, t2);
  const Vec axes[TORSION_ROWS] = {c.n, applyAnisotropic(c.a, c.b, BODY_ANISOTROPIC_ROLLING, t1),
                                  applyAnisotropic(c.a, c.b, BODY_ANISOTROPIC_ROLLING, t2)};
  for (size_t r = 0; r < TORSION_ROWS; ++r) {
    writeTorsion(c, axes[r], r == 0 ? c.point.combined.w : c.point.combined.z,
                 Writer(out.torsion, slot, SLOT_TORSION_FIELDS, (k * TORSION_ROWS + r) * TORSION_FIELDS));
  }
}

void prepareBodies(const PrepareInput& in, PrepareReference& out) {
  out.solverBodies.assign(in.steps.size(), {});
  out.solverMasses.clear();
  for (uint i = 0; i < in.steps.size(); ++i) {
    const Body b = makeBody(in, i);
    const Vec lf = b.linearFactor, af = b.angularFactor;
    SolverMass mass;
    mass.row0 = toFloat4(b.inverseInertia.row[0] * (af.x * af.x), b.inverseMass * lf.x * lf.x);
    mass.row1 = toFloat4(b.inverseInertia.row[1] * (af.y * af.y), b.inverseMass * lf.y * lf.y);
    mass.row2 = toFloat4(b.inverseInertia.row[2] * (af.z * af.z), b.inverseMass * lf.z * lf.z);
    out.solverMasses.push_back(mass);
  }
}

}  // namespace

size_t rowIndex(size_t slot, size_t fields, size_t field) {
  return ((slot / BTGPU_LANES) * fields + field) * BTGPU_LANES + slot % BTGPU_LANES;
}

void prepareContactsReference(const PrepareInput& in, PrepareReference& out) {
  prepareBodies(in, out);
  for (size_t slot = 0; slot < in.slots.size(); ++slot) {
    if (in.slots[slot].manifold == NO_INDEX) continue;
    Manifold& manifold = out.manifolds[in.slots[slot].manifold];
    const Body a = makeBody(in, manifold.bodyA), b = makeBody(in, manifold.bodyB);
    for (size_t k = 0; k < in.slots[slot].pointCount; ++k) {
      ContactPoint& p = manifold.points[k];
      const Contact c = {in.params,
                         a,
                         b,
                         p,
                         toVec(p.normalWorldOnB),
                         a.rotation * toVec(p.localPointA),
                         b.rotation * toVec(p.localPointB)};
      const bool solved = p.localPointA.w <= manifold.processingThreshold && (canBePushed(a) || canBePushed(b));
      writePoint(c, solved, slot, k, out);
    }
  }
}

}  // namespace btgpu
