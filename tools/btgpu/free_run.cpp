// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "free_run.h"

#include <algorithm>
#include <cmath>

namespace btgpu::tool {
namespace {

constexpr double kRestingEnergy = 1e-4;  // J a body: what a settled pile may have at any rate
constexpr double kRestingShare = 1e-2;
constexpr double kSmallDepth = 1e-3;     // of the size: penetrations below are as good as none

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

double percentile99(std::vector<float> depths) {
  if (depths.empty()) return 0;
  const auto at = depths.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(depths.size() - 1));
  std::nth_element(depths.begin(), at, depths.end());
  return *at;
}

}  // namespace

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

void FreeRunComparison::afterStep(int step, const btDiscreteDynamicsWorld& gpu, const StepResults& results,
                                  const btDiscreteDynamicsWorld& stock, const btDispatcher& stockDispatcher) {
  if (step == 0) {
    double sum = 0;
    int moving = 0;
    for (int i = 0; i < gpu.getNumCollisionObjects(); ++i) {
      if (movingBody(gpu, i)) {
        sum += double(gpu.getCollisionObjectArray()[i]->getCollisionShape()->getAngularMotionDisc());
        m_weight += double(gpu.getGravity().length() / movingBody(gpu, i)->getInvMass());
        ++moving;
      } else {
        m_fixedContacts = true;
      }
    }
    m_size = moving ? sum / moving : 1;
    m_weight /= std::max(1, moving);
  }
  if (step < m_expectations.comparableSteps) {
    for (int i = 0; i < gpu.getNumCollisionObjects(); ++i) {
      const btVector3 difference = gpu.getCollisionObjectArray()[i]->getWorldTransform().getOrigin() -
                                   stock.getCollisionObjectArray()[i]->getWorldTransform().getOrigin();
      m_position = std::max(m_position, double(difference.length()) / m_size);
    }
  }
  if (step < m_steps - kLastSteps && step != m_steps - 1) return;
  m_gpu = measureWorld(gpu, m_expectations.groundHeight);
  m_stock = measureWorld(stock, m_expectations.groundHeight);
  m_gpuEnergy += m_gpu.kineticEnergy;
  m_stockEnergy += m_stock.kineticEnergy;
  ++m_energySamples;
  for (const Manifold& m : results.matchedManifolds) {
    for (int k = 0; k < m.pointCount; ++k) m_gpuDepths.push_back(std::max(0.0f, -m.points[k].localPointA.w));
  }
  for (int i = 0; i < stockDispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* m = const_cast<btDispatcher&>(stockDispatcher).getManifoldByIndexInternal(i);
    for (int k = 0; k < m->getNumContacts(); ++k) {
      m_stockDepths.push_back(std::max(0.0f, -static_cast<float>(m->getContactPoint(k).getDistance())));
    }
  }
}

// As stock: its energy at the end is a small part of what a fall of its own size would give a body.
bool FreeRunComparison::comesToRest() const {
  if (m_expectations.comesToRest != scenes::Rest::AsStock) return m_expectations.comesToRest == scenes::Rest::Yes;
  return m_stockEnergy / std::max(1, m_energySamples) < kRestingShare * m_weight * m_size;
}

std::vector<Check> FreeRunComparison::checks() const {
  std::vector<Check> checks = {makeCheck("state.not_finite", m_gpu.notFinite)};
  if (m_expectations.comparableSteps > 0) checks.push_back(makeCheck("free.position", m_position));
  if (m_expectations.groundHeight > -1e29) checks.push_back(makeCheck("free.below_ground", m_gpu.belowGround));
  if (!m_fixedContacts) {
    checks.push_back(makeCheck("free.momentum", std::fabs(m_gpu.momentum - m_stock.momentum) / (m_stock.momentumScale + 1e-9)));
  }
  if (!comesToRest()) return checks;
  const double scale = std::max(std::fabs(m_stock.meanHeight), m_size);
  checks.push_back(makeCheck("free.height", std::fabs(m_gpu.meanHeight - m_stock.meanHeight) / scale));
  const double samples = std::max(1, m_energySamples);
  const double limit = tolerance("free.kinetic_energy").limit;
  checks.push_back(makeCheck("free.kinetic_energy",
                             (m_gpuEnergy / samples) / (m_stockEnergy / samples + kRestingEnergy / limit)));
  checks.push_back(makeCheck("free.penetration",
                             percentile99(m_gpuDepths) / std::max(percentile99(m_stockDepths), kSmallDepth * m_size)));
  return checks;
}

}  // namespace btgpu::tool
