// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "67_split_masses_reference.h"

#include "65_prepare_contacts_reference.h"
#include "reference_maths.h"

namespace btgpu {
namespace {

using namespace reference;

constexpr double kRounding = 1.0 / 16777216;

// n . M^-1 n of what copies yield more than whole bodies, and what it would be without cancellation.
struct Excess {
  double value = 0, size = 0;
};

// How a row's jac shrinks, and how far a float may be off.
struct Share {
  double value = 1, limit = 0;
};

Share shareOf(double jac, double scale, const Excess& excess) {
  Share s;
  s.value = 1 / (1 + excess.value * jac / scale);
  s.limit = s.value * s.value * 24 * kRounding * excess.size * jac / scale + 6 * kRounding * s.value;
  return s;
}

Matrix inertiaOf(const BodyStep& step) {
  return {{toVec(step.inverseInertia0), toVec(step.inverseInertia1), toVec(step.inverseInertia2)}};
}

double normOf(const Matrix& m) { return length(m.row[0]) + length(m.row[1]) + length(m.row[2]); }

class Splitter {
 public:
  Splitter(const SplitMassesInput& in, const SplitMassesState& before) : m_in(in), m_before(before) {
    m_out.values = before;
    m_out.rowLimits.resize(before.rows.size());
    m_out.tangent2Limits.resize(before.tangent2.size());
    m_out.torsionLimits.resize(before.torsion.size());
    m_out.shareLimits.resize(in.jointRows.size());
  }

  SplitMassesReference run() {
    splitBodies();
    for (size_t slot = 0; slot < m_in.slots.size(); ++slot) {
      if (m_in.slots[slot].manifold != NO_INDEX) splitSlot(slot);
    }
    m_out.values.splitRows = m_in.jointRows;
    for (size_t j = 0; j < m_in.joints.size(); ++j) splitJoint(j);
    return m_out;
  }

 private:
  double copiesOf(uint body) const { return m_in.copyFirst[body + 1] - m_in.copyFirst[body]; }

  void splitBodies() {
    m_out.values.copies.assign(m_in.copyFirst.back(), SolverBody{});
    m_out.values.copyMasses.clear();
    for (uint i = 0; i < m_in.steps.size(); ++i) {
      SolverMass mass = m_in.solverMasses[i];
      for (float4* row : {&mass.row0, &mass.row1, &mass.row2}) *row *= static_cast<float>(copiesOf(i));
      for (int k = 0; k < copiesOf(i); ++k) m_out.values.copyMasses.push_back(mass);
    }
  }

  // What the copies of a body yield more along n at r.
  void addCompliance(Excess& sum, uint body, bool moved, Vec n, Vec r) const {
    if (!moved) return;
    const double more = copiesOf(body) - 1;
    const float4 f = m_in.masses[body].angularFactor;
    const Matrix inertia = inertiaOf(m_in.steps[body]);
    Vec turned = inertia * cross(r, n);
    turned = {turned.x * f.x, turned.y * f.y, turned.z * f.z};
    const double inverseMass = m_in.steps[body].linearVelocity.w;
    const double factor = std::fabs(double(f.x)) + std::fabs(double(f.y)) + std::fabs(double(f.z));
    sum.value += more * (inverseMass + dot(n, cross(turned, r)));
    sum.size += more * (inverseMass + normOf(inertia) * factor * dot(r, r) * dot(n, n));
  }

  Excess excessAlong(const SlotHeader& h, Vec n, Vec ra, Vec rb) const {
    Excess sum;
    const Manifold& m = m_in.manifolds[h.manifold];
    addCompliance(sum, m.bodyA, h.bodyA != NO_INDEX, n, ra);
    addCompliance(sum, m.bodyB, h.bodyB != NO_INDEX, n, rb);
    return sum;
  }

  void addTurning(Excess& sum, uint body, bool moved, Vec axis) const {
    if (!moved) return;
    const Matrix inertia = inertiaOf(m_in.steps[body]);
    sum.value += (copiesOf(body) - 1) * dot(inertia * axis, axis);
    sum.size += (copiesOf(body) - 1) * normOf(inertia) * dot(axis, axis);
  }

