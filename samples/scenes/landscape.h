// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Ground that is not flat, of triangles or as a height field.
#pragma once

#include <functional>

#include "parts.h"

namespace scenes {

// A square around the y axis, its heights given at the corners of a grid.
struct Landscape {
  int corners;   // a side
  double pitch;  // between corners, in metres
  std::function<double(double x, double z)> heightAt;

  double side() const { return (corners - 1) * pitch; }
  double at(int i) const { return i * pitch - side() / 2; }
  double height(int i, int j) const { return heightAt(at(i), at(j)); }
};

// Hills with room for bodies on a grid of n with a pitch of 2 m, higher around the rim so that nothing rolls off.
Landscape rollingLandscape(Size n);

btRigidBody* addMesh(Objects& o, const Landscape& land);
btRigidBody* addHeightField(Objects& o, const Landscape& land);

}  // namespace scenes
