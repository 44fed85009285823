// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <string>

#include "roof.h"

namespace btgpu {

// What a step was made of.
struct StepSize {
  double bodies = 0, pairs = 0;
  double manifolds = 0, points = 0;  // with contact
  double iterations = 10;
  // What all pairs are; where there are several kinds the narrowphase's share of each is not known.
  enum class Shapes { Boxes, Convex, Several } shapes = Shapes::Several;
};

// The least that a stage has to read, write and compute for a step of this size (gpu_engine/device_world.h says which
// arrays; a body's data that a pair needs is read once for each pair). Flops are counted by hand from the formulas, to
// within a factor of two. No bytes: not known, as for stages that hardly touch anything.
Work workOf(const std::string& stage, const StepSize& size);

}  // namespace btgpu
