// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "tests/compat/api/api_case.h"

#include <cmath>

namespace btgpu::test::api {
namespace {

// What rounding may make of a number of size 10 after so many steps. In a step of a few bodies both solvers do the same
// in the same order: a row's update rounds some 8 times, by half a unit; there are at most 12 rows and 10 iterations.
// Gauss-Seidel contracts, so errors add up at most, and as roundings go either way, like a random walk. What the steps
// before were off goes on: a position by its velocity, a velocity by its lever.
double noise(int steps, double size) {
  const double oneStep = std::sqrt(8.0 * 120) * 0.5 * double(FLT_EPSILON) * std::max(size, 10.0);
  return steps * oneStep * (1 + steps / 60.0);
}

struct Outcome {
  std::vector<Entry> log;
  btGpuStatistics statistics;
  std::vector<btGpuFallback> report;
};

template <typename World>
Outcome runOn(void (*script)(Lab&)) {
  std::vector<std::shared_ptr<void>> kept;
  WorldOf<World> parts;
  Outcome outcome;
  Lab lab(parts, std::is_same_v<World, btDiscreteDynamicsWorld>);
  script(lab);
  lab.logBodies("at the end");
  outcome.log = lab.log.entries();
  if constexpr (std::is_same_v<World, btGpuDynamicsWorld>) {
    outcome.statistics = parts.world.statistics();
    outcome.report = parts.world.fallbackReport();
  }
  kept = std::move(lab.kept);
  return outcome;
}

std::string textOf(const Entry& e) {
  std::string text = e.what + ": " + e.text;
  for (const double n : e.numbers) text += " " + std::to_string(n);
  return text;
}

bool agree(const Entry& gpu, const Entry& stock, bool stockPath) {
  if (gpu.what != stock.what || gpu.text != stock.text || gpu.numbers.size() != stock.numbers.size()) return false;
  for (size_t i = 0; i < gpu.numbers.size(); ++i) {
    const double a = gpu.numbers[i], b = stock.numbers[i];
    if (a == b || (std::isnan(a) && std::isnan(b))) continue;
    const double tolerance = gpu.exact || stockPath ? 0 : gpu.scale * noise(gpu.steps, std::abs(b) / gpu.scale);
    if (!(std::abs(a - b) <= tolerance)) return false;
  }
  return true;
}

void expectPlace(const Outcome& gpu, const Place& place) {
  std::string report;
  for (const auto& f : gpu.report) report += f.m_what + ": " + f.m_reason + (f.m_wholeStep ? " (whole step)\n" : "\n");
  const bool stepped = place.kind != Place::kNoStep;
  EXPECT_EQ(gpu.statistics.m_deviceSteps > 0, place.kind == Place::kDevice) << report;
  EXPECT_EQ(gpu.statistics.m_stockSteps > 0, place.kind == Place::kStock) << report;
  std::vector<std::string> named;
  for (const auto& f : gpu.report) {
    named.push_back(f.m_what);
    EXPECT_EQ(f.m_wholeStep, place.kind == Place::kStock) << f.m_what;
  }
  std::vector<std::string> expected = place.named;
  std::sort(named.begin(), named.end());
  std::sort(expected.begin(), expected.end());
  if (stepped) { EXPECT_EQ(named, expected) << report; }
}

}  // namespace

void runOnBoth(void (*script)(Lab&), const Place& place) {
  const Outcome stock = runOn<btDiscreteDynamicsWorld>(script);
  const Outcome gpu = runOn<btGpuDynamicsWorld>(script);
  const size_t count = std::min(stock.log.size(), gpu.log.size());
  int shown = 0;
  for (size_t i = 0; i < count && shown < 8; ++i) {
    if (agree(gpu.log[i], stock.log[i], place.kind == Place::kStock)) continue;
    ADD_FAILURE() << "entry " << i << "\n  btgpu " << textOf(gpu.log[i]) << "\n  stock " << textOf(stock.log[i]);
    ++shown;
  }
  EXPECT_EQ(gpu.log.size(), stock.log.size()) << "entries in the log";
  expectPlace(gpu, place);
}

void Lab::logBodies(const std::string& when) {
  const btCollisionObjectArray& all = world.getCollisionObjectArray();
  for (int i = 0; i < all.size(); ++i) {
    const std::string name = when + ", object " + std::to_string(i);
    log.near(name + ": transform", all[i]->getWorldTransform(), scale);
    log.exact(name + ": activation", all[i]->getActivationState());
    log.exact(name + ": flags", all[i]->getCollisionFlags());
    const btRigidBody* body = btRigidBody::upcast(all[i]);
    if (!body) continue;
    log.near(name + ": linear velocity", body->getLinearVelocity(), scale);
    log.near(name + ": angular velocity", body->getAngularVelocity(), scale);
    log.near(name + ": interpolation", body->getInterpolationWorldTransform(), scale);
    log.near(name + ": deactivation time", body->getDeactivationTime(), scale);
    log.near(name + ": force", body->getTotalForce(), scale);
    log.near(name + ": torque", body->getTotalTorque(), scale);
  }
}

// Stock makes a manifold where two AABBs overlap, btgpu where two bodies touch.
void Lab::logContacts(const std::string& when, bool lifetimes, bool byPair) {
  std::vector<const btPersistentManifold*> touching;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* m = dispatcher.getManifoldByIndexInternal(i);
    if (m->getNumContacts() > 0) touching.push_back(m);
  }
  if (byPair) {
    std::sort(touching.begin(), touching.end(), [this](const auto* a, const auto* b) {
      return std::pair(number(a->getBody0()), number(a->getBody1())) <
             std::pair(number(b->getBody0()), number(b->getBody1()));
    });
  }
  for (size_t i = 0; i < touching.size(); ++i) {
    const btPersistentManifold& m = *touching[i];
    const std::string name = when + ", manifold " + std::to_string(i);
    log.exact(name + ": A", number(m.getBody0()));
    log.exact(name + ": B", number(m.getBody1()));
    log.exact(name + ": contacts", m.getNumContacts());
    for (int k = 0; k < m.getNumContacts(); ++k) {
      const btManifoldPoint& p = m.getContactPoint(k);
      const std::string point = name + ", point " + std::to_string(k);
      log.near(point + ": on B", p.getPositionWorldOnB());
      log.near(point + ": normal", p.m_normalWorldOnB);
      log.near(point + ": distance", p.getDistance());
      log.near(point + ": impulse", p.getAppliedImpulse());
      if (lifetimes) log.exact(point + ": life", p.getLifeTime());
    }
  }
}

