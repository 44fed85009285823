// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "quiet_callbacks.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <atomic>
#include <mutex>

BTGPU_TRANSLATION_BEGIN
namespace {

thread_local bool quiet = false;

// Bullet's globals are plain pointers that the narrowphase of other threads may be reading: written by one thread at a
// time, and only where the application has set them.
std::mutex mutex;
int users = 0;
std::atomic<ContactStartedCallback> started{nullptr};
std::atomic<ContactEndedCallback> ended{nullptr};

void forwardStarted(btPersistentManifold* const& manifold) {
  const ContactStartedCallback callback = started;
  if (!quiet && callback) callback(manifold);
}

void forwardEnded(btPersistentManifold* const& manifold) {
  const ContactEndedCallback callback = ended;
  if (!quiet && callback) callback(manifold);
}

}  // namespace

QuietCallbacks::QuietCallbacks() {
  quiet = true;
  const std::lock_guard<std::mutex> lock(mutex);
  ++users;
  if (gContactStartedCallback && gContactStartedCallback != forwardStarted) {
    started = gContactStartedCallback;
    gContactStartedCallback = forwardStarted;
  }
  if (gContactEndedCallback && gContactEndedCallback != forwardEnded) {
    ended = gContactEndedCallback;
    gContactEndedCallback = forwardEnded;
  }
}

QuietCallbacks::~QuietCallbacks() {
  quiet = false;
  const std::lock_guard<std::mutex> lock(mutex);
  if (--users > 0) return;
  if (gContactStartedCallback == forwardStarted) gContactStartedCallback = started;
  if (gContactEndedCallback == forwardEnded) gContactEndedCallback = ended;
}

BTGPU_TRANSLATION_END
