// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "70_solve_velocities_reference.h"

#include <algorithm>
#include <limits>

#include "65_prepare_contacts_reference.h"

namespace btgpu {
namespace {

template <typename Real>
struct Vec3 {
  Real x = 0, y = 0, z = 0;
  Vec3 operator+(Vec3 b) const { return {x + b.x, y + b.y, z + b.z}; }
  Vec3 operator*(Real s) const { return {x * s, y * s, z * s}; }
  Vec3 operator-() const { return {-x, -y, -z}; }
};
template <typename Real>
Real dot(Vec3<Real> a, Vec3<Real> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <typename Real>
Vec3<Real> cross(Vec3<Real> a, Vec3<Real> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <typename Real>
struct Velocity {
  Vec3<Real> linear, angular;
};

// One end of a row: how the body's velocity counts, and how it answers to a unit impulse.
template <typename Real>
struct End {
  uint body = NO_INDEX;
  Velocity<Real> jacobian, response;
};

// One row, as Bullet's btSolverConstraint has it, and where its impulse belongs.
template <typename Real>
struct Row {
  End<Real> a, b;
  Real jac = 0, rhs = 0, cfm = 0, impulse = 0, lower = 0, upper = 0;
  Real friction = 0;
  float* stored = nullptr;
};

template <typename Real>
struct PointRows {
  Row<Real> normal, push;
  std::vector<Row<Real>> tangents, torsions;
  ContactPoint* point = nullptr;
};

template <typename Real>
class Solver {
  using Vec = Vec3<Real>;

 public:
  Solver(const StepParams& params, const std::vector<SlotHeader>& slots, const std::vector<SolverMass>& masses,
         SolveReference& state)
      : m_flags(params.flags), m_masses(masses), m_state(state) {
    for (size_t slot = 0; slot < slots.size(); ++slot) {
      if (slots[slot].manifold == NO_INDEX) continue;
      for (size_t k = 0; k < slots[slot].pointCount; ++k) m_points.push_back(load(slots[slot], slot, k));
      m_slotEnds.push_back(m_points.size());
    }
    for (const uint j : state.joints.order) {
      if (state.joints.solved[j]) loadJoint(state.joints.joints[j]);
    }
    for (const SolverBody& b : state.bodies) {
      m_velocities.push_back({toVec(b.deltaLinear), toVec(b.deltaAngular)});
      m_pushes.push_back({toVec(b.pushLinear), toVec(b.turnAngular)});
    }
  }

  void warmStart() {
    for (PointRows<Real>& p : m_points) apply(m_velocities, p.normal, p.normal.impulse);
  }

  int jointIterations() const {
    int most = 0;
    for (const JointRowOf& r : m_jointRows) most = std::max(most, r.iterations);
    return most;
  }

  void iterateJoints(int iteration) {
    for (JointRowOf& r : m_jointRows) {
      if (iteration < r.iterations && r.row.jac != 0) solve(m_velocities, r.row);
    }
  }

  void iterate(bool last) {
    const bool apart = last && !(m_flags & STEP_INTERLEAVE);
    size_t first = 0;
    for (const size_t end : m_slotEnds) {
      iterateSlot(first, end, !apart);
      first = end;
    }
    if (apart) {
      for (PointRows<Real>& p : m_points) solveFriction(p);
    }
    if (m_flags & STEP_SPLIT_IMPULSE) {
      for (PointRows<Real>& p : m_points) {
        if (p.push.rhs != 0) solve(m_pushes, p.push);
      }
    }
    for (PointRows<Real>& p : m_points) solveTorsion(p);
  }

  void averageCopies() {
    const std::vector<uint>& first = m_state.copyFirst;
    for (size_t i = 0; i + 1 < first.size(); ++i) {
      average(m_velocities, first[i], first[i + 1]);
      average(m_pushes, first[i], first[i + 1]);
    }
  }

  void store() {
    for (size_t i = 0; i < m_velocities.size(); ++i) {
      SolverBody& b = m_state.bodies[i];
      b.deltaLinear = toFloat4(m_velocities[i].linear);
      b.deltaAngular = toFloat4(m_velocities[i].angular);
      b.pushLinear = toFloat4(m_pushes[i].linear);
      b.turnAngular = toFloat4(m_pushes[i].angular);
    }
    for (PointRows<Real>& p : m_points) storePoint(p);
    for (JointRowOf& r : m_jointRows) *r.row.stored = static_cast<float>(r.row.impulse);
  }

 private:
  // The points first ... end - 1 of one manifold.
  void iterateSlot(size_t first, size_t end, bool friction) {
    for (size_t i = first; i < end; ++i) {
      solve(m_velocities, m_points[i].normal);
      if (m_flags & STEP_INTERLEAVE) solveFriction(m_points[i]);
    }
    if (!friction || (m_flags & STEP_INTERLEAVE)) return;
    for (size_t i = first; i < end; ++i) solveFriction(m_points[i]);
  }

  static void average(std::vector<Velocity<Real>>& velocities, size_t first, size_t end) {
    Velocity<Real> sum;
    for (size_t i = first; i < end; ++i) {
      sum.linear = sum.linear + velocities[i].linear;
      sum.angular = sum.angular + velocities[i].angular;
    }
    const Real share = Real(1) / static_cast<Real>(end - first);
    for (size_t i = first; i < end; ++i) velocities[i] = {sum.linear * share, sum.angular * share};
  }

  struct JointRowOf {
    Row<Real> row;
    int iterations;
  };

  void loadJoint(const Joint& joint) {
    JointSolveReference& j = m_state.joints;
    for (size_t r = joint.firstRow; r < joint.firstRow + joint.rowCount; ++r) {
      const JointRow& from = j.rows[r];
      Row<Real> row;
      row.a = makeEnd(joint.bodyA, toVec(from.linearA), toVec(from.angularA));
      row.b = makeEnd(joint.bodyB, toVec(from.linearB), toVec(from.angularB));
      row.jac = j.effects[r].jac;
      row.rhs = j.effects[r].rhs;
      row.cfm = from.angularA.w;
      row.lower = from.linearB.w;
      row.upper = from.angularB.w;
      row.stored = &j.impulses[r];
      row.impulse = *row.stored;
      m_jointRows.push_back({row, joint.iterations});
    }
  }

  static Vec toVec(float4 v) { return {v.x, v.y, v.z}; }
  static float4 toFloat4(Vec v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), 0};
  }

  static Vec vectorAt(const std::vector<float>& array, size_t slot, size_t fields, size_t field) {
    return {array[rowIndex(slot, fields, field)], array[rowIndex(slot, fields, field + 1)],
            array[rowIndex(slot, fields, field + 2)]};
  }

  End<Real> makeEnd(uint body, Vec linear, Vec angular) const {
    End<Real> end;
    if (body == NO_INDEX) return end;
    const SolverMass& m = m_masses[body];
    end.body = body;
    end.jacobian = {linear, angular};
    end.response.linear = {m.row0.w * linear.x, m.row1.w * linear.y, m.row2.w * linear.z};
    end.response.angular = {dot(toVec(m.row0), angular), dot(toVec(m.row1), angular), dot(toVec(m.row2), angular)};
    return end;
  }

  Row<Real> makeRow(const SlotHeader& h, Vec n, Vec ra, Vec rb) const {
    Row<Real> row;
    row.a = makeEnd(h.bodyA, n, cross(ra, n));
    row.b = makeEnd(h.bodyB, -n, -cross(rb, n));
    return row;
  }

  void addTangent(PointRows<Real>& p, const SlotHeader& h, std::vector<float>& array, size_t slot, size_t fields,
                  size_t field, Vec ra, Vec rb) const {
    Row<Real> row = makeRow(h, vectorAt(array, slot, fields, field), ra, rb);
    row.jac = array[rowIndex(slot, fields, field + 3)];
    row.rhs = array[rowIndex(slot, fields, field + 4)];
    row.stored = &array[rowIndex(slot, fields, field + 5)];
    row.impulse = *row.stored;
    p.tangents.push_back(row);
  }

  void addTorsion(PointRows<Real>& p, const SlotHeader& h, size_t slot, size_t field) const {
    const auto at = [&](size_t f) -> float& { return m_state.torsion[rowIndex(slot, SLOT_TORSION_FIELDS, field + f)]; };
    const Vec axis = vectorAt(m_state.torsion, slot, SLOT_TORSION_FIELDS, field + ROW_TORSION_AXIS);
    Row<Real> row;
    row.a = makeEnd(h.bodyA, {}, -axis);
    row.b = makeEnd(h.bodyB, {}, axis);
    row.jac = at(ROW_TORSION_JAC);
    row.rhs = at(ROW_TORSION_RHS);
    row.friction = at(ROW_TORSION_FRICTION);
    row.stored = &at(ROW_TORSION_IMPULSE);
    row.impulse = *row.stored;
    p.torsions.push_back(row);
  }

  PointRows<Real> load(const SlotHeader& h, size_t slot, size_t k) const {
    const size_t first = k * POINT_FIELDS;
    const auto at = [&](size_t f) -> float& { return m_state.rows[rowIndex(slot, SLOT_FIELDS, first + f)]; };
    const Vec n = vectorAt(m_state.rows, slot, SLOT_FIELDS, first + ROW_NORMAL);
    const Vec ra = vectorAt(m_state.rows, slot, SLOT_FIELDS, first + ROW_R_A);
    const Vec rb = vectorAt(m_state.rows, slot, SLOT_FIELDS, first + ROW_R_B);
    PointRows<Real> p;
    p.normal = makeRow(h, n, ra, rb);
    p.normal.jac = at(ROW_NORMAL_JAC);
    p.normal.rhs = at(ROW_NORMAL_RHS);
    p.normal.cfm = at(ROW_NORMAL_CFM);
    p.normal.friction = at(ROW_FRICTION);
    p.normal.stored = &at(ROW_NORMAL_IMPULSE);
    p.normal.impulse = *p.normal.stored;
    p.normal.upper = std::numeric_limits<Real>::infinity();
    p.push = p.normal;
    p.push.rhs = at(ROW_PUSH_RHS);
    p.push.stored = &at(ROW_PUSH_IMPULSE);
    p.push.impulse = *p.push.stored;
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

  static void apply(std::vector<Velocity<Real>>& velocities, const Row<Real>& row, Real impulse) {
    for (const End<Real>* end : {&row.a, &row.b}) {
      if (end->body == NO_INDEX) continue;
      Velocity<Real>& v = velocities[end->body];
      v.linear = v.linear + end->response.linear * impulse;
      v.angular = v.angular + end->response.angular * impulse;
    }
  }

  // gResolveSingleConstraintRowGeneric.
  static void solve(std::vector<Velocity<Real>>& velocities, Row<Real>& row) {
    Real delta = row.rhs - row.impulse * row.cfm;
    for (const End<Real>* end : {&row.a, &row.b}) {
      if (end->body == NO_INDEX) continue;
      const Velocity<Real>& v = velocities[end->body];
      delta -= (dot(end->jacobian.linear, v.linear) + dot(end->jacobian.angular, v.angular)) * row.jac;
    }
    const Real sum = std::clamp(row.impulse + delta, row.lower, row.upper);
    apply(velocities, row, sum - row.impulse);
    row.impulse = sum;
  }

  void solveFriction(PointRows<Real>& p) {
    if (!(p.normal.impulse > 0)) return;
    for (Row<Real>& row : p.tangents) {
      row.upper = p.normal.friction * p.normal.impulse;
      row.lower = -row.upper;
      solve(m_velocities, row);
    }
  }

  void solveTorsion(PointRows<Real>& p) {
    if (!(p.normal.impulse > 0)) return;
    for (Row<Real>& row : p.torsions) {
      row.upper = std::min(row.friction * p.normal.impulse, row.friction);
      row.lower = -row.upper;
      solve(m_velocities, row);
    }
  }

  void storePoint(PointRows<Real>& p) const {
    const auto store = [](Row<Real>& row) { *row.stored = static_cast<float>(row.impulse); };
    store(p.normal);
    store(p.push);
    for (auto& row : p.tangents) store(row);
    for (auto& row : p.torsions) store(row);
    // writeBackContacts; a contact without a row keeps its impulses.
    if (!(m_flags & STEP_WARM_START) || p.normal.jac == 0) return;
    p.point->localPointB.w = *p.normal.stored;
    p.point->normalWorldOnB.w = *p.tangents[0].stored;
    if (m_flags & STEP_TWO_FRICTION) p.point->lateralFrictionDir1.w = *p.tangents[1].stored;
  }

  uint m_flags;
  const std::vector<SolverMass>& m_masses;
  SolveReference& m_state;
  std::vector<PointRows<Real>> m_points;  // slot by slot
  std::vector<size_t> m_slotEnds;         // in m_points
  std::vector<JointRowOf> m_jointRows;
  std::vector<Velocity<Real>> m_velocities, m_pushes;
};

template <typename Real>
void solveAs(const StepParams& params, int iterations, const std::vector<SlotHeader>& slots,
             const std::vector<SolverMass>& masses, SolveReference& state) {
  Solver<Real> solver(params, slots, masses, state);
  if (params.flags & STEP_WARM_START) solver.warmStart();
  solver.averageCopies();
  for (int i = 0; i < std::max(iterations, solver.jointIterations()); ++i) {
    solver.iterateJoints(i);
    if (i < iterations) solver.iterate(i == iterations - 1);
    solver.averageCopies();
  }
  solver.store();
}

}  // namespace

void solveVelocitiesReference(const StepParams& params, int iterations, const std::vector<SlotHeader>& slots,
                              const std::vector<SolverMass>& masses, SolveReference& state) {
  solveAs<float>(params, iterations, slots, masses, state);
}

void solveVelocitiesExactly(const StepParams& params, int iterations, const std::vector<SlotHeader>& slots,
                            const std::vector<SolverMass>& masses, SolveReference& state) {
  solveAs<double>(params, iterations, slots, masses, state);
}

}  // namespace btgpu
