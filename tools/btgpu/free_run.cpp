// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "free_run.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace btgpu::tool {
namespace {

constexpr double kRestingEnergy = 1e-4;  // J a body: what a settled pile may have at any rate
constexpr double kRestingShare = 1e-2;
constexpr double kSmallDepth = 1e-3;  // of the size: penetrations below are as good as none

const btRigidBody* movingBody(const btCollisionWorld& world, int i) {
  const btCollisionObject* o = world.getCollisionObjectArray()[i];
  const btRigidBody* body = btRigidBody::upcast(o);
  return body && !o->isStaticOrKinematicObject() ? body : nullptr;
}

double bodyEnergy(const btRigidBody& body) {
  const btVector3 w = body.getAngularVelocity() * body.getWorldTransform().getBasis();
  return 0.5 * double(body.getLinearVelocity().length2() / body.getInvMass() + w.dot(w * body.getLocalInertia()));
}

bool isFinite(const btVector3& v) { return std::isfinite(double(v.x() + v.y() + v.z())); }

// Moves each body by about a millionth of its size, in no particular direction.
void perturb(btDiscreteDynamicsWorld& world, int seed) {
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    btCollisionObject* o = world.getCollisionObjectArray()[i];
    if (!movingBody(world, i)) continue;
    const btScalar size = o->getCollisionShape()->getAngularMotionDisc() * btScalar(1e-6);
    const btVector3 direction(btScalar((i * 7 + seed * 13) % 11 - 5), 0, btScalar((i * 3 + seed * 5) % 7 - 3));
    o->getWorldTransform().getOrigin() += direction * (size / 5);
  }
}

// One run of a large scene is expensive, and its means spread less.
int stockRuns(int bodies) { return bodies < 300 ? 6 : bodies < 1000 ? 3 : 2; }

struct Range {
  double lowest, highest;
  double width() const { return highest - lowest; }
};

template <typename Get>
Range rangeOf(const std::vector<RunStatistics>& runs, Get get) {
  Range range{get(runs.front()), get(runs.front())};
  for (const RunStatistics& run : runs) {
    range.lowest = std::min(range.lowest, get(run));
    range.highest = std::max(range.highest, get(run));
  }
  return range;
}

void addDepths(const std::vector<Manifold>& manifolds, std::vector<float>& depths) {
  for (const Manifold& m : manifolds) {
    for (int k = 0; k < m.pointCount; ++k) depths.push_back(std::max(0.0f, -m.points[k].localPointA.w));
  }
}

void addDepths(btDispatcher& dispatcher, std::vector<float>& depths) {
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* m = dispatcher.getManifoldByIndexInternal(i);
    for (int k = 0; k < m->getNumContacts(); ++k) {
      depths.push_back(std::max(0.0f, -static_cast<float>(m->getContactPoint(k).getDistance())));
    }
  }
}

double percentile99(std::vector<float> depths) {
  if (depths.empty()) return 0;
  const auto at = depths.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(depths.size() - 1));
  std::nth_element(depths.begin(), at, depths.end());
  return *at;
}

void addFigures(const WorldFigures& figures, const std::vector<float>& depths, WorldSeries& to) {
  to.kineticEnergy.push_back(figures.kineticEnergy);
  to.totalEnergy.push_back(figures.kineticEnergy + figures.potentialEnergy);
  to.meanHeight.push_back(figures.meanHeight);
  to.contacts.push_back(static_cast<double>(depths.size()));
  to.depth99.push_back(percentile99(depths));
  to.deepest.push_back(depths.empty() ? 0 : *std::max_element(depths.begin(), depths.end()));
}

}  // namespace

double RunStatistics::depth99() const { return percentile99(depths); }

