// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Colours of joints, found on the host, which makes their rows anyway.
#pragma once

#include <vector>

#include "../kernels/shared/joint.h"

namespace btgpu {

// The order in which Bullet solves joints, as far as it can be known before the contacts are: sorted by island
// (docs/decisions/0026-order-of-joints.md). A chain of any length comes out in an order in which few have to wait.
std::vector<uint> orderOfJoints(const std::vector<Joint>& joints, uint bodyCount);

// Joints of one colour move different bodies. If few colours suffice, each joint comes after all those before it in
// that order that share a body with it, so that the result is that of solving them one after the other. Else (large
// nets, hubs) as few colours as a greedy choice gives. A function of the joints' bodies and their order alone.
struct JointColours {
  std::vector<uint> order;  // indices of joints, colour by colour, the serial batch last, ascending within each
  std::vector<uint> first;  // where each colour begins in `order`; then the serial batch, then the end
  uint colourCount() const { return first.empty() ? 0 : static_cast<uint>(first.size()) - 2; }
  uint serialFirst() const { return first.empty() ? 0 : first[first.size() - 2]; }
};

// Joints that move no body are left out.
JointColours colourJoints(const std::vector<Joint>& joints, uint bodyCount);

// The joints of each colour in blocks of JOINT_LANES, those with more rows first, so that few lanes of a block are
// idle. Joints without rows are left out, and so is the serial batch.
struct JointBlocks {
  std::vector<uint> colours;  // how many there are, the first block of each, and the end
  std::vector<uint> lanes;    // JOINT_LANES a block: indices of joints, then NO_INDEX
  std::vector<uint> rows;     // where the rows of each block begin, in rows of JOINT_LANES; then the end
};
JointBlocks blocksOf(const JointColours& colours, const std::vector<Joint>& joints);

}  // namespace btgpu
