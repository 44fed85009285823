// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A second world that holds a copy of everything in an application's world, to step it once more on stock without the
// application being told: shapes are shared, bodies are copies without motion state and user data, joints give the
// rows that were recorded. Actions, filters and callbacks stay behind.
#pragma once

#include <memory>
#include <vector>

#include "../read_joints.h"
#include "oracle_world.h"

BTGPU_TRANSLATION_BEGIN

class ReplayJoint;

class ShadowWorld : public OracleWorld {
 public:
  ShadowWorld();
  ~ShadowWorld() override;

  // Becomes a copy of `world`, which `reader` has just read. Bodies in quarantine are left out.
  void follow(btDiscreteDynamicsWorld& world, const WorldReader& reader);
  // Takes the step's joints over, with their rows.
  void followJoints(const WorldReader& reader, const JointReader& joints);

  // Pairs that the application does not want to collide, and those that the host collides, with shapes and callbacks of
  // the application: their contacts come from the record.
  bool leavesOut(const btCollisionObject& a, const btCollisionObject& b) const override;
  bool ignores(uint a, uint b) const override;
  // Sweeps are Bullet's own, of pairs of the host too, and ask for groups and masks as well as for a filter.
  bool passes(const btCollisionObject& a, const btCollisionObject& b) const override;

 protected:
  void setForces() override {}  // copied with the bodies

 private:
  struct Clone {
    std::unique_ptr<btCollisionObject> object;
    const btCollisionObject* original = nullptr;
    const btCollisionShape* shape = nullptr;
    int flags = 0, type = 0, group = 0, mask = 0, uniqueId = 0;
    int ownGroup = 0, ownMask = 0;  // the original's now, whatever the clone has
  };
  static Clone describe(const btCollisionObject& original);
  static bool sameObject(const Clone& a, const Clone& b);
  void removeStale(const std::vector<Clone>& wanted);
  void add(Clone& clone);
  void followSettings(btDiscreteDynamicsWorld& world);
  void followAabbs(const btDiscreteDynamicsWorld& world, const WorldInput& input);
  bool mayCollide(uint slotA, uint slotB) const;
  btRigidBody& end(const WorldReader& reader, const btRigidBody& original);

  std::vector<Clone> m_clones;  // by slot
  std::vector<bool> m_onHost;   // by slot
  std::vector<ulong> m_listedPairs;
  bool m_onlyListed = false;
  std::vector<std::unique_ptr<ReplayJoint>> m_joints;
  btRigidBody m_fixed;  // where a joint's end has no body in the world
};

BTGPU_TRANSLATION_END
