// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "65_prepare_soft_contacts_reference.h"

#include <random>

#include "substep_maths.h"

namespace btgpu {
namespace {

using namespace substeps;

constexpr double kEpsilon = 1.1920929e-7;  // SIMD_EPSILON in a float build of Bullet

template <typename Real>
struct Frame {
  Vec3<Real> x, y, z;  // the body's axes in world axes
  Vec3<Real> toWorld(Vec3<Real> v) const { return x * v.x + y * v.y + z * v.z; }
  Vec3<Real> toBody(Vec3<Real> v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
};

template <typename Real>
Frame<Real> frameOf(float4 q) {
  const Real x = q.x, y = q.y, z = q.z, w = q.w, s = 2 / (x * x + y * y + z * z + w * w);
  return {{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)},
          {s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)},
          {s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)}};
}

template <typename Real>
struct End {
  Vec3<Real> linear, angular, forceLinear, forceAngular;  // before the step, and what its forces add
  SolverMass mass{};
  Frame<Real> frame;
  BodyMaterial material{};
  uint flags = 0;
  bool held = false, pushed = false;

  Vec3<Real> velocity(Vec3<Real> r) const { return linear + cross(angular, r); }
  Vec3<Real> velocityAfter(Vec3<Real> r) const { return linear + forceLinear + cross(angular + forceAngular, r); }
  Vec3<Real> heldVelocity(Vec3<Real> r) const { return held ? velocity(r) : Vec3<Real>{}; }
  Vec3<Real> heldTurn() const { return held ? angular : Vec3<Real>{}; }
};

template <typename Real>
class Preparer {
  using Vec = Vec3<Real>;

 public:
  Preparer(const PrepareInput& in, PrepareSoftReference& out)
      : m_in(in), m_out(out), m_n(Real(in.params.substeps)), m_h(Real(in.params.timeStep) / m_n) {}

  void run() {
    prepareBodies();
    for (size_t slot = 0; slot < m_in.slots.size(); ++slot) {
      if (m_in.slots[slot].manifold != NO_INDEX) prepareSlot(slot);
    }
  }

 private:
  void prepareBodies() {
    for (size_t i = 0; i < m_in.steps.size(); ++i) {
      const BodyStep& s = m_in.steps[i];
      const Vec linear = toVec<Real>(s.linearVelocity) + toVec<Real>(s.externalLinear) / m_n;
      const Vec angular = toVec<Real>(s.angularVelocity) + toVec<Real>(s.externalAngular) / m_n;
      m_out.solverBodies.push_back({toFloat4(linear), toFloat4(angular), {}, {}});
      m_out.starts.push_back({toFloat4(linear), toFloat4(angular)});
      const float4 l = m_in.masses[i].linearFactor, a = m_in.masses[i].angularFactor;
      const Real m = s.linearVelocity.w;
      const auto row = [&](float4 inertia, Real factor, Real turn) {
        float4 r = toFloat4(toVec<Real>(inertia) * (turn * turn));
        r.w = static_cast<float>(m * factor * factor);
        return r;
      };
      m_out.solverMasses.push_back({row(s.inverseInertia0, Real(l.x), Real(a.x)),
                                    row(s.inverseInertia1, Real(l.y), Real(a.y)),
                                    row(s.inverseInertia2, Real(l.z), Real(a.z))});
    }
  }

  End<Real> endOf(uint body, bool held) const {
    End<Real> e;
    const BodyStep& s = m_in.steps[body];
    e.linear = toVec<Real>(s.linearVelocity);
    e.angular = toVec<Real>(s.angularVelocity);
    e.forceLinear = toVec<Real>(s.externalLinear);
    e.forceAngular = toVec<Real>(s.externalAngular);
    if (!held) e.mass = m_out.solverMasses[body];
    e.frame = frameOf<Real>(m_in.poses[body].orientation);
    e.material = m_in.materials[body];
    e.flags = m_in.infos[body].flags;
    e.held = held;
    const Vec push = toVec<Real>(m_in.masses[body].linearFactor) * Real(s.linearVelocity.w);
    e.pushed = dot(push, push) >= Real(kEpsilon * kEpsilon);
    return e;
  }

