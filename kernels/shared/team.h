// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the members of a team share (kernels/lib/team.h on the CPU shape, resident.h on the GPU shape): TEAM_SIZE uints,
// zero before the first launch and after each.
#ifndef BTGPU_SHARED_TEAM_H
#define BTGPU_SHARED_TEAM_H
#include "types.h"

BTGPU_BEGIN

// In cache lines of their own, but for those that are used but once a launch.
#define TEAM_MEMBERS 0  // that have joined
#define TEAM_LEFT 1     // that have left again
#define TEAM_STATE 2    // GPU shape: whether all groups are there
#define TEAM_DONE 16    // parts done in all rounds; GPU shape: arrivals of groups
#define TEAM_CLAIM(part) (32 + 16 * (part))  // the last round in which somebody took the part
#define TEAM_PARTS 64   // most parts of a round
#define TEAM_OPEN 0u  // values of TEAM_STATE
#define TEAM_COMPLETE 1u
#define TEAM_GIVEN_UP 2u
#define TEAM_SIZE TEAM_CLAIM(TEAM_PARTS)

BTGPU_END
#endif
