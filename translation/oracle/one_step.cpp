// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "one_step.h"

#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "../../gpu_engine/slots.h"
#include "../../kernels/shared/shape.h"
#include "../contacts.h"
#include "../convert.h"
#include "convex_gap.h"
#include "found_contacts.h"

BTGPU_TRANSLATION_BEGIN
namespace {

constexpr double kTouching = 1e-4;       // of the size: pairs within it may or may not have a contact
constexpr double kSameDepth = 2e-4;      // of the size
constexpr double kSameVelocity = 1e-4;   // of 1 + speed
constexpr double kSameNormal = 0.99905;  // cos 2.5 degrees
constexpr int kConvergedIterations = 1000;

int deepestPoint(const Manifold& m) {
  int deepest = 0;
  for (int k = 1; k < m.pointCount; ++k) {
    if (m.points[k].localPointA.w < m.points[deepest].localPointA.w) deepest = k;
  }
  return deepest;
}

const btManifoldPoint& deepestPoint(const btPersistentManifold& m) {
  int deepest = 0;
  for (int k = 1; k < m.getNumContacts(); ++k) {
    if (m.getContactPoint(k).getDistance() < m.getContactPoint(deepest).getDistance()) deepest = k;
  }
  return m.getContactPoint(deepest);
}

double difference(const Velocity& a, const Velocity& b) {
  const double speed = 1 + double(btMax(a.linear.length(), a.angular.length()));
  return double(btMax((a.linear - b.linear).length(), (a.angular - b.angular).length())) / speed;
}

// As the device left them: actions have not added to them yet.
std::vector<Velocity> velocitiesOf(const StepResults& results) {
  std::vector<Velocity> velocities;
  for (const BodyVelocity& v : results.velocities) velocities.push_back({toBullet(v.linear), toBullet(v.angular)});
  return velocities;
}

std::vector<bool> jointedBodies(const OracleWorld& world) {
  std::vector<bool> jointed(world.slotCount(), false);
  for (int i = 0; i < world.getNumConstraints(); ++i) {
    const btTypedConstraint& joint = *world.getConstraint(i);
    for (const btRigidBody* body : {&joint.getRigidBodyA(), &joint.getRigidBodyB()}) {
      const uint slot = world.slotOf(*body);
      if (slot != NO_INDEX) jointed[slot] = true;
    }
  }
  return jointed;
}

std::vector<Velocity> velocitiesOf(const std::vector<BodyState>& states) {
  std::vector<Velocity> velocities;
  for (const BodyState& s : states) velocities.push_back({s.linear, s.angular});
  return velocities;
}

double relativeSize(double size) { return std::isfinite(size) ? std::min(size, 10.0) : 10.0; }

double ratio(double ours, double stock) { return stock > 0 ? ours / stock : (ours > 0 ? HUGE_VAL : 0); }

using SlotPair = std::pair<uint, uint>;

SlotPair pairOf(uint a, uint b) { return {std::min(a, b), std::max(a, b)}; }

// The solver can push it. A kinematic body that kept its mass is: btSequentialImpulseConstraintSolver looks at the
// mass.
bool isPushed(const btCollisionObject* o) {
  const btRigidBody* body = o ? btRigidBody::upcast(o) : nullptr;
  return body && body->getInvMass() != 0;
}
// Solving once more is cheap in small worlds only.
int ordersEvery(size_t bodies) { return bodies < 1000 ? 4 : 25; }

bool isFinite(const btRigidBody& body) {
  const btTransform& pose = body.getWorldTransform();
  btVector3 sum = pose.getOrigin() + body.getLinearVelocity() + body.getAngularVelocity();
  for (int row = 0; row < 3; ++row) sum += pose.getBasis()[row];
  return std::isfinite(double(sum.x() + sum.y() + sum.z()));
}

bool isDynamic(const btCollisionObject* o) { return o && btRigidBody::upcast(o) && !o->isStaticOrKinematicObject(); }

}  // namespace

void Worst::offer(double candidate, uint first, uint second) {
  if (found() && !(candidate > difference)) return;
  a = first;
  b = second;
  difference = candidate;
}

