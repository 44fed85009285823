// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Host reference of 60_batch_constraints. Must be equal exactly: groups and batches are integers and a pure function of
// constraints and positions.
#pragma once

#include <vector>

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/rows.h"

namespace btgpu {

struct BatchesReference {
  std::vector<uint> groups;        // of each constraint
  std::vector<uint> groupBatches;  // of each group, those of all phases
  std::vector<uint> batchFirst;    // BATCH_LIMIT a group: slots; then each group's share of the serial batch
  std::vector<SlotHeader> slots;
  uint batchCount = 0;                             // most of a group
  uint serialFirst = 0, serialCount = 0, end = 0;  // slots of the serial batch; behind it only padding
};

// The paper's batchConstraints, group by group: in each batch, as many of the group's constraints as do not share a
// body, taken in the order of permute(index in the group), those between two moving bodies first; bodies count as one
// if they share a cell of the table of marks. `constraints` are indices into `manifolds`; split: SPLIT_* of
// kernels/lib/batches.h.
BatchesReference batchConstraintsReference(const std::vector<uint>& split, const std::vector<uint>& constraints,
                                           const std::vector<Manifold>& manifolds, const std::vector<BodyStep>& steps,
                                           const std::vector<BodyPose>& poses);

}  // namespace btgpu