  static Real yield(const End<Real>& a, const End<Real>& b, Line<Real> ra, Line<Real> rb, Line<Real> sa,
                    Line<Real> sb) {
    return product(ra, response(a.mass, sa)) + product(rb, response(b.mass, sb));
  }
  static Real inverse(Real sum) { return sum > 0 && std::isfinite(1 / sum) ? 1 / sum : Real(0); }

  float& at(size_t slot, size_t f) { return m_out.rows[rowIndex(slot, SLOT_SOFT_FIELDS, f)]; }
  void put(size_t slot, size_t f, Real v) { at(slot, f) = static_cast<float>(v); }
  void put(size_t slot, size_t f, Vec v) {
    put(slot, f, v.x);
    put(slot, f + 1, v.y);
    put(slot, f + 2, v.z);
  }

  bool preparePoint(size_t slot, uint k, const End<Real>& a, const End<Real>& b, float threshold,
                    const ContactPoint& p) {
    const StepParams& s = m_in.params;
    const size_t f = k * SOFT_POINT_FIELDS;
    const Vec n = toVec<Real>(p.normalWorldOnB);
    const Vec ra = a.frame.toWorld(toVec<Real>(p.localPointA)), rb = b.frame.toWorld(toVec<Real>(p.localPointB));
    const Line<Real> la{n, cross(ra, n)}, lb{n, cross(rb, n)};
    const Real before = dot(n, a.velocity(ra) - b.velocity(rb));
    const Real after = dot(n, a.velocityAfter(ra) - b.velocityAfter(rb));
    const Real separation = Real(p.localPointA.w) + Real(s.linearSlop);
    Real mass = inverse(yield(a, b, la, lb, la, lb));
    if (p.localPointA.w > threshold || !(a.pushed || b.pushed) || !std::isfinite(before + separation)) mass = 0;
    Real bounce = 0;
    if (mass != 0 && std::fabs(before) >= Real(s.restitutionVelocityThreshold) && Real(p.combined.y) * before < 0) {
      const Real pull = std::max(before - after, Real(0)) / Real(s.timeStep);
      bounce = Real(p.combined.y) * std::sqrt(after * after + 2 * pull * std::max(separation, Real(0)));
      if (bounce > 0) ++m_out.bouncing;
    }
    Real share = 0, rate = 0;
    if (p.flags & POINT_STIFFNESS_DAMPING) {
      const Real k1 = m_h * Real(p.combinedStiffness);
      const Real sum = std::max(k1 + Real(p.combinedDamping), Real(kEpsilon));
      rate = k1 <= Real(std::numeric_limits<float>::max()) ? k1 / sum / m_h : 1 / m_h;
      share = 1 / (1 + mass / (sum * m_h));
    }
    put(slot, f + SOFT_NORMAL, n);
    put(slot, f + SOFT_ANGULAR_A, la.angular);
    put(slot, f + SOFT_ANGULAR_B, lb.angular);
    put(slot, f + SOFT_MASS, mass);
    put(slot, f + SOFT_SEPARATION, separation);
    put(slot, f + SOFT_HELD, dot(n, a.heldVelocity(ra) - b.heldVelocity(rb)));
    put(slot, f + SOFT_SPRING_SHARE, share);
    put(slot, f + SOFT_SPRING_RATE, rate);
    const bool warm = mass != 0 && (s.flags & STEP_WARM_START);
    put(slot, f + SOFT_IMPULSE, warm ? Real(p.localPointB.w) * Real(s.warmStartingFactor) / m_n : Real(0));
    put(slot, f + SOFT_TOTAL, Real(0));
    put(slot, f + SOFT_BOUNCE, bounce);
    return mass != 0;
  }

  Vec scaled(const End<Real>& a, const End<Real>& b, uint wanted, Vec v) const {
    for (const End<Real>* e : {&a, &b}) {
      if (!(e->flags & wanted)) continue;
      const Vec f = toVec<Real>(e->material.anisotropicFriction), in = e->frame.toBody(v);
      v = e->frame.toWorld({in.x * f.x, in.y * f.y, in.z * f.z});
    }
    return v;
  }
  // btPlaneSpace1
  static void planeSpace(Vec n, Vec& p, Vec& q) {
    p = std::fabs(n.z) > Real(0.70710678f) ? Vec{0, -n.z, n.y} : Vec{-n.y, n.x, 0};
    p = p / length(p);
    q = cross(n, p);
  }

