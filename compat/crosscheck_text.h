// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What the cross-check says, as a line of the log and as a line of JSON.
#pragma once

#include <string>

#include "../translation/bullet.h"
#include "btGpuDynamicsWorld.h"

BTGPU_TRANSLATION_BEGIN

// One line without its end.
std::string crosscheckText(int world, const btGpuCrosscheckStep& failed);
std::string crosscheckText(int world, const btGpuCrosscheckSummary& summary);

// One line.
std::string crosscheckJson(int world, const btGpuCrosscheckStep& step);
std::string crosscheckJson(int world, const btGpuCrosscheckSummary& summary);

BTGPU_TRANSLATION_END