void Measure::add(double difference, bool outlier, uint a, uint b) {
  if (std::isnan(difference)) {
    difference = HUGE_VAL;
    outlier = true;
  }
  ++m_total;
  if (outlier) {
    ++m_outliers;
    ++m_stepOutliers;
  }
  m_largest = std::max(m_largest, difference);
  m_worst.offer(difference, a, b);
}

double Measure::share() const { return m_total ? double(m_outliers) / double(m_total) : 0; }

// Rare events are counted: n p of them are expected, and three standard deviations, sqrt(n p) each, more are seen once
// in hundreds of runs.
double Measure::chance(double limit) const { return m_total ? 3 * std::sqrt(limit / double(m_total)) : 0; }

void RatioSpread::add(double ours, double stock) {
  m_ours += ours;
  m_stock += stock;
  m_oursOurs += ours * ours;
  m_oursStock += ours * stock;
  m_stockStock += stock * stock;
}

// Of a ratio of sums: the root of the sum of (ours - ratio stock)^2, over the sum of stock's.
double RatioSpread::standardError() const {
  if (!(m_stock > 0)) return 0;
  const double ratio = m_ours / m_stock;
  const double squares = m_oursOurs - 2 * ratio * m_oursStock + ratio * ratio * m_stockStock;
  return std::sqrt(std::max(0.0, squares)) / m_stock;
}

BodyEnd captureEnd(const btCollisionObject& object) {
  return {true, false, object.getActivationState(), object.getWorldTransform()};
}

OneStepCheck::OneStepCheck(OracleWorld& oracle, double otherDepthsAllowed, Limits limits)
    : m_oracle(oracle),
      m_depthLimit(std::max(tolerance("contact.depth").limit, otherDepthsAllowed)),
      m_limits(limits) {}

void OneStepCheck::startStep(const StepRecord& step) {
  m_step = &step;
  m_contacts = &step.results.matchedManifolds;
  m_ofPairs = step.results.counters.pairCount;
  m_jointed = jointedBodies(m_oracle);
  m_before = velocitiesOf(step.before);
  m_ours = velocitiesOf(step.results);
  m_sizes.resize(m_oracle.slotCount());
  for (size_t i = 0; i < m_sizes.size(); ++i) {
    const btCollisionObject* o = m_oracle.object(i);
    m_sizes[i] = o ? relativeSize(double(o->getCollisionShape()->getAngularMotionDisc())) : 0;
  }
  for (Measure* m : {&m_missing, &m_depth, &m_normal, &m_free, &m_single, &m_pose, &m_lost, &m_sleep}) m->startStep();
  m_worstBody = BodyDifference();
  m_worstJoint = JointDifference();
}

void OneStepCheck::compare(const StepRecord& step) {
  startStep(step);
  m_oracle.setState(step.before, step.cache ? *step.cache : std::vector<Manifold>(), step.input);
  m_oracle.setJoints(step.joints);
  m_oracle.findContacts(step.timeStep);
  if (step.cache) compareContacts();

  // The solver's half starts from stock's own prediction, with our contacts.
  const std::vector<BodyState> predicted = m_oracle.states();
  m_oracle.replaceContacts(*m_contacts, m_ofPairs);
  m_oracle.solve(step.timeStep);
  compareSolver();
  const std::vector<BodyState> solved = m_oracle.states();
  if (step.converged || m_steps % ordersEvery(step.before.size()) == 0) {
    compareOrders(predicted);
    m_oracle.restore(solved);
  }
  ++m_steps;
  m_oracle.finish(step.timeStep);
  compareEnd();
}

// Pairs that neither world looked at: both bodies asleep before the step.
bool OneStepCheck::awake(const Manifold& m) const {
  const auto active = [](int state) { return state != ISLAND_SLEEPING && state != DISABLE_SIMULATION; };
  return active(m_step->before[m.bodyA].activation) || active(m_step->before[m.bodyB].activation);
}

