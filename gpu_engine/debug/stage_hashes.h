// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>
#include <string>

#include "capture_recorder.h"

namespace btgpu {

// Appends a line for each stage of each step, or of one, to a file: a hash of all that the stage was given, and one of
// all memory that it touched as it left it (docs/capture.md). All memory counts, also what is not in use, which
// therefore starts as zeros: the same run gives the same hashes.
class StageHashes : public CaptureRecorder {
 public:
  // Of one step of each world, or of CaptureRequest::kEveryStep. Throws OpenClError if the file can't be written.
  StageHashes(const std::string& path, long step);
  ~StageHashes() override;

  void enterStep(Queue& queue, long step) override;
  // What a reference would read is no concern of the stage's.
  void beforeStage(Queue&, const char*, const std::function<StageInputs()>&) override {}
  void afterStage(Queue&, const std::function<std::vector<ArrayInUse>()>&) override {}
  void afterAllocation(Queue& queue, const cl::Buffer& buffer, size_t bytes, const std::string& array) override;

 private:
  void writeLine(const Capture& capture) const;

  const long m_step;  // or kEveryStep
  const int m_file;
  const int m_world;  // of this process, from 1
};

}  // namespace btgpu
