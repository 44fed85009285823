// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What belongs to a btGpuDynamicsWorld but is not inside it: the class adds no member to its base, so its
// state lies in a table keyed by the world's address.
#pragma once

#include <memory>
#include <string>

#include "../gpu_engine/engine.h"
#include "../translation/fallback_list.h"
#include "../translation/host_contacts.h"
#include "../translation/contact_writer.h"
#include "../translation/read_joints.h"
#include "../translation/read_world.h"
#include "../translation/world_loops.h"
#include "btGpuDynamicsWorld.h"

BTGPU_TRANSLATION_BEGIN

enum class Path { None, Device, Stock };

struct WorldState {
  btGpuSettings settings;
  const void* ownTable = nullptr;  // virtual table of btGpuDynamicsWorld itself
  WorldReader reader;
  ContactWriter contacts;
  HostContacts hostContacts;
  AabbUpdater aabbs;
  JointReader joints;
  std::unique_ptr<Engine> engine;
  std::string engineError;  // why there is no engine; it is not tried again until configure()
  StepResults results;      // of the last device step
  Path lastPath = Path::None;

  // The next step reads the whole world anew.
  void forgetWorld() {
    reader.clear();
    contacts.forget();
  }

  FallbackList fallbacks;
  btGpuStatistics statistics;
};

// The state of a world, made if there is none: an address may be used again without a destructor having run.
std::shared_ptr<WorldState> findState(const btGpuDynamicsWorld* world);
std::shared_ptr<WorldState> replaceState(const btGpuDynamicsWorld* world, const btGpuSettings& settings);
void eraseState(const btGpuDynamicsWorld* world);

BTGPU_TRANSLATION_END
