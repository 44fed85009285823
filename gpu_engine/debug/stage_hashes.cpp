// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "stage_hashes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>

#include "../opencl/error.h"
#include "../opencl/queue.h"
#include "capture_bytes.h"
#include "capture_file.h"

namespace btgpu {
namespace {

int nextWorld() {
  static std::atomic<int> last{0};
  return ++last;
}

class Hash {
 public:
  Hash() : m_state(XXH3_createState()) { XXH3_64bits_reset(m_state); }
  ~Hash() { XXH3_freeState(m_state); }
  Hash(const Hash&) = delete;
  Hash& operator=(const Hash&) = delete;

  // With the size, so that no two rows of arrays read the same.
  void add(const Bytes& bytes) {
    const std::uint64_t size = bytes.size();
    XXH3_64bits_update(m_state, &size, sizeof size);
    XXH3_64bits_update(m_state, bytes.data(), bytes.size());
  }
  std::uint64_t value() const { return XXH3_64bits_digest(m_state); }

 private:
  XXH3_state_t* m_state;
};

std::uint64_t hashOfInputs(const Capture& capture) {
  Hash hash;
  hash.add(encodeCommands(capture));
  for (const CapturedArray& array : capture.arrays) hash.add(array.before);
  return hash.value();
}

std::uint64_t hashOfOutputs(const Capture& capture) {
  Hash hash;
  for (const CapturedArray& array : capture.arrays) hash.add(array.expected());
  return hash.value();
}

}  // namespace

StageHashes::StageHashes(const std::string& path, long step)
    : CaptureRecorder({{"all", CaptureRequest::kEveryStep}}, [this](const Capture& capture) { writeLine(capture); }),
      m_step(step),
      m_file(::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)),
      m_world(nextWorld()) {
  if (m_file < 0) {
    throw OpenClError(OpenClError::Kind::General, fmt::format("the stages' hashes can't be written to {}", path));
  }
}

StageHashes::~StageHashes() { ::close(m_file); }

void StageHashes::enterStep(Queue& queue, long step) {
  if (m_step == CaptureRequest::kEveryStep || m_step == step) CaptureRecorder::enterStep(queue, step);
}

void StageHashes::afterAllocation(Queue& queue, const cl::Buffer& buffer, size_t bytes, const std::string&) {
  try {
    queue.raw().enqueueFillBuffer<unsigned char>(buffer, 0, 0, bytes);
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), "while memory is cleared"); }
}

void StageHashes::writeLine(const Capture& capture) const {
  const std::string line = fmt::format("{} {} {} {:016x} {:016x}\n", m_world, capture.step, capture.stage,
                                       hashOfInputs(capture), hashOfOutputs(capture));
  if (::write(m_file, line.data(), line.size()) < 0) return;  // a full disk must not end the simulation
}

}  // namespace btgpu