  static Vec vectorAt(const std::vector<float>& array, size_t slot, size_t fields, size_t field) {
    return {array[rowIndex(slot, fields, field)], array[rowIndex(slot, fields, field + 1)],
            array[rowIndex(slot, fields, field + 2)]};
  }

  static void scale(std::vector<float>& array, std::vector<double>& limits, size_t index, const Share& share) {
    limits[index] = std::fabs(double(array[index])) * share.limit;
    array[index] = static_cast<float>(array[index] * share.value);
  }

  void splitSlot(size_t slot) {
    const SlotHeader& h = m_in.slots[slot];
    SplitMassesState& v = m_out.values;
    for (size_t k = 0; k < h.pointCount; ++k) {
      const size_t first = k * POINT_FIELDS;
      const auto at = [&](size_t f) { return rowIndex(slot, SLOT_FIELDS, first + f); };
      const double jac = v.rows[at(ROW_NORMAL_JAC)];
      if (jac == 0) continue;
      const Vec ra = vectorAt(v.rows, slot, SLOT_FIELDS, first + ROW_R_A);
      const Vec rb = vectorAt(v.rows, slot, SLOT_FIELDS, first + ROW_R_B);
      const auto shareAlong = [&](Vec n, double rowJac) {
        return shareOf(rowJac, m_in.params.sor, excessAlong(h, n, ra, rb));
      };
      const Share normal = shareAlong(vectorAt(v.rows, slot, SLOT_FIELDS, first + ROW_NORMAL), jac);
      for (const int f : {ROW_NORMAL_JAC, ROW_NORMAL_RHS, ROW_NORMAL_CFM, ROW_PUSH_RHS}) {
        scale(v.rows, m_out.rowLimits, at(static_cast<size_t>(f)), normal);
      }
      const Vec t1 = vectorAt(v.rows, slot, SLOT_FIELDS, first + ROW_TANGENT1);
      const Share tangent1 = shareAlong(t1, v.rows[at(ROW_TANGENT1_JAC)]);
      scale(v.rows, m_out.rowLimits, at(ROW_TANGENT1_JAC), tangent1);
      scale(v.rows, m_out.rowLimits, at(ROW_TANGENT1_RHS), tangent1);
      if (m_in.params.flags & STEP_TWO_FRICTION) {
        const auto at2 = [&](size_t f) { return rowIndex(slot, SLOT_TANGENT2_FIELDS, k * TANGENT2_FIELDS + f); };
        const Vec t2 = vectorAt(v.tangent2, slot, SLOT_TANGENT2_FIELDS, k * TANGENT2_FIELDS + ROW_TANGENT2);
        const Share tangent2 = shareAlong(t2, v.tangent2[at2(ROW_TANGENT2_JAC)]);
        scale(v.tangent2, m_out.tangent2Limits, at2(ROW_TANGENT2_JAC), tangent2);
        scale(v.tangent2, m_out.tangent2Limits, at2(ROW_TANGENT2_RHS), tangent2);
      }
      for (size_t r = 0; (m_in.params.flags & STEP_TORSION) && r < TORSION_ROWS; ++r) {
        splitTorsion(slot, (k * TORSION_ROWS + r) * TORSION_FIELDS);
      }
    }
  }

  void splitTorsion(size_t slot, size_t field) {
    const SlotHeader& h = m_in.slots[slot];
    const Manifold& m = m_in.manifolds[h.manifold];
    std::vector<float>& rows = m_out.values.torsion;
    const size_t jac = rowIndex(slot, SLOT_TORSION_FIELDS, field + ROW_TORSION_JAC);
    if (rows[jac] == 0) return;
    const Vec axis = vectorAt(rows, slot, SLOT_TORSION_FIELDS, field + ROW_TORSION_AXIS);
    Excess sum;
    addTurning(sum, m.bodyA, h.bodyA != NO_INDEX, axis);
    addTurning(sum, m.bodyB, h.bodyB != NO_INDEX, axis);
    const Share share = shareOf(rows[jac], 1, sum);
    scale(rows, m_out.torsionLimits, jac, share);
    scale(rows, m_out.torsionLimits, rowIndex(slot, SLOT_TORSION_FIELDS, field + ROW_TORSION_RHS), share);
  }

