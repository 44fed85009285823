// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "world_state.h"

#include <mutex>
#include <unordered_map>

BTGPU_TRANSLATION_BEGIN
namespace {

struct Table {
  std::mutex mutex;
  std::unordered_map<const btDiscreteDynamicsWorld*, std::shared_ptr<WorldState>> states;
};

// Never destroyed: static worlds die after the statics of this library.
Table& table() {
  static Table* t = new Table;
  return *t;
}

}  // namespace

std::shared_ptr<WorldState> findState(const btDiscreteDynamicsWorld* world) {
  Table& t = table();
  const std::lock_guard<std::mutex> lock(t.mutex);
  auto& state = t.states[world];
  if (!state) state = std::make_shared<WorldState>();
  return state;
}

std::shared_ptr<WorldState> replaceState(const btDiscreteDynamicsWorld* world, const btGpuSettings& settings) {
  auto state = std::make_shared<WorldState>();
  state->settings = settings;
  state->small.use(settings);
  state->zones.useFile(settings.m_profileFile);
  Table& t = table();
  const std::lock_guard<std::mutex> lock(t.mutex);
  std::swap(t.states[world], state);
  return t.states[world];
}

void eraseState(const btDiscreteDynamicsWorld* world) {
  std::shared_ptr<WorldState> last;  // destroyed after the lock is released
  Table& t = table();
  const std::lock_guard<std::mutex> lock(t.mutex);
  const auto it = t.states.find(world);
  if (it == t.states.end()) return;
  last = std::move(it->second);
  t.states.erase(it);
}

BTGPU_TRANSLATION_END
