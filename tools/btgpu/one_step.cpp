// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "one_step.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "kernels/shared/shape.h"
#include "translation/contacts.h"
#include "translation/convert.h"

namespace btgpu::tool {
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

// Solving once more is cheap in small worlds only.
int ordersEvery(size_t bodies) { return bodies < 1000 ? 4 : 25; }

void add(Residual& to, const Residual& r) {
  to.sumOfSquares += r.sumOfSquares;
  to.rows += r.rows;
}

// As the device left them: actions have not added to them yet.
std::vector<Velocity> velocitiesOf(const StepResults& results) {
  std::vector<Velocity> velocities;
  for (const BodyVelocity& v : results.velocities) velocities.push_back({toBullet(v.linear), toBullet(v.angular)});
  return velocities;
}

std::vector<bool> jointedBodies(const btDynamicsWorld& world) {
  std::vector<bool> jointed(static_cast<size_t>(world.getNumCollisionObjects()), false);
  for (int i = 0; i < world.getNumConstraints(); ++i) {
    const btTypedConstraint& joint = *world.getConstraint(i);
    for (const btRigidBody* body : {&joint.getRigidBodyA(), &joint.getRigidBodyB()}) {
      if (body->getWorldArrayIndex() >= 0) jointed[static_cast<size_t>(body->getWorldArrayIndex())] = true;
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

double share(long part, long whole) { return whole ? double(part) / double(whole) : 0; }

std::pair<int, int> pairOf(const Manifold& m) {
  return {static_cast<int>(std::min(m.bodyA, m.bodyB)), static_cast<int>(std::max(m.bodyA, m.bodyB))};
}

bool isDynamic(const btCollisionObject& o) { return btRigidBody::upcast(&o) && !o.isStaticOrKinematicObject(); }

}  // namespace

OneStepComparison::OneStepComparison(const Builder& build, const scenes::Expectations& expectations, btScalar timeStep)
    : m_oracle(std::make_unique<TestWorld<OracleWorld>>(build)),
      m_otherDepthsAllowed(expectations.otherDepths),
      m_timeStep(timeStep) {
  // Pairs that don't overlap any more go at once, not a percentage of them a step.
  m_oracle->broadphase().m_cupdates = 100;
  const btCollisionObjectArray& objects = m_oracle->world().getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    m_sizes.push_back(relativeSize(double(objects[i]->getCollisionShape()->getAngularMotionDisc())));
  }
}

OneStepComparison::~OneStepComparison() = default;

void OneStepComparison::beforeStep(const btDynamicsWorld& gpuWorld) {
  m_before = captureStates(gpuWorld);
  m_jointsBefore = captureJoints(gpuWorld);
}

void OneStepComparison::afterStep(const btDynamicsWorld& gpuWorld, const WorldInput& input, const StepResults& results,
                                  bool converged) {
  OracleWorld& oracle = m_oracle->world();
  m_input = &input;
  m_solvedJoints = results.jointSolved;
  m_jointed = jointedBodies(oracle);
  oracle.setState(m_before, m_cache);
  oracle.setJoints(m_jointsBefore);
  oracle.findContacts(m_timeStep);
  m_ofPairs = results.counters.pairCount;
  compareContacts(results.matchedManifolds);

  // The solver's half starts from stock's own prediction, with our contacts.
  const std::vector<BodyState> predicted = captureStates(oracle);
  oracle.replaceContacts(results.matchedManifolds, m_ofPairs);
  oracle.solve(m_timeStep);
  m_gpuVelocities = velocitiesOf(results);
  compareSolver(gpuWorld, results);
  const std::vector<BodyState> solved = captureStates(oracle);
  if (converged || m_step % ordersEvery(m_before.size()) == 0) {
    compareOrders(predicted, results, converged);
    oracle.restore(solved);
  }
  ++m_step;
  oracle.finish(m_timeStep);
  compareEnd(gpuWorld, results.matchedManifolds);
  m_cache.assign(results.manifolds.begin(), results.manifolds.begin() + static_cast<long>(m_ofPairs));
}

// Pairs that neither world looked at: both bodies asleep before the step.
bool OneStepComparison::awake(const Manifold& m) const {
  const auto active = [](int state) { return state != ISLAND_SLEEPING && state != DISABLE_SIMULATION; };
  return active(m_before[m.bodyA].activation) || active(m_before[m.bodyB].activation);
}

// Pairs that Bullet's own narrowphase collides in both worlds have nothing to compare.
void OneStepComparison::compareContacts(const std::vector<Manifold>& ours) {
  std::set<std::pair<int, int>> ofHost;
  for (size_t i = 0; i < m_ofPairs; ++i) {
    if (ours[i].bucket == BUCKET_HOST) ofHost.insert(pairOf(ours[i]));
  }
  OracleWorld& oracle = m_oracle->world();
  btDispatcher& dispatcher = *oracle.getDispatcher();
  // Stock's manifolds by pair; what is left at the end has no partner among ours.
  std::vector<std::pair<std::pair<int, int>, const btPersistentManifold*>> stock;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* m = dispatcher.getManifoldByIndexInternal(i);
    const int a = m->getBody0()->getWorldArrayIndex(), b = m->getBody1()->getWorldArrayIndex();
    const std::pair<int, int> key(std::min(a, b), std::max(a, b));
    if (m->getNumContacts() > 0 && ofHost.count(key) == 0) stock.push_back({key, m});
  }
  std::sort(stock.begin(), stock.end());
  std::vector<bool> met(stock.size(), false);
  for (size_t i = 0; i < m_ofPairs; ++i) {
    const Manifold& m = ours[i];
    if (!awake(m) || m.bucket == BUCKET_HOST) continue;
    const std::pair<int, int> key = pairOf(m);
    const auto it = std::lower_bound(stock.begin(), stock.end(),
                                     std::make_pair(key, static_cast<const btPersistentManifold*>(nullptr)));
    const bool found = it != stock.end() && it->first == key;
    if (found) met[static_cast<size_t>(it - stock.begin())] = true;
    comparePair(m, found ? it->second : nullptr);
  }
  for (size_t i = 0; i < stock.size(); ++i) {
    if (met[i]) continue;
    Manifold none{};
    none.bodyA = static_cast<uint>(stock[i].first.first);
    none.bodyB = static_cast<uint>(stock[i].first.second);
    if (awake(none)) comparePair(none, stock[i].second);
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

}  // namespace

void OneStepComparison::comparePair(const Manifold& ours, const btPersistentManifold* stock) {
  const double size = std::min(m_sizes[ours.bodyA], m_sizes[ours.bodyB]);
  const bool stockHas = stock != nullptr;
  if (ours.pointCount == 0 && !stockHas) return;
  ++m_pairs;
  if (ours.pointCount == 0 || !stockHas) {
    const double depth =
        stockHas ? -double(deepestPoint(*stock).getDistance()) : -double(ours.points[deepestPoint(ours)].localPointA.w);
    if (depth > kTouching * size) ++m_missingPairs;
    return;
  }
  const ContactPoint& mine = ours.points[deepestPoint(ours)];
  const btManifoldPoint& theirs = deepestPoint(*stock);
  if (!sameDepth(mine, theirs, size) && !isOlder(theirs, mine, *stock, size)) ++m_otherDepths;
  if (double(toBullet(mine.normalWorldOnB).dot(theirs.m_normalWorldOnB)) < kSameNormal) ++m_otherNormals;
}

// Our contacts with the impulses that stock's solver left in the dispatcher.
std::vector<Manifold> OneStepComparison::readSolved(const std::vector<Manifold>& contacts) {
  std::vector<Manifold> solved = contacts;
  for (size_t i = 0; i < solved.size(); ++i) {
    Manifold& m = solved[i];
    const btPersistentManifold* from = m.pointCount > 0 ? m_oracle->world().replaced(i) : nullptr;
    if (!from || from->getNumContacts() != m.pointCount) continue;
    for (int k = 0; k < m.pointCount; ++k) m.points[k] = readContactPoint(from->getContactPoint(k));
  }
  return solved;
}

void OneStepComparison::compareSolver(const btCollisionWorld& gpuWorld, const StepResults& results) {
  OracleWorld& oracle = m_oracle->world();
  const std::vector<Manifold>& contacts = results.matchedManifolds;
  const std::vector<Velocity> stock = oracle.velocities();
  const std::vector<Velocity>& gpu = m_gpuVelocities;
  const std::vector<Velocity> before = velocitiesOf(m_before);

  // Manifolds of each body that have points, and whether one of them, or a joint, is shared with another moving body.
  std::vector<int> manifolds(stock.size(), 0);
  std::vector<bool> coupled = m_jointed;
  const btCollisionObjectArray& objects = oracle.getCollisionObjectArray();
  for (const Manifold& m : contacts) {
    if (m.pointCount == 0) continue;
    ++manifolds[m.bodyA];
    ++manifolds[m.bodyB];
    if (isDynamic(*objects[static_cast<int>(m.bodyA)]) && isDynamic(*objects[static_cast<int>(m.bodyB)])) {
      coupled[m.bodyA] = coupled[m.bodyB] = true;
    }
  }
  for (size_t i = 0; i < stock.size(); ++i) {
    const btCollisionObject& o = *objects[static_cast<int>(i)];
    // Bodies that fell asleep lose their velocity after the solver: the comparison at the end sees them.
    const int state = gpuWorld.getCollisionObjectArray()[static_cast<int>(i)]->getActivationState();
    if (!isDynamic(o) || state == ISLAND_SLEEPING || !o.isActive()) continue;
    if (manifolds[i] == 0 && !m_jointed[i]) m_freeVelocity = std::max(m_freeVelocity, difference(gpu[i], stock[i]));
    if (manifolds[i] == 1 && !coupled[i]) {
      ++m_singles;
      if (difference(gpu[i], stock[i]) > kSameVelocity) ++m_otherSingles;
    }
  }

  m_ourLast = residualOf(contacts, results.manifolds, gpu);
  m_stockLast = stockResidual(contacts, stock);
  add(m_ourResidual, m_ourLast);
  add(m_stockResidual, m_stockLast);

  // The solver may remove energy, how much depends on the order of the rows; what counts is what it adds to what
  // went in, forces of the step included, where stock's does not.
  std::vector<Velocity> entering = before;
  for (size_t i = 0; i < entering.size(); ++i) {
    const btRigidBody* body = btRigidBody::upcast(objects[static_cast<int>(i)]);
    if (body && isDynamic(*body)) entering[i].linear += body->getTotalForce() * body->getInvMass() * m_timeStep;
  }
  const double energy = kineticEnergy(oracle, entering);
  const double allowed = std::max(energy, kineticEnergy(oracle, stock));
  m_addedEnergy += std::max(0.0, kineticEnergy(oracle, gpu) - allowed);
  m_enteringEnergy += energy;
}

Residual OneStepComparison::stockResidual(const std::vector<Manifold>& contacts, const std::vector<Velocity>& stock) {
  return residualOf(contacts, readSolved(contacts), stock);
}

Residual OneStepComparison::residualOf(const std::vector<Manifold>& contacts, const std::vector<Manifold>& solved,
                                       const std::vector<Velocity>& velocities) {
  Residual residual =
      measureResidual(m_oracle->world(), contacts, solved, m_before, velocitiesOf(m_before), velocities, m_timeStep);
  add(residual, measureJointResidual(m_input->joints, m_input->jointRows, m_solvedJoints, velocities));
  return residual;
}

// Stock once more on the same contacts, in both orders, and if wanted run to convergence.
void OneStepComparison::compareOrders(const std::vector<BodyState>& predicted, const StepResults& results,
                                      bool converged) {
  OracleWorld& oracle = m_oracle->world();
  const std::vector<Manifold>& contacts = results.matchedManifolds;
  const auto solveAgain = [&](bool reversed, int iterations) {
    oracle.restore(predicted);
    oracle.setJoints(m_jointsBefore);
    oracle.replaceContacts(contacts, m_ofPairs);
    const auto reverse = [&] {
      oracle.reverseContacts();
      oracle.reverseJoints();
    };
    if (reversed) reverse();
    oracle.solve(m_timeStep, iterations);
    if (reversed) reverse();
    return oracle.velocities();
  };
  const std::vector<Velocity> forward = solveAgain(false, -1);
  add(m_forwardResidual, stockResidual(contacts, forward));
  const std::vector<Velocity> reversed = solveAgain(true, -1);
  add(m_reversedResidual, stockResidual(contacts, reversed));
  if (!converged) return;
  const std::vector<Velocity> exact = solveAgain(false, kConvergedIterations);
  m_ourDistance += velocityDistance(oracle, m_gpuVelocities, exact);
  m_stockDistance += velocityDistance(oracle, forward, exact);
  m_reversedDistance += velocityDistance(oracle, reversed, exact);
}

void OneStepComparison::compareEnd(const btCollisionWorld& gpuWorld, const std::vector<Manifold>& contacts) {
  const btCollisionObjectArray& ours = gpuWorld.getCollisionObjectArray();
  const btCollisionObjectArray& stock = m_oracle->world().getCollisionObjectArray();
  std::vector<bool> touched = m_jointed;
  for (const Manifold& m : contacts) {
    if (m.pointCount > 0) touched[m.bodyA] = touched[m.bodyB] = true;
  }
  m_lastPose = 0;
  for (int i = 0; i < stock.size(); ++i) {
    if (!isDynamic(*stock[i])) continue;
    ++m_states;
    if (ours[i]->getActivationState() != stock[i]->getActivationState()) ++m_otherStates;
    if (touched[static_cast<size_t>(i)]) continue;
    const btTransform& a = ours[i]->getWorldTransform();
    const btTransform& b = stock[i]->getWorldTransform();
    const double scale = m_sizes[static_cast<size_t>(i)] + double(b.getOrigin().length());
    m_lastPose = std::max(m_lastPose, double((a.getOrigin() - b.getOrigin()).length()) / scale);
    for (int row = 0; row < 3; ++row) {
      m_lastPose = std::max(m_lastPose, double((a.getBasis()[row] - b.getBasis()[row]).length()));
    }
  }
  m_pose = std::max(m_pose, m_lastPose);
}

void OneStepComparison::addTo(Series& series) const {
  series.gpu.residual.push_back(m_ourLast.rms());
  series.stock.residual.push_back(m_stockLast.rms());
  series.pose.push_back(m_lastPose);
}

namespace {

// A check whose limit grows with what the order of the rows makes of stock's own result.
Check ofOrder(const char* name, double value, double reversed) {
  Check check = makeCheck(name, value);
  if (std::isfinite(reversed)) check.limit *= std::max({1.0, reversed, reversed > 0 ? 1 / reversed : 1.0});
  return check;
}

}  // namespace

std::vector<Check> OneStepComparison::checks() const {
  Check depth = makeCheck("contact.depth", share(m_otherDepths, m_pairs));
  depth.limit = std::max(depth.limit, m_otherDepthsAllowed);
  std::vector<Check> checks = {
      makeCheck("contact.missing_pairs", share(m_missingPairs, m_pairs)),
      depth,
      makeCheck("contact.normal", share(m_otherNormals, m_pairs)),
      makeCheck("solver.free_velocity", m_freeVelocity),
      makeCheck("solver.single_velocity", share(m_otherSingles, m_singles)),
      ofOrder("solver.residual", ratio(m_ourResidual.rms(), m_stockResidual.rms()),
              ratio(m_reversedResidual.rms(), m_forwardResidual.rms())),
      makeCheck("solver.energy", m_enteringEnergy > 0 ? m_addedEnergy / m_enteringEnergy : 0),
      makeCheck("integrate.pose", m_pose),
      makeCheck("sleep.state", share(m_otherStates, m_states)),
  };
  if (m_stockDistance > 0) {
    checks.push_back(ofOrder("solver.distance_to_converged", ratio(m_ourDistance, m_stockDistance),
                             ratio(m_reversedDistance, m_stockDistance)));
  }
  return checks;
}

}  // namespace btgpu::tool
