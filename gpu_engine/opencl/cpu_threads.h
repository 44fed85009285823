// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

namespace btgpu {

// Asks PoCL to keep each of its threads on a core of its own (POCL_AFFINITY), unless the user has said otherwise. To be
// called before the first OpenCL call of the process. Does nothing where the process may not run on all cores, since
// PoCL counts them from 0.
void spreadCpuDeviceThreads();

}  // namespace btgpu