WorldFigures measureWorld(const btDiscreteDynamicsWorld& world, double groundHeight) {
  WorldFigures f;
  btVector3 gravity = world.getGravity(), momentum(0, 0, 0);
  const btVector3 up = gravity.fuzzyZero() ? btVector3(0, 1, 0) : -gravity.normalized();
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    const btRigidBody* body = movingBody(world, i);
    if (!body) continue;
    ++f.moving;
    const btVector3& p = body->getWorldTransform().getOrigin();
    if (!isFinite(p) || !isFinite(body->getLinearVelocity()) || !isFinite(body->getAngularVelocity())) {
      ++f.notFinite;
      continue;
    }
    const double height = double(p.dot(up));
    f.meanHeight += height;
    f.kineticEnergy += bodyEnergy(*body);
    f.potentialEnergy += height * double(gravity.length() / body->getInvMass());
    const btVector3 bodyMomentum = body->getLinearVelocity() / body->getInvMass();
    momentum += bodyMomentum;
    f.momentumScale += double(bodyMomentum.length());
    if (!body->isActive()) ++f.sleeping;
    if (height < groundHeight) ++f.belowGround;
  }
  const int n = std::max(1, f.moving);
  f.meanHeight /= n;
  f.kineticEnergy /= n;
  f.potentialEnergy /= n;
  f.momentum = double(momentum.length());
  return f;
}

FreeRunComparison::FreeRunComparison(const Builder& build, const scenes::Expectations& expectations, int steps)
    : m_expectations(expectations), m_steps(steps) {
  m_stockWorlds.push_back(std::make_unique<StockWorld>(build));
  measureScene(m_stockWorlds.front()->world());
  const bool settles = expectations.comesToRest != scenes::Rest::No;
  const int runs = settles ? stockRuns(m_stockWorlds.front()->world().getNumCollisionObjects()) : 1;
  for (int run = 1; run < runs; ++run) {
    m_stockWorlds.push_back(std::make_unique<StockWorld>(build));
    perturb(m_stockWorlds.back()->world(), run);
  }
  m_stock.resize(m_stockWorlds.size());
}

FreeRunComparison::~FreeRunComparison() = default;

void FreeRunComparison::measureScene(const btDiscreteDynamicsWorld& world) {
  double size = 0, weight = 0;
  int moving = 0;
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    const btRigidBody* body = movingBody(world, i);
    if (!body) {
      m_fixedContacts = true;
      continue;
    }
    size += double(body->getCollisionShape()->getAngularMotionDisc());
    weight += double(world.getGravity().length() / body->getInvMass());
    ++moving;
  }
  if (moving == 0) return;
  m_size = size / moving;
  m_weight = weight / moving;
}

double FreeRunComparison::stepStock(btScalar timeStep) {
  const auto start = std::chrono::steady_clock::now();
  m_stockWorlds.front()->world().stepSimulation(timeStep, 0);
  const double time = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  for (size_t run = 1; run < m_stockWorlds.size(); ++run) m_stockWorlds[run]->world().stepSimulation(timeStep, 0);
  return time;
}

void FreeRunComparison::afterStep(int step, const btDiscreteDynamicsWorld& gpu, const StepResults& results) {
  if (step < m_expectations.comparableSteps) {
    const btDiscreteDynamicsWorld& stock = m_stockWorlds.front()->world();
    for (int i = 0; i < gpu.getNumCollisionObjects(); ++i) {
      const btVector3 difference = gpu.getCollisionObjectArray()[i]->getWorldTransform().getOrigin() -
                                   stock.getCollisionObjectArray()[i]->getWorldTransform().getOrigin();
      m_position = std::max(m_position, double(difference.length()) / m_size);
    }
  }
  if (step < m_steps - kLastSteps) return;
  const double samples = std::min(kLastSteps, m_steps);
  m_gpu.end = measureWorld(gpu, m_expectations.groundHeight);
  m_gpu.restingEnergy += m_gpu.end.kineticEnergy / samples;
  addDepths(results.matchedManifolds, m_gpu.depths);
  for (size_t run = 0; run < m_stock.size(); ++run) {
    m_stock[run].end = measureWorld(m_stockWorlds[run]->world(), m_expectations.groundHeight);
    m_stock[run].restingEnergy += m_stock[run].end.kineticEnergy / samples;
    addDepths(m_stockWorlds[run]->dispatcher(), m_stock[run].depths);
  }
}

