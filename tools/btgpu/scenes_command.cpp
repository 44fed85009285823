// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "arguments.h"
#include "bullet_file.h"
#include "commands.h"

namespace btgpu::tool {
namespace {

struct ScenesArguments {
  std::string write, file, size;
};

std::string toText(scenes::Size size) { return fmt::format("{},{},{}", size.x, size.y, size.z); }

int runScenes(const ScenesArguments& arguments) {
  if (!arguments.write.empty()) {
    const scenes::Scene& scene = sceneNamed(arguments.write);
    writeBulletFile(scene, arguments.size.empty() ? scene.size : parseSize(arguments.size), arguments.file);
    return kAgreed;
  }
  for (const auto& s : scenes::all()) {
    fmt::print("{:<13} {} (size {}; {} steps)\n", s.name, s.description, toText(s.size), s.steps);
  }
  fmt::print("\nand as others measure their engines; the size is that of btgpu bench\n");
  for (const auto& s : scenes::big()) {
    const scenes::Benchmark& b = s.benchmark;
    fmt::print("{:<13} {} (size {}; for compare {}, {} steps)\n", s.name, s.description, toText(b.size), toText(s.size),
               s.steps);
  }
  // 144 of them: two lines tell what the names are made of.
  fmt::print("\nand of each shape, rained on a ground or thrown over it: rain_SHAPE_on_GROUND, roll_SHAPE_on_GROUND\n");
  fmt::print("SHAPE: {}\nGROUND: {}\n", fmt::join(scenes::shapeNames(), ", "), fmt::join(scenes::groundNames(), ", "));
  return kAgreed;
}

}  // namespace

Command addScenesCommand(CLI::App& tool) {
  const auto arguments = std::make_shared<ScenesArguments>();
  CLI::App* list = tool.add_subcommand("scenes", "built-in scenes");
  CLI::Option* write = list->add_option("--write", arguments->write, "write this scene as a .bullet file");
  list->add_option("--size", arguments->size, "size of the scene, as X,Y,Z")->needs(write)->check(kNotEmpty);
  CLI::Option* path = list->add_option("file", arguments->file, "the file to write")->needs(write);
  write->needs(path);
  return {list, [arguments] { return runScenes(*arguments); }};
}

}  // namespace btgpu::tool