  void prepareSlot(size_t slot) {
    const SlotHeader& h = m_in.slots[slot];
    const StepParams& s = m_in.params;
    Manifold& m = m_out.manifolds[h.manifold];
    const End<Real> a = endOf(m.bodyA, h.bodyA == NO_INDEX), b = endOf(m.bodyB, h.bodyB == NO_INDEX);
    std::vector<uint> solved;
    for (uint k = 0; k < h.pointCount; ++k) {
      if (preparePoint(slot, k, a, b, m.processingThreshold, m.points[k])) solved.push_back(k);
    }
    Vec armA, armB, normal, impulse;
    Real friction = 0, roll = 0, spin = 0, lever = 0;
    const Real part = solved.empty() ? Real(0) : 1 / Real(solved.size());
    for (const uint k : solved) {
      const ContactPoint& p = m.points[k];
      armA = armA + a.frame.toWorld(toVec<Real>(p.localPointA)) * part;
      armB = armB + b.frame.toWorld(toVec<Real>(p.localPointB)) * part;
      normal = normal + toVec<Real>(p.normalWorldOnB);
      impulse = impulse + toVec<Real>(p.lateralFrictionDir1) * Real(p.normalWorldOnB.w) +
                toVec<Real>(p.lateralFrictionDir2) * Real(p.lateralFrictionDir1.w);
      friction += Real(p.combined.x) * part;
      roll += Real(p.combined.z) * part;
      if (p.combined.z > 0) spin += Real(p.combined.w) * part;
    }
    normal = length(normal) > 0 ? normal / length(normal) : Vec{};
    for (const uint k : solved) {
      const Vec away = a.frame.toWorld(toVec<Real>(m.points[k].localPointA)) - armA;
      lever += part * length(away - normal * dot(normal, away));
    }
    Vec t1, t2;
    if (!solved.empty()) {
      const ContactPoint& first = m.points[solved.front()];
      const Vec slip = a.velocityAfter(armA) - b.velocityAfter(armB), lateral = slip - normal * dot(normal, slip);
      if ((s.flags & STEP_FRICTION_CACHING) && (first.flags & POINT_LATERAL_FRICTION_INITIALIZED)) {
        t1 = toVec<Real>(first.lateralFrictionDir1);
        t2 = toVec<Real>(first.lateralFrictionDir2);
      } else {
        if (!(s.flags & STEP_NO_VELOCITY_FRICTION) && dot(lateral, lateral) > Real(kEpsilon)) {
          t1 = lateral / length(lateral);
          t2 = cross(t1, normal) / length(cross(t1, normal));
        } else {
          planeSpace(normal, t1, t2);
        }
        t1 = scaled(a, b, BODY_ANISOTROPIC, t1);
        t2 = scaled(a, b, BODY_ANISOTROPIC, t2);
      }
      for (const uint k : solved) {
        for (const auto& [to, v] :
             {std::pair(&m.points[k].lateralFrictionDir1, t1), std::pair(&m.points[k].lateralFrictionDir2, t2)}) {
          const float w = to->w;
          *to = toFloat4(v);
          to->w = w;
        }
      }
    }
    const bool warm = (s.flags & STEP_WARM_START) && std::isfinite(impulse.x + impulse.y + impulse.z);
    impulse = warm ? impulse * (Real(s.warmStartingFactor) / m_n) : Vec{};
    putFriction(slot, a, b, armA, armB, normal, t1, t2, impulse);
    put(slot, SOFT_FRICTION + SOFT_COEFFICIENT, friction);
    put(slot, SOFT_FRICTION + SOFT_LEVER, lever);
    put(slot, SOFT_FRICTION + SOFT_SPIN, spin);
    if (!(s.flags & STEP_TORSION)) return;
    Vec p1, p2;
    if (length(normal) > 0) planeSpace(normal, p1, p2);
    putRoll(slot, 0, a, b, scaled(a, b, BODY_ANISOTROPIC_ROLLING, p1), roll);
    putRoll(slot, SOFT_ROLL_FIELDS, a, b, scaled(a, b, BODY_ANISOTROPIC_ROLLING, p2), roll);
  }

