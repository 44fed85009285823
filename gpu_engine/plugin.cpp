// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The plugin's entry points, and the border at which exceptions become a Status.
#include <algorithm>
#include <cstring>
#include <new>

#include "debug/replay.h"
#include "opencl/error.h"
#include "pair_search.h"
#include "world_engine.h"

namespace btgpu {
namespace {

Status statusOf(OpenClError::Kind kind) {
  switch (kind) {
    case OpenClError::Kind::NoDevice:
      return Status::NoDevice;
    case OpenClError::Kind::OutOfMemory:
      return Status::OutOfMemory;
    case OpenClError::Kind::Build:
      return Status::BuildFailed;
    case OpenClError::Kind::General:
      break;
  }
  return Status::DeviceFailed;
}

// Runs `work`; turns whatever it throws into a status and a message.
template <typename Work>
Status guarded(std::string& message, Work&& work) noexcept {
  try {
    try {
      work();
      return Status::Ok;
    } catch (const OpenClError& e) {
      message = e.what();
      return statusOf(e.kind());
    } catch (const cl::Error& e) {
      const OpenClError error = makeOpenClError(e.err(), e.what(), "");
      message = error.what();
      return statusOf(error.kind());
    } catch (const CaptureError& e) {
      message = e.what();
      return Status::BadInput;
    } catch (const std::bad_alloc&) {
      message = "out of host memory";
      return Status::OutOfMemory;
    } catch (const std::exception& e) {
      message = e.what();
      return Status::InternalError;
    }
  } catch (...) {  // no memory left even for the message
    return Status::OutOfMemory;
  }
}

class PluginEngine final : public Engine {
 public:
  explicit PluginEngine(const EngineSettings& settings) : m_engine(settings) {}

  Status beginStep(const WorldInput& input, const StepSettings& settings) noexcept override {
    const ZoneSinkScope scope(m_sink);
    return guarded(m_error, [&] { m_engine.begin(input, settings); });
  }
  Status finishStep(StepResults& results) noexcept override {
    const ZoneSinkScope scope(m_sink);
    const Status status = guarded(m_error, [&] { m_engine.finish(results); });
    std::string ignored;
    guarded(ignored, [&] { m_engine.collectTimes(m_sink); });
    return status;
  }
  Status readManifolds(std::vector<Manifold>& manifolds) noexcept override {
    return guarded(m_error, [&] { m_engine.readManifolds(manifolds); });
  }
  Status castRays(const QueryWorld& world, const Ray* rays, size_t count, RayResults& results) noexcept override {
    const ZoneSinkScope scope(m_sink);
    return guarded(m_error, [&] { m_engine.castRays(world, rays, count, results); });
  }
  Status castSweeps(const QueryWorld& world, const Sweep* sweeps, size_t count,
                    SweepResults& results) noexcept override {
    const ZoneSinkScope scope(m_sink);
    return guarded(m_error, [&] { m_engine.castSweeps(world, sweeps, count, results); });
  }
  Status closestPoints(const QueryWorld& world, const std::vector<ClosestQuery>& queries,
                       std::vector<ClosestAnswer>& answers) noexcept override {
    const ZoneSinkScope scope(m_sink);
    return guarded(m_error, [&] { m_engine.closestPoints(world, queries, answers); });
  }
  void reset() noexcept override {
    guarded(m_error, [&] { m_engine.reset(); });
  }
  EngineInfo info() const noexcept override {
    EngineInfo info;
    std::string ignored;
    guarded(ignored, [&] { info = m_engine.info(); });
    return info;
  }
  std::vector<StageProfile> takeProfile() noexcept override {
    std::vector<StageProfile> profile;
    guarded(m_error, [&] { profile = m_engine.takeProfile(m_sink); });
    return profile;
  }
  void setZoneSink(ZoneSink* sink) noexcept override { m_sink = sink; }
  std::string lastError() const noexcept override { return m_error; }

 private:
  ZoneSink* m_sink = nullptr;
  WorldEngine m_engine;
  std::string m_error;
};

class PluginPairSearch final : public PairSearch {
 public:
  PluginPairSearch(const std::string& device, PairFinder finder) : m_search(device, finder) {}

  Status setBodies(const std::vector<BodyInfo>& infos, const std::vector<Aabb>& aabbs) noexcept override {
    return guarded(m_error, [&] { m_search.setBodies(infos, aabbs); });
  }
  Status find(PairSearchTimes& times) noexcept override {
    return guarded(m_error, [&] { times = m_search.find(); });
  }
  Status readKeys(std::vector<ulong>& keys) noexcept override {
    return guarded(m_error, [&] { m_search.readKeys(keys); });
  }
  std::string lastError() const noexcept override { return m_error; }

 private:
  DevicePairSearch m_search;
  std::string m_error;
};

}  // namespace
}  // namespace btgpu

#define BTGPU_EXPORT extern "C" __attribute__((visibility("default")))

BTGPU_EXPORT btgpu::Engine* btgpuCreateEngine(int abi, const btgpu::EngineSettings* settings, btgpu::Status* status,
                                              char* error, size_t errorSize) {
  if (abi != btgpu::kEngineAbi) {
    *status = btgpu::Status::WrongAbi;
    return nullptr;
  }
  btgpu::Engine* engine = nullptr;
  std::string message;
  *status = btgpu::guarded(message, [&] { engine = new btgpu::PluginEngine(*settings); });
  if (errorSize > 0) {
    const size_t length = std::min(message.size(), errorSize - 1);
    std::memcpy(error, message.data(), length);
    error[length] = '\0';
  }
  return engine;
}

BTGPU_EXPORT btgpu::Status btgpuListDevices(int abi, std::vector<btgpu::EngineInfo>* devices) {
  if (abi != btgpu::kEngineAbi) return btgpu::Status::WrongAbi;
  std::string message;
  return btgpu::guarded(message, [&] {
    for (const auto& d : btgpu::ComputeDevice::listDevices()) devices->push_back(btgpu::describeDevice(d));
  });
}

BTGPU_EXPORT btgpu::Status btgpuReplay(int abi, const std::string* file, const btgpu::ReplayOptions* options,
                                       btgpu::ReplayReport* report, std::string* error) {
  if (abi != btgpu::kEngineAbi) return btgpu::Status::WrongAbi;
  return btgpu::guarded(
      *error, [&] { *report = options->onHost ? btgpu::replayOnHost(*file) : btgpu::replayFile(*file, *options); });
}

BTGPU_EXPORT btgpu::Status btgpuCreatePairSearch(int abi, const std::string* device, btgpu::PairFinder finder,
                                                 btgpu::PairSearch** search, std::string* error) {
  *search = nullptr;
  if (abi != btgpu::kEngineAbi) return btgpu::Status::WrongAbi;
  return btgpu::guarded(*error, [&] { *search = new btgpu::PluginPairSearch(*device, finder); });
}
