// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What btgpu does in place of btDiscreteDynamicsWorld::internalSingleStepSimulation, for a world of any class.
#pragma once

#include <memory>

#include "world_members.h"
#include "world_state.h"

BTGPU_TRANSLATION_BEGIN

// The step of the class that the world would be without btgpu.
using StockStep = void (*)(btDiscreteDynamicsWorld& world, btScalar timeStep);

class WorldStep {
 public:
  WorldStep(btDiscreteDynamicsWorld& world, StockStep stock);

  // One substep: on the device, or on the stock path if that has to do it, with the application's callbacks and
  // actions.
  void run(btScalar timeStep);

  // Whether a stepSimulation is nothing but btgpu's, but for callbacks and actions.
  bool isAllOurs() const;

 private:
  bool runOnDevice(btScalar timeStep);
  StepSettings settingsOf(btScalar timeStep) const;
  bool staysAtRest(const StepSettings& settings);
  void watchRest(const StepSettings& settings, bool still);
  bool mayBatchSubsteps() const;
  bool findHostContacts(btScalar timeStep, bool hostPairsDone, FallbackList& missing);
  void predictContacts(btScalar timeStep);
  bool writeBackBodies(btScalar timeStep);
  void updateHostBroadphase(btScalar timeStep);
  void catchUpContacts();
  void runStock(btScalar timeStep);
  void giveIslandTags();

  const char* overriddenStage() const;
  template <typename Member>
  bool overrides(Member member) const;

  btDiscreteDynamicsWorld& m_world;
  const StockStep m_stock;
  const std::shared_ptr<WorldState> m_state;
  btAlignedObjectArray<btRigidBody*>& m_bodies;  // the world's own lists
  btAlignedObjectArray<btActionInterface*>& m_actions;
  btAlignedObjectArray<btTypedConstraint*>& m_constraints;
  btManifoldArray& m_predictive;
};

BTGPU_TRANSLATION_END
