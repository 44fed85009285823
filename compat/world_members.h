// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../translation/bullet.h"

BTGPU_TRANSLATION_BEGIN

// Names the protected members of btDiscreteDynamicsWorld. `world.*&WorldMembers::m_actions` is that of any world: one
// of btgpu's classes, or the application's own. Virtual functions called so are what the world's class makes of them.
class WorldMembers : public btDiscreteDynamicsWorld {
 public:
  WorldMembers() = delete;

  using btDiscreteDynamicsWorld::m_actions;
  using btDiscreteDynamicsWorld::m_applySpeculativeContactRestitution;
  using btDiscreteDynamicsWorld::m_collisionObjects;
  using btDiscreteDynamicsWorld::m_constraints;
  using btDiscreteDynamicsWorld::m_internalPreTickCallback;
  using btDiscreteDynamicsWorld::m_internalTickCallback;
  using btDiscreteDynamicsWorld::m_nonStaticRigidBodies;
  using btDiscreteDynamicsWorld::m_predictiveManifolds;

  using btDiscreteDynamicsWorld::calculateSimulationIslands;
  using btDiscreteDynamicsWorld::createPredictiveContacts;
  using btDiscreteDynamicsWorld::createPredictiveContactsInternal;
  using btDiscreteDynamicsWorld::integrateTransforms;
  using btDiscreteDynamicsWorld::integrateTransformsInternal;
  using btDiscreteDynamicsWorld::internalSingleStepSimulation;
  using btDiscreteDynamicsWorld::predictUnconstraintMotion;
  using btDiscreteDynamicsWorld::releasePredictiveContacts;
  using btDiscreteDynamicsWorld::saveKinematicState;
  using btDiscreteDynamicsWorld::updateActions;
  using btDiscreteDynamicsWorld::updateActivationState;
};

BTGPU_TRANSLATION_END
