// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "worlds.h"

namespace btgpu::tool {
namespace {

struct BuiltScene : SceneContents {
  BuiltScene(const scenes::Scene& scene, scenes::Size size, btDiscreteDynamicsWorld& world) : objects(world) {
    scene.build(objects, size);
  }
  scenes::Objects objects;
};

}  // namespace

Builder builderOf(const scenes::Scene& scene, scenes::Size size) {
  return [&scene, size](btDiscreteDynamicsWorld& world) { return std::make_unique<BuiltScene>(scene, size, world); };
}

}  // namespace btgpu::tool
