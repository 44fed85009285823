// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Which four of any number of contact candidates a stage may show (kernels/lib/pick_points.h), for the references of
// the stages that collide hulls. Where two candidates are as good within their errors, either may be shown.
#pragma once

#include <vector>

#include "contract.h"
#include "reference_maths.h"

namespace btgpu {

struct PickCandidate {
  reference::Vec at;
  double distance;   // of the surfaces; negative: inside
  double error = 0;  // how far off place and distance may be, beyond those of every point
};

struct PickRules {
  reference::Vec normal;  // seen along it, points nearer than `spacing` are one
  double limit;           // candidates farther apart are none
  double slack;           // of those as deep as the deepest within this, any may be taken for it
  double spacing;
};

// The deepest; the one farthest from it; on either side of the line through these the one farthest from the line. The
// deepest comes last, the others before it in reverse order.
std::vector<PickCandidate> pickPointsReference(const PickRules& rules, const std::vector<PickCandidate>& candidates);

// That no candidate was a better choice than those picked (in the order above), each known to within `error`. Not that
// each is one of the candidates.
void checkPickedPoints(Contract& contract, const PickRules& rules, const std::vector<PickCandidate>& candidates,
                       const std::vector<PickCandidate>& picked, double error);

}  // namespace btgpu
