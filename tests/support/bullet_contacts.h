// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The bodies and manifolds of a ContactScene as Bullet objects, and Bullet's own solver run on them.
#pragma once

#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <btBulletDynamicsCommon.h>

#include <memory>

#include "tests/support/contact_scene.h"

namespace btgpu {

// Bullet's solver with its rows laid open.
class OpenBulletSolver : public btSequentialImpulseConstraintSolver {
 public:
  using btSequentialImpulseConstraintSolver::solveGroupCacheFriendlyFinish;
  using btSequentialImpulseConstraintSolver::solveGroupCacheFriendlyIterations;
  using btSequentialImpulseConstraintSolver::solveGroupCacheFriendlySetup;
  const btConstraintArray& contacts() const { return m_tmpSolverContactConstraintPool; }
  const btConstraintArray& friction() const { return m_tmpSolverContactFrictionConstraintPool; }
  const btConstraintArray& torsion() const { return m_tmpSolverContactRollingFrictionConstraintPool; }
};

class BulletContacts {
 public:
  explicit BulletContacts(const ContactScene& scene);

  // Builds the rows, as at the start of a solve.
  void setup();
  // Iterates and writes everything back to bodies and manifolds.
  void solve();

  const OpenBulletSolver& solver() const { return m_solver; }
  const btRigidBody* rigid(uint body) const { return btRigidBody::upcast(m_objects[body].get()); }
  btManifoldPoint& point(size_t manifold, int k) { return m_manifolds[manifold]->getContactPoint(k); }
  // Index of the point's row in the solver's pool, or -1 if Bullet does not solve it. Between setup and
  // solve.
  int rowOf(size_t manifold, int k);

 private:
  void addBody(const WorldInput& in, uint i);
  void addManifold(const Manifold& from);

  btContactSolverInfo m_info;
  btSphereShape m_shape{1};
  OpenBulletSolver m_solver;
  std::vector<std::unique_ptr<btCollisionObject>> m_objects;
  std::vector<std::unique_ptr<btPersistentManifold>> m_manifolds;
  std::vector<btCollisionObject*> m_bodies;  // that have an island
  std::vector<btPersistentManifold*> m_list;
};

}  // namespace btgpu