namespace {

double depthOf(const Manifold& m) {
  return m.pointCount > 0 ? -double(m.points[deepestPoint(m)].localPointA.w) : -1e300;
}
double depthOf(const btPersistentManifold* m) {
  return m && m->getNumContacts() > 0 ? -double(deepestPoint(*m).getDistance()) : -1e300;
}

// Of two bodies' shapes. Shapes of nested compounds may share a number: then the deepest contacts are compared.
struct PairContacts {
  const Manifold* ours = nullptr;
  const btPersistentManifold* stock = nullptr;
};

// In the order of the bodies' slots, whichever of the two comes first in a manifold.
OracleWorld::ShapePair sorted(OracleWorld::ShapePair p) {
  auto [a, childA, b, childB] = p;
  return a < b ? p : OracleWorld::ShapePair{b, childB, a, childA};
}

}  // namespace

// Pairs that Bullet's own narrowphase collides in both worlds have nothing to compare.
void OneStepCheck::compareContacts() {
  const std::vector<Manifold>& ours = *m_contacts;
  const std::vector<BodyInfo>& infos = m_step->input.infos.values;
  std::set<SlotPair> ofHost;
  std::map<OracleWorld::ShapePair, PairContacts> pairs;
  for (size_t i = 0; i < m_ofPairs; ++i) {
    const Manifold& m = ours[i];
    if (m.bucket == BUCKET_HOST) ofHost.insert(pairOf(m.bodyA, m.bodyB));
    if (!awake(m) || m.bucket == BUCKET_HOST || !m_oracle.object(m.bodyA) || !m_oracle.object(m.bodyB)) continue;
    const ulong key = m_step->results.matchedKeys[i];
    const uint low = static_cast<uint>(key >> 32), high = static_cast<uint>(key);
    PairContacts& pair = pairs[sorted({ownerOf(infos, low), OracleWorld::shapeNumber(m_step->input, low),
                                       ownerOf(infos, high), OracleWorld::shapeNumber(m_step->input, high)})];
    if (!pair.ours || depthOf(m) > depthOf(*pair.ours)) pair.ours = &m;
  }
  btDispatcher& dispatcher = *m_oracle.getDispatcher();
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* m = dispatcher.getManifoldByIndexInternal(i);
    if (m->getNumContacts() == 0) continue;
    const OracleWorld::ShapePair shapes = sorted(m_oracle.shapesOf(*m));
    if (ofHost.count(pairOf(std::get<0>(shapes), std::get<2>(shapes))) > 0) continue;
    PairContacts& pair = pairs[shapes];
    if (depthOf(m) > depthOf(pair.stock)) pair.stock = m;
  }
  for (const auto& [shapes, pair] : pairs) {
    const auto [a, childA, b, childB] = shapes;
    if (!pair.stock && (!m_oracle.isFilled(shapes) || m_oracle.ignores(a, b))) continue;
    Manifold none{};
    none.bodyA = a;
    none.bodyB = b;
    if (pair.ours || awake(none)) comparePair(pair.ours ? *pair.ours : none, pair.stock, shapes);
  }
}