void Lab::start() {
  m_start.clear();
  for (btRigidBody* body : objects.bodies()) {
    m_start[body] = {body->getWorldTransform(), body->getLinearVelocity(), body->getAngularVelocity()};
  }
}

void Lab::restore() {
  for (btRigidBody* body : objects.bodies()) {
    const Unit& unit = m_start.at(body);
    const btVector3 gravity = body->getGravity();
    const bool jointed = body->getNumConstraintRefs() > 0 || world.getNumConstraints() > 0;
    if (!jointed) world.removeRigidBody(body);  // and its contacts
    body->clearForces();
    body->setCenterOfMassTransform(unit.at);
    body->setInterpolationWorldTransform(unit.at);
    body->setLinearVelocity(unit.linear);
    body->setAngularVelocity(unit.angular);
    body->setInterpolationLinearVelocity(unit.linear);
    body->setInterpolationAngularVelocity(unit.angular);
    if (!jointed) world.addRigidBody(body);
    body->setGravity(gravity);
  }
}

std::vector<double> Lab::outcome() const {
  std::vector<double> numbers;
  for (const btRigidBody* body : objects.bodies()) {
    for (int k = 0; k < 3; ++k) {
      numbers.push_back(double(body->getWorldTransform().getOrigin()[k]));
      numbers.push_back(double(body->getLinearVelocity()[k]));
      numbers.push_back(double(body->getAngularVelocity()[k]));
      numbers.push_back(double(body->getWorldTransform().getBasis()[k][(k + 1) % 3]));
    }
  }
  return numbers;
}

bool Lab::runProbe(const std::string& what, int steps) {
  restore();
  const int before = log.steps;
  log.steps = 0;  // as from the start
  step(steps);
  logBodies(what);
  log.steps = before + steps;
  const std::vector<double> now = outcome();
  const bool other = now != m_lastOutcome;
  m_lastOutcome = now;
  restore();
  return other;
}
void Lab::probe(const std::string& what, int steps) {
  if (!runProbe(what, steps) && m_isStock) ADD_FAILURE() << what << " has no effect here";
}
void Lab::probeSame(const std::string& what, int steps) {
  if (runProbe(what, steps) && m_isStock) ADD_FAILURE() << what << " changes what bodies do";
}
bool Lab::probeAny(const std::string& what, int steps) { return runProbe(what, steps); }

void Lab::expectEachDiffers(const std::vector<btRigidBody*>& bodies, const std::vector<std::string>& names) {
  if (!m_isStock) return;
  const btRigidBody& first = *bodies[0];
  for (size_t i = 1; i < bodies.size(); ++i) {
    const btRigidBody& body = *bodies[i];
    const double apart =
        distance(body.getLinearVelocity(), first.getLinearVelocity()) +
        distance(body.getAngularVelocity(), first.getAngularVelocity()) +
        std::abs(double(body.getWorldTransform().getOrigin().y() - first.getWorldTransform().getOrigin().y()));
    EXPECT_GT(apart, 1e-4) << names[i] << " has no effect here";
  }
}

}  // namespace btgpu::test::api
