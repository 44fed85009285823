// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>
#include <string>

#include "../gpu_engine/engine.h"

namespace btgpu {

// Opens the engine plugin, once for the process and for ever, and creates an engine in it. On failure returns null
// and says why in one line, and by a status (a plugin that does not fit or is not there: WrongAbi). The plugin is
// looked for at $BTGPU_ENGINE, beside this library, in the folders btgpu,
// ../lib and ../lib/btgpu from there, and where the dynamic linker looks.
std::unique_ptr<Engine> createEngine(const EngineSettings& settings, std::string& error, Status* why = nullptr);

// All OpenCL devices; on failure false and one line.
bool listDevices(std::vector<EngineInfo>& devices, std::string& error);

// Runs a captured stage again; what is not Ok says why in one line.
Status replayCapture(const std::string& file, const ReplayOptions& options, ReplayReport& report, std::string& error);

// Stage 30 by itself; on failure null and one line.
std::unique_ptr<PairSearch> createPairSearch(const std::string& device, PairFinder finder, std::string& error);

}  // namespace btgpu