  void putFriction(size_t slot, const End<Real>& a, const End<Real>& b, Vec armA, Vec armB, Vec normal, Vec t1, Vec t2,
                   Vec impulse) {
    constexpr size_t f = SOFT_FRICTION;
    const Line<Real> a1{t1, cross(armA, t1)}, a2{t2, cross(armA, t2)}, b1{t1, cross(armB, t1)}, b2{t2, cross(armB, t2)};
    const Real k11 = yield(a, b, a1, b1, a1, b1), k22 = yield(a, b, a2, b2, a2, b2), k12 = yield(a, b, a1, b1, a2, b2);
    const Real det = k11 * k22 - k12 * k12;
    const bool both = det > Real(1e-4f) * k11 * k22;
    const Vec held = a.heldVelocity(armA) - b.heldVelocity(armB);
    const Line<Real> turn{{}, normal};
    put(slot, f + SOFT_ARM_A, armA);
    put(slot, f + SOFT_ARM_B, armB);
    put(slot, f + SOFT_TANGENT1, t1);
    put(slot, f + SOFT_TANGENT2, t2);
    put(slot, f + SOFT_AXIS, normal);
    put(slot, f + SOFT_MASS11, both ? k22 / det : inverse(k11));
    put(slot, f + SOFT_MASS12, both ? -k12 / det : Real(0));
    put(slot, f + SOFT_MASS22, both ? k11 / det : inverse(k22));
    put(slot, f + SOFT_TWIST_MASS, inverse(yield(a, b, turn, turn, turn, turn)));
    put(slot, f + SOFT_HELD1, dot(t1, held));
    put(slot, f + SOFT_HELD2, dot(t2, held));
    put(slot, f + SOFT_HELD_TWIST, dot(normal, a.heldTurn() - b.heldTurn()));
    put(slot, f + SOFT_IMPULSE1, dot(impulse, t1) * inverse(dot(t1, t1)));
    put(slot, f + SOFT_IMPULSE2, dot(impulse, t2) * inverse(dot(t2, t2)));
    put(slot, f + SOFT_TWIST_IMPULSE, Real(0));
    put(slot, f + SOFT_TOTAL1, Real(0));
    put(slot, f + SOFT_TOTAL2, Real(0));
  }

  void putRoll(size_t slot, size_t f, const End<Real>& a, const End<Real>& b, Vec axis, Real coefficient) {
    const auto to = [&](size_t field, Real v) {
      m_out.rolls[rowIndex(slot, SLOT_ROLL_FIELDS, f + field)] = static_cast<float>(v);
    };
    const Line<Real> turn{{}, axis};
    const bool live = coefficient > 0 && length(axis) > Real(0.001f);
    to(SOFT_ROLL_AXIS, axis.x);
    to(SOFT_ROLL_AXIS + 1, axis.y);
    to(SOFT_ROLL_AXIS + 2, axis.z);
    to(SOFT_ROLL_MASS, live ? inverse(yield(a, b, turn, turn, turn, turn)) : Real(0));
    to(SOFT_ROLL_COEFFICIENT, coefficient);
    to(SOFT_ROLL_HELD, dot(axis, a.heldTurn() - b.heldTurn()));
    to(SOFT_ROLL_IMPULSE, Real(0));
  }

  const PrepareInput& m_in;
  PrepareSoftReference& m_out;
  Real m_n, m_h;
};

template <typename Real>
PrepareSoftReference prepared(const PrepareInput& in, const PrepareSoftReference& before) {
  PrepareSoftReference out;
  out.manifolds = before.manifolds;
  out.rows = before.rows;
  out.rolls = before.rolls;
  Preparer<Real>(in, out).run();
  return out;
}

