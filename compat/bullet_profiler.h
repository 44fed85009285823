// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Bullet's profile zones: a pair of functions of the process (btSetCustomEnterProfileZoneFunc) that the application may
// set, and that Bullet's own BT_PROFILE calls.
#pragma once

#include "profile.h"

namespace btgpu {

// True if the application has set functions of its own.
bool hasBulletProfiler();
void enterBulletZone(const char* name);
void leaveBulletZone();

// While there is one of these, our functions stand before the application's and pass everything on to those. An
// application that sets its own later puts ours aside.
class BulletListening {
 public:
  BulletListening();
  ~BulletListening();
  BulletListening(const BulletListening&) = delete;
  BulletListening& operator=(const BulletListening&) = delete;
};

// Bullet's own zones on this thread are recorded in `profile` too, which may be null.
class BulletZonesScope {
 public:
  explicit BulletZonesScope(Profile* profile);
  ~BulletZonesScope();
  BulletZonesScope(const BulletZonesScope&) = delete;
  BulletZonesScope& operator=(const BulletZonesScope&) = delete;

 private:
  Profile* m_before;
};

}  // namespace btgpu
