// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "70_solve_velocities_reference.h"

#include <algorithm>
#include <limits>

#include "65_prepare_contacts_reference.h"

namespace btgpu {
namespace {

struct Vec3 {
  float x = 0, y = 0, z = 0;
};
Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vec3 toVec3(float4 v) { return {v.x, v.y, v.z}; }

struct Velocity {
  Vec3 linear, angular;
};

// One end of a row: how the body's velocity counts, and how it answers to a unit impulse.
struct End {
  uint body = NO_INDEX;
  Velocity jacobian, response;
};

End makeEnd(uint body, Vec3 linear, Vec3 angular, const std::vector<SolverMass>& masses) {
  End end;
  if (body == NO_INDEX) return end;
  const SolverMass& m = masses[body];
  end.body = body;
  end.jacobian = {linear, angular};
  end.response.linear = {m.row0.w * linear.x, m.row1.w * linear.y, m.row2.w * linear.z};
  end.response.angular = {dot(toVec3(m.row0), angular), dot(toVec3(m.row1), angular),
                          dot(toVec3(m.row2), angular)};
  return end;
}

// One row, as Bullet's btSolverConstraint has it.
struct Row {
  End a, b;
  float jac = 0, rhs = 0, cfm = 0, impulse = 0, lower = 0, upper = 0;
};

struct PointRows {
  float* normalImpulse;
  float* pushImpulse;
  Row normal, push;
  float friction;
  std::vector<Row> tangents, torsions;
  std::vector<float*> tangentImpulses, torsionImpulses;
  std::vector<float> torsionFriction;
  ContactPoint* point;
};

class Solver {
 public:
  Solver(const StepParams& params, const std::vector<SlotHeader>& slots,
         const std::vector<SolverMass>& masses, SolveReference& state)
      : m_flags(params.flags), m_masses(masses), m_state(state) {
    for (size_t slot = 0; slot < slots.size(); ++slot) {
      if (slots[slot].manifold == NO_INDEX) continue;
      for (size_t k = 0; k < slots[slot].pointCount; ++k) m_points.push_back(load(slots[slot], slot, k));
    }
    for (const SolverBody& b : state.bodies) {
      m_velocities.push_back({toVec3(b.deltaLinear), toVec3(b.deltaAngular)});
      m_pushes.push_back({toVec3(b.pushLinear), toVec3(b.turnAngular)});
    }
  }

  void warmStart() {
    for (PointRows& p : m_points) apply(m_velocities, p.normal, p.normal.impulse);
  }

  void iterate() {
    for (PointRows& p : m_points) {
      solve(m_velocities, p.normal);
      if (m_flags & STEP_INTERLEAVE) solveFriction(p);
    }
    if (m_flags & STEP_SPLIT_IMPULSE) {
      for (PointRows& p : m_points) {
        if (p.push.rhs != 0) solve(m_pushes, p.push);
      }
    }
    for (PointRows& p : m_points) {
      if (!(m_flags & STEP_INTERLEAVE)) solveFriction(p);
    }
    for (PointRows& p : m_points) solveTorsion(p);
  }

  void store() {
    for (size_t i = 0; i < m_velocities.size(); ++i) {
      SolverBody& b = m_state.bodies[i];
      b.deltaLinear = toFloat4(m_velocities[i].linear);
      b.deltaAngular = toFloat4(m_velocities[i].angular);
      b.pushLinear = toFloat4(m_pushes[i].linear);
      b.turnAngular = toFloat4(m_pushes[i].angular);
    }
    for (PointRows& p : m_points) storePoint(p);
  }

 private:
  static float4 toFloat4(Vec3 v) { return {v.x, v.y, v.z, 0}; }

  Vec3 vectorAt(const std::vector<float>& array, size_t slot, size_t fields, size_t field) const {
    return {array[rowIndex(slot, fields, field)], array[rowIndex(slot, fields, field + 1)],
            array[rowIndex(slot, fields, field + 2)]};
  }

  Row makeRow(const SlotHeader& h, Vec3 n, Vec3 ra, Vec3 rb) const {
    Row row;
    row.a = makeEnd(h.bodyA, n, cross(ra, n), m_masses);
    row.b = makeEnd(h.bodyB, n * -1.0f, cross(rb, n) * -1.0f, m_masses);
    return row;
  }

  void addTangent(PointRows& p, const SlotHeader& h, std::vector<float>& array, size_t slot, size_t fields,
                  size_t field, Vec3 ra, Vec3 rb) const {
    Row row = makeRow(h, vectorAt(array, slot, fields, field), ra, rb);
    row.jac = array[rowIndex(slot, fields, field + 3)];
    row.rhs = array[rowIndex(slot, fields, field + 4)];
    float* impulse = &array[rowIndex(slot, fields, field + 5)];
    row.impulse = *impulse;
    p.tangents.push_back(row);
    p.tangentImpulses.push_back(impulse);
  }

  void addTorsion(PointRows& p, const SlotHeader& h, size_t slot, size_t field) const {
    const auto at = [&](size_t f) -> float& {
      return m_state.torsion[rowIndex(slot, SLOT_TORSION_FIELDS, field + f)];
    };
    const Vec3 axis = vectorAt(m_state.torsion, slot, SLOT_TORSION_FIELDS, field + ROW_TORSION_AXIS);
    Row row;
    row.a = makeEnd(h.bodyA, {}, axis * -1.0f, m_masses);
    row.b = makeEnd(h.bodyB, {}, axis, m_masses);
    row.jac = at(ROW_TORSION_JAC);
    row.rhs = at(ROW_TORSION_RHS);
    row.impulse = at(ROW_TORSION_IMPULSE);
    p.torsions.push_back(row);
    p.torsionFriction.push_back(at(ROW_TORSION_FRICTION));
    p.torsionImpulses.push_back(&at(ROW_TORSION_IMPULSE));
  }