Kinds differences(const PrepareSoftReference& a, const PrepareSoftReference& b) {
  Kinds kinds;
  for (size_t i = 0; i < b.solverBodies.size(); ++i) {
    kinds.take("linear velocity of body", a.solverBodies[i].deltaLinear, b.solverBodies[i].deltaLinear, i);
    kinds.take("angular velocity of body", a.solverBodies[i].deltaAngular, b.solverBodies[i].deltaAngular, i);
    kinds.take("motion of body", a.solverBodies[i].pushLinear, b.solverBodies[i].pushLinear, i);
    kinds.take("motion of body", a.solverBodies[i].turnAngular, b.solverBodies[i].turnAngular, i);
    kinds.take("start of body", a.starts[i].linear, b.starts[i].linear, i);
    kinds.take("start of body", a.starts[i].angular, b.starts[i].angular, i);
    kinds.take("mark of body", a.starts[i].linear.w, b.starts[i].linear.w, i);
    kinds.take("inertia of body", a.solverMasses[i].row0, b.solverMasses[i].row0, i);
    kinds.take("inertia of body", a.solverMasses[i].row1, b.solverMasses[i].row1, i);
    kinds.take("inertia of body", a.solverMasses[i].row2, b.solverMasses[i].row2, i);
    kinds.take("mass of body", a.solverMasses[i].row0.w, b.solverMasses[i].row0.w, i);
    kinds.take("mass of body", a.solverMasses[i].row1.w, b.solverMasses[i].row1.w, i);
    kinds.take("mass of body", a.solverMasses[i].row2.w, b.solverMasses[i].row2.w, i);
  }
  const auto takeRows = [&kinds](const char* name, const std::vector<float>& x, const std::vector<float>& y,
                                 size_t fields) {
    for (size_t i = 0; i < y.size(); ++i) {
      const size_t field = i / BTGPU_LANES % fields;
      const size_t kind = fields == SLOT_SOFT_FIELDS && field < SOFT_FRICTION ? field % SOFT_POINT_FIELDS : field;
      kinds.take(name + std::to_string(kind) + (kind == field ? "" : " of another point") + " in float", x[i], y[i], i);
    }
  };
  takeRows("field ", a.rows, b.rows, SLOT_SOFT_FIELDS);
  takeRows("rolling field ", a.rolls, b.rolls, SLOT_ROLL_FIELDS);
  for (size_t m = 0; m < b.manifolds.size(); ++m) {
    for (int k = 0; k < MANIFOLD_POINTS; ++k) {
      const ContactPoint &x = a.manifolds[m].points[k], &y = b.manifolds[m].points[k];
      kinds.take("friction direction of manifold", x.lateralFrictionDir1, y.lateralFrictionDir1, m);
      kinds.take("friction direction of manifold", x.lateralFrictionDir2, y.lateralFrictionDir2, m);
    }
  }
  return kinds;
}

PrepareInput nudged(PrepareInput in, unsigned seed) {
  std::mt19937 random(seed);
  float largest = 0;
  for (const BodyStep& s : in.steps) {
    for (const float v : {s.linearVelocity.x, s.linearVelocity.y, s.linearVelocity.z})
      largest = std::max(largest, std::fabs(v));
  }
  for (BodyStep& s : in.steps) {
    for (float* v : {&s.linearVelocity.x, &s.linearVelocity.y, &s.linearVelocity.z}) {
      *v += (random() % 2 ? largest : -largest) / 8388608;
    }
  }
  return in;
}

}  // namespace

void prepareSoftContactsReference(const PrepareInput& in, PrepareSoftReference& out) { out = prepared<float>(in, out); }

void checkPreparedSoftContacts(Contract& contract, const PrepareInput& in, const PrepareSoftReference& before,
                               const PrepareSoftReference& device) {
  const PrepareSoftReference exact = prepared<double>(in, before), plain = prepared<float>(in, before);
  const Kinds error = differences(device, exact);
  Kinds noise = differences(plain, exact);
  const auto holds = [&] {
    Contract trial("");
    error.check(trial, noise);
    return trial.ok();
  };
  bool bouncing = device.bouncing == exact.bouncing || device.bouncing == plain.bouncing;
  for (unsigned seed = 1; seed <= 8 && (!holds() || !bouncing); ++seed) {
    const PrepareSoftReference other = prepared<float>(nudged(in, seed), before);
    noise.takeLarger(differences(other, exact));
    bouncing = bouncing || device.bouncing == other.bouncing;
  }
  error.check(contract, noise);
  contract.at("counters");
  contract.require(bouncing, "as many contacts bounce");
}

}  // namespace btgpu