namespace {

bool sameDepth(const ContactPoint& ours, const btManifoldPoint& stock, double size) {
  return std::fabs(double(ours.localPointA.w) - double(stock.getDistance())) <= kSameDepth * size;
}

// Stock's convex algorithms add one point a step; the others keep the normals that they were found with, along which
// bodies that turned may seem deeper in each other than they are. True if stock's deepest is such a point and its
// newest one is our deepest.
bool isOlder(const btManifoldPoint& deepest, const ContactPoint& ours, const btPersistentManifold& stock, double size) {
  constexpr double kOtherNormal = 1e-5;  // points of one step share theirs
  for (int k = 0; k < stock.getNumContacts(); ++k) {
    const btManifoldPoint& p = stock.getContactPoint(k);
    if (sameDepth(ours, p, size) && double(toBullet(ours.normalWorldOnB).dot(p.m_normalWorldOnB)) >= kSameNormal &&
        double((p.m_normalWorldOnB - deepest.m_normalWorldOnB).length()) > kOtherNormal) {
      return true;
    }
  }
  return false;
}

double cosineOf(const ContactPoint& ours, const btManifoldPoint& stock) {
  return double(toBullet(ours.normalWorldOnB).dot(stock.m_normalWorldOnB));
}

bool same3(const float4& a, const float4& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

// True if a contact is one of the step before, with which stock began too: there another one took its place.
bool isKept(const std::vector<Manifold>& cache, const std::vector<BodyInfo>& infos, const Manifold& ours,
            const ContactPoint& point) {
  for (const Manifold& m : cache) {
    if (ownerOf(infos, m.bodyA) != ours.bodyA || ownerOf(infos, m.bodyB) != ours.bodyB) continue;
    for (int k = 0; k < m.pointCount; ++k) {
      if (same3(m.points[k].localPointA, point.localPointA) && same3(m.points[k].normalWorldOnB, point.normalWorldOnB))
        return true;
    }
  }
  return false;
}

// True if a contact is one of these.
bool isAmong(const std::vector<FoundContact>& list, const ContactPoint& ours, double size) {
  return std::any_of(list.begin(), list.end(), [&](const FoundContact& found) {
    return std::fabs(double(ours.localPointA.w) - found.distance) <= kSameDepth * size &&
           double(toBullet(ours.normalWorldOnB).dot(found.normal)) >= kSameNormal;
  });
}

bool isPolyhedral(const btConvexShape& shape) {
  return shape.isPolyhedral() && static_cast<const btPolyhedralConvexShape&>(shape).getConvexPolyhedron() != nullptr;
}

// Pairs whose contacts Bullet finds by GJK and EPA.
bool isFoundByGjk(const Manifold& m) { return m.bucket >= BUCKET_FIRST_CONVEX && m.bucket <= BUCKET_LAST_CONVEX; }

}  // namespace

// Stock's GJK and EPA end early, above all where a shape is curved or an edge lies almost on a face. A contact of ours
// is right, whatever stock's is, if the two shapes are as far apart along its normal as it says, and along stock's no
// farther: shapes are at least as far apart as along any axis.
OneStepCheck::Verdict OneStepCheck::compareGaps(const ShapePair& shapes, const Manifold& m, const ContactPoint& ours,
                                                const btManifoldPoint& stock, double size) const {
  const double same = kSameDepth * size;
  for (const PlacedShape& a : placed(shapes, m.bodyA)) {
    for (const PlacedShape& b : placed(shapes, m.bodyB)) {
      // btPolyhedralContactClipping leaves out the margins. It tells how deep a corner lies behind the face that it
      // clipped, as far as that may be from along the axis that it found, and calls that axis the normal.
      const bool bare = isPolyhedral(*a.shape) && isPolyhedral(*b.shape);
      const double margins = bare ? double(a.shape->getMargin()) + double(b.shape->getMargin()) : 0;
      const double gap = gapAlong(a, b, toBullet(ours.normalWorldOnB)) + margins;
      if (!(std::fabs(gap - double(ours.localPointA.w)) <= same)) continue;
      const double stockGap = gapAlong(a, b, stock.m_normalWorldOnB) + margins;
      return {stockGap <= gap + same, stockGap < gap};
    }
  }
  return {};
}

// The convex shapes of a body that its number in the pair may mean.
std::vector<PlacedShape> OneStepCheck::placed(const ShapePair& shapes, uint slot) const {
  const int child = slot == std::get<0>(shapes) ? std::get<1>(shapes) : std::get<3>(shapes);
  return placedShapes(*m_oracle.object(slot)->getCollisionShape(), m_step->before[slot].transform, child);
}

// Of a contact with a mesh: Bullet finds it too, with its simplex as coarse as it is or not, or has had it since the
// step before. Of two boxes: Bullet finds it too. Both find up to eight corners, keep four of them, and put these one
// by one into a manifold in which they and old points push each other out, whatever their depths are; the order of the
// four, and which four of five or more, is btgpu's own.
bool OneStepCheck::isFoundToo(const ShapePair& shapes, const Manifold& ours, const ContactPoint& mine,
                              double size) const {
  if (ours.bucket != BUCKET_MESH && ours.bucket != BUCKET_BOX_BOX) return false;
  if (ours.bucket == BUCKET_MESH && isKept(*m_step->cache, m_step->input.infos.values, ours, mine)) return true;
  const btCollisionObject &a = *m_oracle.object(ours.bodyA), &b = *m_oracle.object(ours.bodyB);
  if (isAmong(contactsFound(m_oracle, a, b), mine, size)) return true;
  if (ours.bucket != BUCKET_MESH || !b.getCollisionShape()->isConcave()) return false;
  const auto& mesh = static_cast<const btConcaveShape&>(*b.getCollisionShape());
  for (const PlacedShape& shape : placed(shapes, ours.bodyA)) {
    if (isAmong(contactsFoundFinely(shape, mesh, b.getWorldTransform()), mine, size)) return true;
  }
  return false;
}

OneStepCheck::Verdict OneStepCheck::judge(const Manifold& ours, const btPersistentManifold& stock,
                                          const ShapePair& shapes, double size) const {
  const ContactPoint& mine = ours.points[deepestPoint(ours)];
  const btManifoldPoint& theirs = deepestPoint(stock);
  Verdict verdict = judgePoint(ours, mine, theirs, shapes, size);
  if (isOlder(theirs, mine, stock, size)) verdict.depth = true;
  if (verdict.depth && verdict.normal) return verdict;
  // What was found anew is compared where stock has not got the old points, and where new points a hair apart take the
  // place of old ones or do not.
  const std::vector<BodyInfo>& infos = m_step->input.infos.values;
  const bool filled = m_oracle.isFilled(shapes);
  if ((filled && !isFoundByGjk(ours)) || !isKept(*m_step->cache, infos, ours, mine)) return verdict;
  const ContactPoint* newest = nullptr;
  for (int k = 0; k < ours.pointCount; ++k) {
    const ContactPoint& p = ours.points[k];
    if (isKept(*m_step->cache, infos, ours, p)) continue;
    if (!newest || p.localPointA.w < newest->localPointA.w) newest = &p;
  }
  if (!newest) return filled ? verdict : Verdict{true, true};
  const Verdict ofNew = judgePoint(ours, *newest, theirs, shapes, size);
  return {verdict.depth || ofNew.depth, verdict.normal || ofNew.normal};
}

// One contact of ours next to stock's deepest.
OneStepCheck::Verdict OneStepCheck::judgePoint(const Manifold& m, const ContactPoint& ours,
                                               const btManifoldPoint& stock, const ShapePair& shapes,
                                               double size) const {
  Verdict verdict{sameDepth(ours, stock, size), cosineOf(ours, stock) >= kSameNormal};
  if (verdict.depth && verdict.normal) return verdict;
  if (isFoundToo(shapes, m, ours, size)) return {true, true};
  if (!isFoundByGjk(m)) return verdict;
  const Verdict byGaps = compareGaps(shapes, m, ours, stock, size);
  return {verdict.depth || byGaps.depth, verdict.normal || byGaps.normal};
}

void OneStepCheck::comparePair(const Manifold& ours, const btPersistentManifold* stock, const ShapePair& shapes) {
  const uint a = ours.bodyA, b = ours.bodyB;
  const double size = std::min(m_sizes[a], m_sizes[b]);
  if (ours.pointCount == 0 && !stock) return;
  if (ours.pointCount == 0 || !stock) {
    const double depth =
        stock ? -double(deepestPoint(*stock).getDistance()) : -double(ours.points[deepestPoint(ours)].localPointA.w);
    m_missing.add(depth / size, depth > kTouching * size, a, b);
    m_depth.add(0, false, a, b);
    m_normal.add(0, false, a, b);
    return;
  }
  m_missing.add(0, false, a, b);
  const ContactPoint& mine = ours.points[deepestPoint(ours)];
  const btManifoldPoint& theirs = deepestPoint(*stock);
  const double cosine = cosineOf(mine, theirs);
  const Verdict verdict = judge(ours, *stock, shapes, size);
  const double depthDifference = std::fabs(double(mine.localPointA.w) - double(theirs.getDistance())) / size;
  m_depth.add(verdict.depth ? std::min(depthDifference, kSameDepth) : depthDifference, !verdict.depth, a, b);
  m_normal.add(std::acos(std::max(-1.0, std::min(1.0, cosine))) * 180 / M_PI, !verdict.normal, a, b);
}

// Our contacts with the impulses that stock's solver left in the dispatcher.
std::vector<Manifold> OneStepCheck::readSolved() {
  std::vector<Manifold> solved = *m_contacts;
  for (size_t i = 0; i < solved.size(); ++i) {
    Manifold& m = solved[i];
    const btPersistentManifold* from = m.pointCount > 0 ? m_oracle.replaced(i) : nullptr;
    if (!from || from->getNumContacts() != m.pointCount) continue;
    for (int k = 0; k < m.pointCount; ++k) m.points[k] = readContactPoint(from->getContactPoint(k));
  }
  return solved;
}

void OneStepCheck::compareSolver() {
  const std::vector<Velocity> stock = m_oracle.velocities();
  compareVelocities(stock);
  compareJoints(stock);
  compareEnergy(stock);
  m_ourLast = residualOf(m_step->results.manifolds, m_ours);
  m_stockLast = stockResidualOf(stock);
  m_ourResidual.add(m_ourLast);
  m_stockResidual.add(m_stockLast);
  m_residualSpread.add(m_ourLast.sumOfSquares, m_stockLast.sumOfSquares);
}

void OneStepCheck::compareVelocities(const std::vector<Velocity>& stock) {
  // Manifolds of each body that have points, and whether one of them, or a joint, is shared with another body that
  // moves.
  std::vector<int> manifolds(stock.size(), 0);
  std::vector<bool> coupled = m_jointed;
  for (const Manifold& m : *m_contacts) {
    if (m.pointCount == 0) continue;
    ++manifolds[m.bodyA];
    ++manifolds[m.bodyB];
    if (isPushed(m_oracle.object(m.bodyA)) && isPushed(m_oracle.object(m.bodyB))) {
      coupled[m.bodyA] = coupled[m.bodyB] = true;
    }
  }
  for (size_t i = 0; i < stock.size(); ++i) {
    const btCollisionObject* o = m_oracle.object(i);
    const BodyEnd& end = m_step->after[i];
    // Bodies that fell asleep lose their velocity after the solver: the comparison at the end sees them.
    if (!isDynamic(o) || !end.known || end.activation == ISLAND_SLEEPING || !o->isActive()) continue;
    const uint slot = static_cast<uint>(i);
    const double d = difference(m_ours[i], stock[i]);
    const bool free = manifolds[i] == 0 && !m_jointed[i], single = manifolds[i] == 1 && !coupled[i];
    if (free) m_free.add(d, d > tolerance("solver.free_velocity").limit, slot);
    if (single) m_single.add(d, d > kSameVelocity, slot);
    m_worstBody.worst.offer(d, slot);
    if (m_worstBody.worst.a == slot) m_worstBody.kind = free ? "free" : single ? "single" : "coupled";
  }
}

void OneStepCheck::compareJoints(const std::vector<Velocity>& stock) {
  const WorldInput& input = m_step->input;
  for (size_t i = 0; i < input.joints.size(); ++i) {
    if (!m_step->results.jointSolved[i]) continue;
    const double ours = measureJointResidual(input.joints[i], input.jointRows, m_ours).rms();
    const double theirs = measureJointResidual(input.joints[i], input.jointRows, stock).rms();
    m_worstJoint.worst.offer(ours - theirs, static_cast<uint>(i));
    if (m_worstJoint.worst.a != i) continue;
    m_worstJoint.ours = ours;
    m_worstJoint.stock = theirs;
  }
}

// The solver may remove energy, how much depends on the order of the rows; what counts is what it adds to what
// went in, forces of the step included, where stock's does not.
void OneStepCheck::compareEnergy(const std::vector<Velocity>& stock) {
  std::vector<Velocity> entering = m_before;
  for (size_t i = 0; i < entering.size(); ++i) {
    const btRigidBody* body = m_oracle.body(i);
    if (isDynamic(body)) entering[i].linear += body->getTotalForce() * body->getInvMass() * m_step->timeStep;
  }
  m_lastEntering = kineticEnergy(m_oracle, entering);
  m_lastAllowed = std::max(m_lastEntering, kineticEnergy(m_oracle, stock));
  m_addedEnergy += std::max(0.0, kineticEnergy(m_oracle, m_ours) - m_lastAllowed);
  m_enteringEnergy += m_lastEntering;
}

Residual OneStepCheck::stockResidualOf(const std::vector<Velocity>& stock) { return residualOf(readSolved(), stock); }

Residual OneStepCheck::residualOf(const std::vector<Manifold>& solved, const std::vector<Velocity>& velocities) {
  Residual residual =
      measureResidual(m_oracle, *m_contacts, solved, m_step->before, m_before, velocities, m_step->timeStep);
  residual.add(
      measureJointResidual(m_step->input.joints, m_step->input.jointRows, m_step->results.jointSolved, velocities));
  return residual;
}

// Stock once more on the same contacts, in both orders, and if wanted run to convergence.
void OneStepCheck::compareOrders(const std::vector<BodyState>& predicted) {
  const auto solveAgain = [&](bool reversed, int iterations) {
    m_oracle.restore(predicted);
    m_oracle.setJoints(m_step->joints);
    m_oracle.replaceContacts(*m_contacts, m_ofPairs);
    const auto reverse = [&] {
      m_oracle.reverseContacts();
      m_oracle.reverseJoints();
    };
    if (reversed) reverse();
    m_oracle.solve(m_step->timeStep, iterations);
    if (reversed) reverse();
    return m_oracle.velocities();
  };
  const std::vector<Velocity> forward = solveAgain(false, -1);
  m_forwardResidual.add(stockResidualOf(forward));
  const std::vector<Velocity> reversed = solveAgain(true, -1);
  m_reversedResidual.add(stockResidualOf(reversed));
  m_sampledAdded += std::max(0.0, kineticEnergy(m_oracle, reversed) - m_lastAllowed);
  m_sampledEntering += m_lastEntering;
  if (!m_step->converged) return;
  const std::vector<Velocity> exact = solveAgain(false, kConvergedIterations);
  // A body that does what it does in stock, within rounding, is as far from there as stock's.
  std::vector<Velocity> ours = m_ours;
  for (size_t i = 0; i < ours.size(); ++i) {
    if (difference(ours[i], forward[i]) <= kSameVelocity) ours[i] = forward[i];
  }
  const double ourDistance = velocityDistance(m_oracle, ours, exact);
  const double stockDistance = velocityDistance(m_oracle, forward, exact);
  m_ourDistance += ourDistance;
  m_stockDistance += stockDistance;
  m_distanceSpread.add(ourDistance, stockDistance);
  m_reversedDistance += velocityDistance(m_oracle, reversed, exact);
}

// Whether the body's timer goes on, as btRigidBody::updateDeactivation has it.
static bool isSlow(const btRigidBody& body, const btVector3& linear, const btVector3& angular) {
  const btScalar most = body.getLinearSleepingThreshold(), mostAngular = body.getAngularSleepingThreshold();
  return linear.length2() < most * most && angular.length2() < mostAngular * mostAngular;
}

void OneStepCheck::compareEnd() {
  std::vector<bool> touched = m_jointed;
  for (const Manifold& m : *m_contacts) {
    if (m.pointCount > 0) touched[m.bodyA] = touched[m.bodyB] = true;
  }
  for (size_t i = 0; i < m_oracle.slotCount(); ++i) {
    const btCollisionObject* stock = m_oracle.object(i);
    const BodyEnd& ours = m_step->after[i];
    if (!isDynamic(stock)) continue;
    const uint slot = static_cast<uint>(i);
    const bool lost = ours.lost && isFinite(*btRigidBody::upcast(stock));
    m_lost.add(lost ? 1 : 0, lost, slot);
    if (!ours.known) continue;
    if (m_step->sleepKnown) {
      // Two velocities between which the threshold lies are the solver's, whose checks look at them.
      const btRigidBody& body = *btRigidBody::upcast(stock);
      const bool sameSide = isSlow(body, m_ours[i].linear, m_ours[i].angular) ==
                            isSlow(body, body.getLinearVelocity(), body.getAngularVelocity());
      const bool other = sameSide && ours.activation != stock->getActivationState();
      m_sleep.add(other ? 1 : 0, other, slot);
    }
    if (touched[i]) continue;
    const btTransform &a = ours.transform, &b = stock->getWorldTransform();
    const double scale = m_sizes[i] + double(b.getOrigin().length());
    double d = double((a.getOrigin() - b.getOrigin()).length()) / scale;
    for (int row = 0; row < 3; ++row) d = std::max(d, double((a.getBasis()[row] - b.getBasis()[row]).length()));
    m_pose.add(d, d > tolerance("integrate.pose").limit, slot);
  }
}

namespace {

// A check whose limit grows with what the order of the rows makes of stock's own result.
Check ofOrder(const char* name, double value, double reversed) {
  Check check = makeCheck(name, value);
  if (std::isfinite(reversed)) check.limit *= std::max({1.0, reversed, reversed > 0 ? 1 / reversed : 1.0});
  return check;
}

}  // namespace

Check OneStepCheck::ofShare(const char* name, const Measure& m) const {
  Check check = makeCheck(name, m.share());
  if (&m == &m_depth) check.limit = m_depthLimit;
  if (m_limits == Limits::WithChance) check.limit += m.chance(check.limit);
  return check;
}

std::vector<StepCheck> OneStepCheck::stepChecks() const {
  const auto share = [this](const char* name, const Measure& m) {
    const Check run = ofShare(name, m);
    return StepCheck{name, run.value, run.limit, m.stepOutliers() > 0 && !run.pass(), m.worst()};
  };
  const auto largest = [](const char* name, const Measure& m) {
    return StepCheck{name, m.worst().difference, tolerance(name).limit, m.stepOutliers() > 0, m.worst()};
  };
  return {share("contact.missing_pairs", m_missing), share("contact.depth", m_depth),
          share("contact.normal", m_normal),         largest("solver.free_velocity", m_free),
          share("solver.single_velocity", m_single), largest("integrate.pose", m_pose),
          largest("integrate.not_finite", m_lost),   share("sleep.state", m_sleep)};
}

// Single steps, those in which most collides, may have most of the residual of a short run, and in each of them the
// order of the rows counts for either side: what the ratio of the squares may be off by is seen in how it varies from
// step to step.
Check OneStepCheck::ofResidual() const {
  Check check = ofOrder("solver.residual", ratio(m_ourResidual.rms(), m_stockResidual.rms()),
                        ratio(m_reversedResidual.rms(), m_forwardResidual.rms()));
  if (m_limits == Limits::WithChance) {
    check.limit = std::sqrt(check.limit * check.limit + 3 * m_residualSpread.standardError());
  }
  return check;
}

// What is pushed apart by something that the solver can't move gets another speed in each order of the rows.
Check OneStepCheck::ofEnergy() const {
  const auto share = [](double added, double entering) { return entering > 0 ? added / entering : 0; };
  Check check = makeCheck("solver.energy", share(m_addedEnergy, m_enteringEnergy));
  check.limit += share(m_sampledAdded, m_sampledEntering);
  return check;
}

std::vector<Check> OneStepCheck::checks() const {
  std::vector<Check> checks = {
      ofShare("contact.missing_pairs", m_missing),
      ofShare("contact.depth", m_depth),
      ofShare("contact.normal", m_normal),
      makeCheck("solver.free_velocity", m_free.largest()),
      ofShare("solver.single_velocity", m_single),
      ofResidual(),
      ofEnergy(),
      makeCheck("integrate.pose", m_pose.largest()),
      makeCheck("integrate.not_finite", m_lost.largest()),
      ofShare("sleep.state", m_sleep),
  };
  if (m_stockDistance > 0) {
    Check distance = ofOrder("solver.distance_to_converged", ratio(m_ourDistance, m_stockDistance),
                             ratio(m_reversedDistance, m_stockDistance));
    if (m_limits == Limits::WithChance) distance.limit += 3 * m_distanceSpread.standardError();
    checks.push_back(distance);
  }
  return checks;
}

BTGPU_TRANSLATION_END
