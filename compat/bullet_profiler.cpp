// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "bullet_profiler.h"

#include <LinearMath/btQuickprof.h>

#include <atomic>
#include <mutex>

// What is set where the application sets nothing. In the library, but in none of its headers.
void btEnterProfileZoneDefault(const char* name);
void btLeaveProfileZoneDefault();

namespace btgpu {
namespace {

std::mutex mutex;
int listeners = 0;
bool displaced = false;  // by the application, which may have put ours at the end of a chain of its own
std::atomic<btEnterProfileZoneFunc*> enterBefore{btEnterProfileZoneDefault};
std::atomic<btLeaveProfileZoneFunc*> leaveBefore{btLeaveProfileZoneDefault};
thread_local Profile* recorded = nullptr;
thread_local bool ownZone = false;  // our zones record themselves, and tell Bullet

void enterRecorded(const char* name) {
  if (recorded && !ownZone) recorded->enter(name);
  enterBefore.load()(name);
}
void leaveRecorded() {
  if (recorded && !ownZone) recorded->leave();
  leaveBefore.load()();
}

}  // namespace

bool hasBulletProfiler() {
  btEnterProfileZoneFunc* enter = btGetCurrentEnterProfileZoneFunc();
  if (enter == enterRecorded) enter = enterBefore.load();
  return enter && enter != btEnterProfileZoneDefault;
}

void enterBulletZone(const char* name) {
  ownZone = true;
  if (btEnterProfileZoneFunc* enter = btGetCurrentEnterProfileZoneFunc()) enter(name);
  ownZone = false;
}

void leaveBulletZone() {
  ownZone = true;
  if (btLeaveProfileZoneFunc* leave = btGetCurrentLeaveProfileZoneFunc()) leave();
  ownZone = false;
}

BulletListening::BulletListening() {
  const std::lock_guard<std::mutex> lock(mutex);
  if (listeners++ > 0) return;
  btEnterProfileZoneFunc* enter = btGetCurrentEnterProfileZoneFunc();
  if (enter == enterRecorded || displaced) return;  // a chain must not become a ring
  enterBefore = enter;
  leaveBefore = btGetCurrentLeaveProfileZoneFunc();
  btSetCustomEnterProfileZoneFunc(enterRecorded);
  btSetCustomLeaveProfileZoneFunc(leaveRecorded);
}

BulletListening::~BulletListening() {
  const std::lock_guard<std::mutex> lock(mutex);
  if (--listeners > 0) return;
  displaced =
      btGetCurrentEnterProfileZoneFunc() != enterRecorded || btGetCurrentLeaveProfileZoneFunc() != leaveRecorded;
  if (displaced) return;
  btSetCustomEnterProfileZoneFunc(enterBefore);
  btSetCustomLeaveProfileZoneFunc(leaveBefore);
}

BulletZonesScope::BulletZonesScope(Profile* profile) : m_before(recorded) { recorded = profile; }
BulletZonesScope::~BulletZonesScope() { recorded = m_before; }

}  // namespace btgpu
