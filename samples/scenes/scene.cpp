// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "scene.h"

#include <algorithm>

#include "parts.h"

namespace scenes {
namespace {

using Family = std::vector<Scene> (*)();

std::vector<Scene> joined(std::initializer_list<Family> families) {
  std::vector<Scene> scenes;
  for (const Family family : families) {
    for (Scene& scene : family()) scenes.push_back(std::move(scene));
  }
  return scenes;
}

std::string withoutUnderscores(std::string name) {
  name.erase(std::remove(name.begin(), name.end(), '_'), name.end());
  return name;
}

}  // namespace

const std::vector<Scene>& all() {
  static const std::vector<Scene> scenes =
      joined({boxScenes, rainScenes, compoundScenes, machineScenes, jointScenes, walkerScenes, terrainScenes});
  return scenes;
}

const std::vector<Scene>& big() {
  static const std::vector<Scene> scenes =
      joined({bigBoxScenes, bigPileScenes, junkyardScenes, washerScenes, classicScenes, bigJointScenes});
  return scenes;
}

const std::vector<Scene>& ofShapes() {
  static const std::vector<Scene> scenes = shapeScenes();
  return scenes;
}

const Scene* find(const std::string& name) {
  for (const auto* scenes : {&all(), &big(), &ofShapes()}) {
    for (const Scene& scene : *scenes) {
      if (withoutUnderscores(scene.name) == withoutUnderscores(name)) return &scene;
    }
  }
  return nullptr;
}

}  // namespace scenes