  PointRows load(const SlotHeader& h, size_t slot, size_t k) const {
    const size_t first = k * POINT_FIELDS;
    const auto at = [&](size_t f) -> float& { return m_state.rows[rowIndex(slot, SLOT_FIELDS, first + f)]; };
    const Vec3 n = vectorAt(m_state.rows, slot, SLOT_FIELDS, first + ROW_NORMAL);
    const Vec3 ra = vectorAt(m_state.rows, slot, SLOT_FIELDS, first + ROW_R_A);
    const Vec3 rb = vectorAt(m_state.rows, slot, SLOT_FIELDS, first + ROW_R_B);
    PointRows p;
    p.normal = makeRow(h, n, ra, rb);
    p.normal.jac = at(ROW_NORMAL_JAC);
    p.normal.rhs = at(ROW_NORMAL_RHS);
    p.normal.cfm = at(ROW_NORMAL_CFM);
    p.normal.impulse = at(ROW_NORMAL_IMPULSE);
    p.normal.upper = std::numeric_limits<float>::infinity();
    p.push = p.normal;
    p.push.rhs = at(ROW_PUSH_RHS);
    p.push.impulse = at(ROW_PUSH_IMPULSE);
    p.friction = at(ROW_FRICTION);
    p.normalImpulse = &at(ROW_NORMAL_IMPULSE);
    p.pushImpulse = &at(ROW_PUSH_IMPULSE);
    p.point = &m_state.manifolds[h.manifold].points[k];
    addTangent(p, h, m_state.rows, slot, SLOT_FIELDS, first + ROW_TANGENT1, ra, rb);
    if (m_flags & STEP_TWO_FRICTION) {
      addTangent(p, h, m_state.tangent2, slot, SLOT_TANGENT2_FIELDS, k * TANGENT2_FIELDS, ra, rb);
    }
    for (size_t r = 0; (m_flags & STEP_TORSION) && r < TORSION_ROWS; ++r) {
      addTorsion(p, h, slot, (k * TORSION_ROWS + r) * TORSION_FIELDS);
    }
    return p;
  }

  static void apply(std::vector<Velocity>& velocities, const Row& row, float impulse) {
    for (const End* end : {&row.a, &row.b}) {
      if (end->body == NO_INDEX) continue;
      Velocity& v = velocities[end->body];
      v.linear = v.linear + end->response.linear * impulse;
      v.angular = v.angular + end->response.angular * impulse;
    }
  }

  // gResolveSingleConstraintRowGeneric.
  static void solve(std::vector<Velocity>& velocities, Row& row) {
    float delta = row.rhs - row.impulse * row.cfm;
    for (const End* end : {&row.a, &row.b}) {
      if (end->body == NO_INDEX) continue;
      const Velocity& v = velocities[end->body];
      delta -= (dot(end->jacobian.linear, v.linear) + dot(end->jacobian.angular, v.angular)) * row.jac;
    }
    const float sum = std::clamp(row.impulse + delta, row.lower, row.upper);
    apply(velocities, row, sum - row.impulse);
    row.impulse = sum;
  }

  void solveFriction(PointRows& p) {
    if (!(p.normal.impulse > 0)) return;
    for (Row& row : p.tangents) {
      row.upper = p.friction * p.normal.impulse;
      row.lower = -row.upper;
      solve(m_velocities, row);
    }
  }

  void solveTorsion(PointRows& p) {
    if (!(p.normal.impulse > 0)) return;
    for (size_t r = 0; r < p.torsions.size(); ++r) {
      Row& row = p.torsions[r];
      row.upper = std::min(p.torsionFriction[r] * p.normal.impulse, p.torsionFriction[r]);
      row.lower = -row.upper;
      solve(m_velocities, row);
    }
  }

  void storePoint(PointRows& p) const {
    *p.normalImpulse = p.normal.impulse;
    *p.pushImpulse = p.push.impulse;
    for (size_t i = 0; i < p.tangents.size(); ++i) *p.tangentImpulses[i] = p.tangents[i].impulse;
    for (size_t i = 0; i < p.torsions.size(); ++i) *p.torsionImpulses[i] = p.torsions[i].impulse;
    // writeBackContacts; a contact without a row keeps its impulses.
    if (!(m_flags & STEP_WARM_START) || p.normal.jac == 0) return;
    p.point->localPointB.w = p.normal.impulse;
    p.point->normalWorldOnB.w = p.tangents[0].impulse;
    if (m_flags & STEP_TWO_FRICTION) p.point->lateralFrictionDir1.w = p.tangents[1].impulse;
  }

  uint m_flags;
  const std::vector<SolverMass>& m_masses;
  SolveReference& m_state;
  std::vector<PointRows> m_points;
  std::vector<Velocity> m_velocities, m_pushes;
};

}  // namespace

void solveVelocitiesReference(const StepParams& params, int iterations, const std::vector<SlotHeader>& slots,
                              const std::vector<SolverMass>& masses, SolveReference& state) {
  Solver solver(params, slots, masses, state);
  if (params.flags & STEP_WARM_START) solver.warmStart();
  for (int i = 0; i < iterations; ++i) solver.iterate();
  solver.store();
}

}  // namespace btgpu