  void splitJoint(size_t j) {
    const Joint &joint = m_in.joints[j], &split = m_in.splitJoints[j];
    if (split.bodyA == NO_INDEX && split.bodyB == NO_INDEX) return;
    for (uint r = joint.firstRow; r < joint.firstRow + joint.rowCount; ++r) {
      JointEffect& effect = m_out.values.effects[r];
      if (effect.jac == 0) continue;
      JointRow& row = m_out.values.splitRows[r];
      Excess sum;
      const auto add = [&](uint body, float4 linear, float4 angular) {
        if (body == NO_INDEX) return;
        const double inverseMass = m_in.steps[body].linearVelocity.w, more = copiesOf(body) - 1;
        sum.value += more * inverseMass * dot(toVec(linear), toVec(linear));
        sum.size += more * inverseMass * dot(toVec(linear), toVec(linear));
        addTurning(sum, body, true, toVec(angular));
      };
      add(joint.bodyA, row.linearA, row.angularA);
      add(joint.bodyB, row.linearB, row.angularB);
      const Share share = shareOf(effect.jac, 1, sum);
      effect.jac = static_cast<float>(effect.jac * share.value);
      effect.rhs = static_cast<float>(effect.rhs * share.value);
      row.angularA.w = static_cast<float>(row.angularA.w * share.value);
      m_out.shareLimits[r] = share.limit;
    }
  }

  const SplitMassesInput& m_in;
  const SplitMassesState& m_before;
  SplitMassesReference m_out;
};

void checkArray(Contract& c, const char* what, const std::vector<float>& device, const std::vector<float>& expected,
                const std::vector<double>& limits) {
  for (size_t i = 0; c.ok() && i < expected.size(); ++i) {
    if (std::memcmp(&device[i], &expected[i], sizeof(float)) == 0) continue;
    c.at("float {} of the {}", i, what);
    c.near("value", device[i], expected[i], limits[i]);
  }
}

}  // namespace

SplitMassesReference splitMassesReference(const SplitMassesInput& in, const SplitMassesState& before) {
  return Splitter(in, before).run();
}

void checkSplitMasses(Contract& contract, const SplitMassesInput& in, const SplitMassesState& before,
                      const SplitMassesState& device, const SplitMassesReference& expected) {
  const SplitMassesState& e = expected.values;
  contract.sameArray("copy", device.copies, e.copies);
  contract.sameArray("mass of copy", device.copyMasses, e.copyMasses);
  checkArray(contract, "rows", device.rows, e.rows, expected.rowLimits);
  checkArray(contract, "second friction rows", device.tangent2, e.tangent2, expected.tangent2Limits);
  checkArray(contract, "torsional rows", device.torsion, e.torsion, expected.torsionLimits);
  for (size_t r = 0; r < in.jointRows.size(); ++r) {
    const double limit = expected.shareLimits[r];
    contract.at("joint row {}", r);
    contract.near("jac", device.effects[r].jac, e.effects[r].jac, limit * std::fabs(double(before.effects[r].jac)));
    contract.near("rhs", device.effects[r].rhs, e.effects[r].rhs, limit * std::fabs(double(before.effects[r].rhs)));
    JointRow row = device.splitRows[r];
    contract.near("cfm", row.angularA.w, e.splitRows[r].angularA.w,
                  limit * std::fabs(double(in.jointRows[r].angularA.w)));
    row.angularA.w = in.jointRows[r].angularA.w;
    contract.require(std::memcmp(&row, &in.jointRows[r], sizeof row) == 0, "as it was, but for its cfm");
  }
}

}  // namespace btgpu
