// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Joints for the device: their rows are made by Bullet's own getInfo1 and getInfo2, on the host.
#pragma once

#include <vector>

#include "read_world.h"

BTGPU_TRANSLATION_BEGIN

// Makes the rows of a world's joints from its bodies' state at the start of a step, as stock's solver makes them after
// the bodies were damped. A joint's own state (angles, accumulated motor impulses) changes as in stock.
class JointReader {
 public:
  // After reader.read(): fills joints and jointRows of reader.input(). What the device can't do goes into `missing`,
  // and then no joint has been touched.
  // The rows are those of the bodies as they will be after `ahead`: in the fast mode the forces of a step move bodies
  // by less than the whole of it, and only rows that are so much ahead of the step's start neither add energy nor take
  // it (docs/decisions/0017-fast-mode.md).
  void read(btDiscreteDynamicsWorld& world, btScalar timeStep, WorldReader& reader, FallbackList& missing,
            btScalar ahead = btScalar(0));

  // After a step on the device: the impulses by row, for the next step to start with.
  void remember(const std::vector<float>& impulses) { m_impulses = impulses; }

  // The constraints that joints[i] of the input were made from.
  const std::vector<btTypedConstraint*>& constraints() const { return m_constraints; }
  // No constraint is in the world twice.
  bool areDistinct() const { return m_distinct; }

 private:
  template <typename Work>
  void forEachJoint(const Work& work);
  void recallImpulses(WorldInput& input);
  void readJoints(btDiscreteDynamicsWorld& world, WorldReader& reader, FallbackList& missing);
  void readJoint(std::size_t i, WorldReader& reader, FallbackList& missing);
  std::vector<btRigidBody*> dampedBodies(const WorldReader& reader);
  void countRows(std::size_t i, Joint& joint) const;
  void placeRows(WorldInput& input) const;

  std::vector<btTypedConstraint*> m_constraints;
  std::vector<char> m_evaluated;  // by joint: in an island, so that stock would set it up if that is awake
  std::vector<char> m_isLinked;   // by slot: seen among the joints' bodies
  bool m_distinct = true;
  bool m_atOnce = true;  // all are Bullet's own: they change nothing but themselves, and several threads share them
  struct Chunk {
    FallbackList missing;
    bool bulletsOwn = true;
  };
  std::vector<Chunk> m_chunks;
  std::vector<float> m_impulses;  // remembered
  struct Last {
    std::vector<btTypedConstraint*> constraints;  // compared, never looked into
    std::vector<Joint> joints;
    std::vector<float> impulses;
  } m_last;  // of the last step
};

BTGPU_TRANSLATION_END
