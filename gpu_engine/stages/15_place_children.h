// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../device_world.h"

namespace btgpu {

// The shapes of compounds go with their bodies. Reads childPoses[] and the bodies' own entries; writes poses[], steps[]
// (the predicted pose), activations[] and the quarantine flag in infos[] of the slots with BODY_CHILD. Only in worlds
// that have such slots.
class PlaceChildren {
 public:
  void enqueue(Queue& queue, DeviceWorld& world);

 private:
  Kernel m_placeChildren;  // built when a world first has such slots
};

}  // namespace btgpu
