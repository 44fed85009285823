// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// A world in which nothing is awake goes on as it is: its next step would find what the last one found, and leave it.
// Such steps need not be done; what has to be done is to notice when the application changes something.
#pragma once

#include <cstdint>
#include <vector>

#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

class WorldReader;

// What of the objects a step in a sleeping world would notice.
enum class Watch {
  Everything,   // whatever would have an effect in stock before something wakes
  Activations,  // only that an object has been activated, added or removed (btGpuSettings::m_watchSleepers)
};

class RestWatch {
 public:
  using Objects = btCollisionObjectArray;
  using Bodies = btAlignedObjectArray<btRigidBody*>;
  using Joints = btAlignedObjectArray<btTypedConstraint*>;

  // A step is over. `still`: it started from what the step before it had left, no object is awake, and it wrote to
  // none. After so many of these in a row the host's broadphase has come to rest as well, and the world may be
  // settled().
  void endStep(bool still);
  // Whether that has just become so; then settle().
  bool isDue() const { return !m_settled && m_stillSteps >= kStillSteps; }
  // Remembers what the objects are like. Not if there is something that a step would do to them all the same.
  void settle(const Objects& objects, const Bodies& bodies, const Joints& joints, WorldReader& reader);

  bool isSettled() const { return m_settled; }
  // Whether all is as it was then; if not, the world is no longer settled. Looks at every object, on several threads,
  // unless it is still confirmed().
  bool isUndisturbed(const Objects& objects, const Bodies& bodies, const Joints& joints, const WorldReader& reader,
                     Watch watch);

  // While it lasts, nothing but btgpu has run since isUndisturbed() has said yes.
  bool isConfirmed() const { return m_confirmed; }
  // The application may have changed something.
  void endConfirmation() { m_confirmed = false; }

  void forget();

 private:
  // Stock's broadphase takes two steps to see that a body stands still, and one more to go through its pairs.
  static constexpr int kStillSteps = 4;

  bool sameLists(const Objects& objects, const Bodies& bodies, const Joints& joints, const WorldReader& reader) const;

  int m_stillSteps = 0;
  bool m_settled = false, m_confirmed = false;
  std::vector<std::uint64_t> m_marks;  // by position in the world, of what an object is like
  std::vector<btTypedConstraint*> m_joints;
};

BTGPU_TRANSLATION_END