const btDiscreteDynamicsWorld& FreeRunComparison::stockWorld() const { return m_stockWorlds.front()->world(); }

void FreeRunComparison::addTo(Series& series, const btDiscreteDynamicsWorld& gpu, const StepResults& results) const {
  std::vector<float> gpuDepths, stockDepths;
  addDepths(results.matchedManifolds, gpuDepths);
  addDepths(m_stockWorlds.front()->dispatcher(), stockDepths);
  addFigures(measureWorld(gpu, m_expectations.groundHeight), gpuDepths, series.gpu);
  addFigures(measureWorld(stockWorld(), m_expectations.groundHeight), stockDepths, series.stock);
}

// As stock: its energy at the end is a small part of what a fall of its own size would give a body.
bool FreeRunComparison::comesToRest() const {
  if (m_expectations.comesToRest != scenes::Rest::AsStock) return m_expectations.comesToRest == scenes::Rest::Yes;
  return m_stock.front().restingEnergy < kRestingShare * m_weight * m_size;
}

// Distance of btgpu's mean height from stock's range, which is widened by its own width on either side.
double FreeRunComparison::heightBeyondStock() const {
  const Range stock = rangeOf(m_stock, [](const RunStatistics& run) { return run.end.meanHeight; });
  const double height = m_gpu.end.meanHeight;
  return std::max({0.0, stock.lowest - stock.width() - height, height - stock.highest - stock.width()});
}

// By which the mean height of so many bodies, each of which comes to rest by itself, differs between two right runs:
// they are N draws of what stock's heights are spread like, in either run, and three standard errors of the difference
// of two means are more than chance makes once in 370 times.
double FreeRunComparison::heightByChance() const {
  const btDiscreteDynamicsWorld& world = stockWorld();
  const btVector3 up = world.getGravity().fuzzyZero() ? btVector3(0, 1, 0) : -world.getGravity().normalized();
  double count = 0, sum = 0, squares = 0;
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    const btRigidBody* body = movingBody(world, i);
    if (!body) continue;
    const double height = double(body->getWorldTransform().getOrigin().dot(up));
    count += 1;
    sum += height;
    squares += height * height;
  }
  if (count == 0) return 0;
  const double variance = std::max(0.0, squares / count - sum / count * (sum / count));
  return 3 * std::sqrt(2 * variance / count);
}

std::vector<Check> FreeRunComparison::checks() const {
  std::vector<Check> checks = {makeCheck("state.not_finite", m_gpu.end.notFinite)};
  const WorldFigures& stock = m_stock.front().end;
  if (m_expectations.comparableSteps > 0) checks.push_back(makeCheck("free.position", m_position));
  if (m_expectations.groundHeight > -1e29) checks.push_back(makeCheck("free.below_ground", m_gpu.end.belowGround));
  if (!m_fixedContacts) {
    checks.push_back(
        makeCheck("free.momentum", std::fabs(m_gpu.end.momentum - stock.momentum) / (stock.momentumScale + 1e-9)));
  }
  if (!comesToRest()) return checks;
  const Range energy = rangeOf(m_stock, [](const RunStatistics& run) { return run.restingEnergy; });
  const Range depth = rangeOf(m_stock, [](const RunStatistics& run) { return run.depth99(); });
  const double energyLimit = tolerance("free.kinetic_energy").limit;
  const double scale = std::max(std::fabs(stock.meanHeight), m_size);
  Check height = makeCheck("free.height", heightBeyondStock() / scale);
  height.limit = std::max(height.limit, m_expectations.heightTolerance);
  if (m_expectations.scattered) height.limit = std::max(height.limit, heightByChance() / scale);
  checks.push_back(height);
  checks.push_back(makeCheck("free.kinetic_energy",
                             m_gpu.restingEnergy / (energy.highest + energy.width() + kRestingEnergy / energyLimit)));
  checks.push_back(
      makeCheck("free.penetration", m_gpu.depth99() / std::max(depth.highest + depth.width(), kSmallDepth * m_size)));
  return checks;
}

}  // namespace btgpu::tool
