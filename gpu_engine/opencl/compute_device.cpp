// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "compute_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <mutex>
#include <tuple>

#include "cpu_threads.h"
#include "error.h"
#include "program_cache.h"

namespace btgpu {
namespace {

// A fixed number of chunks on a CPU: it does not depend on the cores, so neither does any result.
constexpr size_t kCpuGroups = 32;
constexpr size_t kGpuGroupSize = 128;
constexpr size_t kCpuGrain = 256;    // fewer items than this are not worth a second work item
constexpr size_t kChunkGrain = 512;  // ... and fewer than this a second chunk
constexpr size_t kOneGrain = 8192;   // ... and fewer than this several launches, one after the other
constexpr size_t kTeamGrain = 128;   // ... or a second member of a team
constexpr size_t kGpuGroupsPerUnit = 4;
constexpr size_t kMinGpuGroups = 64;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

struct FoundDevice {
  cl::Device device;
  DeviceDescription description;
};

// Kernels are OpenCL C 1.2; older drivers are passed over, so that one of them does not hide a good device.
bool speaksOpenClC12(const std::string& version) {  // "OpenCL C 1.2 ..."
  int major = 0, minor = 0;
  return std::sscanf(version.c_str(), "OpenCL C %d.%d", &major, &minor) == 2 && (major > 1 || minor >= 2);
}

bool isUsable(const cl::Device& device) {
  return device.getInfo<CL_DEVICE_AVAILABLE>() && device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>() &&
         speaksOpenClC12(device.getInfo<CL_DEVICE_OPENCL_C_VERSION>());
}

int typeRank(const std::string& type) { return type == "gpu" ? 0 : type == "accelerator" ? 1 : 2; }

FoundDevice describe(const cl::Platform& platform, const cl::Device& device) {
  FoundDevice found;
  found.device = device;
  auto& d = found.description;
  d.name = device.getInfo<CL_DEVICE_NAME>();
  d.vendor = device.getInfo<CL_DEVICE_VENDOR>();
  d.platform = platform.getInfo<CL_PLATFORM_NAME>();
  d.version = device.getInfo<CL_DEVICE_VERSION>();
  d.driver = device.getInfo<CL_DRIVER_VERSION>();
  const auto type = device.getInfo<CL_DEVICE_TYPE>();
  d.type = type & CL_DEVICE_TYPE_GPU ? "gpu" : type & CL_DEVICE_TYPE_ACCELERATOR ? "accelerator" : "cpu";
  d.computeUnits = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  d.globalMemory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  d.largestAllocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  d.localMemory = device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
  return found;
}

// Two threads that ask PoCL 3.1 for its devices for the first time at once get devices that crash or compute
// wrong results later (tests/compat/worlds_on_threads_test.cpp), though the standard calls it safe.
std::mutex& discoveryMutex() {
  static std::mutex mutex;
  return mutex;
}

std::vector<FoundDevice> findDevices() {
  spreadCpuDeviceThreads();
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {
    return {};  // the loader found no platform at all
  }
  std::vector<FoundDevice> found;
  for (const auto& platform : platforms) {
    std::vector<cl::Device> devices;
    try {
      platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
    } catch (const cl::Error&) {
      continue;  // a platform without devices
    }
    for (const auto& device : devices) {
      if (isUsable(device)) { found.push_back(describe(platform, device)); }
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const FoundDevice& a, const FoundDevice& b) {
    return typeRank(a.description.type) < typeRank(b.description.type);
  });
  for (size_t i = 0; i < found.size(); ++i) found[i].description.index = static_cast<int>(i);
  return found;
}

bool isIndex(const std::string& text) {
  return !text.empty() && text.size() < 6 &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c); });
}

const FoundDevice* choose(const std::vector<FoundDevice>& devices, const std::string& wanted) {
  if (wanted.empty()) return &devices.front();
  if (isIndex(wanted)) {
    const size_t index = std::stoul(wanted);
    return index < devices.size() ? &devices[index] : nullptr;
  }
  const std::string wish = lower(wanted);
  for (const auto& d : devices) {
    if (wish == "cpu" || wish == "gpu" ? d.description.type == wish
                                       : lower(d.description.name).find(wish) != std::string::npos) {
      return &d;
    }
  }
  return nullptr;
}

KernelShape chooseShape(const DeviceDescription& description) {
  const std::string wanted = environment("BTGPU_KERNEL_SHAPE");
  if (wanted == "gpu") return KernelShape::Gpu;
  if (wanted == "cpu") return KernelShape::Cpu;
  if (!wanted.empty()) {
    throw OpenClError(OpenClError::Kind::General,
                      fmt::format("BTGPU_KERNEL_SHAPE is '{}': set it to gpu or cpu, or unset it", wanted));
  }
  return description.type == "cpu" ? KernelShape::Cpu : KernelShape::Gpu;
}

}  // namespace

std::vector<DeviceDescription> ComputeDevice::listDevices() {
  const std::lock_guard<std::mutex> lock(discoveryMutex());
  std::vector<DeviceDescription> list;
  for (const auto& found : findDevices()) list.push_back(found.description);
  return list;
}

bool ComputeDevice::debugKernelsWanted() { return environment("BTGPU_DEBUG_KERNELS") == "1"; }

std::shared_ptr<ComputeDevice> ComputeDevice::open(const std::string& wanted, bool debugKernels) {
  static std::map<std::tuple<cl_device_id, KernelShape, bool>, std::weak_ptr<ComputeDevice>> shared;
  const std::lock_guard<std::mutex> lock(discoveryMutex());
  const std::string wish = wanted.empty() ? environment("BTGPU_DEVICE") : wanted;
  const auto devices = findDevices();
  if (devices.empty()) {
    throw OpenClError(OpenClError::Kind::NoDevice,
                      "no OpenCL device: install a driver, for example the package pocl-opencl-icd");
  }
  const FoundDevice* found = choose(devices, wish);
  if (!found) {
    throw OpenClError(OpenClError::Kind::NoDevice,
                      fmt::format("no OpenCL device matches '{}': 'btgpu info' lists those there are", wish));
  }
  const KernelShape shape = chooseShape(found->description);
  auto& entry = shared[{found->device(), shape, debugKernels}];
  auto device = entry.lock();
  if (!device) {
    device = std::make_shared<ComputeDevice>(found->device, found->description, shape, debugKernels);
    entry = device;
  }
  return device;
}

ComputeDevice::ComputeDevice(cl::Device device, DeviceDescription description, KernelShape shape, bool debugKernels)
    : m_device(std::move(device)), m_description(std::move(description)), m_shape(shape), m_debugKernels(debugKernels) {
  try {
    m_context = cl::Context(m_device);
  } catch (const cl::Error& e) { throw makeOpenClError(e.err(), e.what(), m_description.name); }
  m_correctlyRounded = (m_device.getInfo<CL_DEVICE_SINGLE_FP_CONFIG>() & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) != 0;
  m_programs = std::make_unique<ProgramCache>(*this);
}

ComputeDevice::~ComputeDevice() = default;

// Tests set BTGPU_GRAIN low, so that small scenes are spread over several work items too.
size_t ComputeDevice::grain(size_t normal) {
  static const std::string wanted = environment("BTGPU_GRAIN");
  return isIndex(wanted) ? std::max<size_t>(1, std::stoul(wanted)) : normal;
}

size_t ComputeDevice::groupSize() const { return m_shape == KernelShape::Cpu ? 1 : kGpuGroupSize; }

size_t ComputeDevice::maxGroups() const {
  if (m_shape == KernelShape::Cpu) return kCpuGroups;
  return std::max(kMinGpuGroups, m_description.computeUnits * kGpuGroupsPerUnit);
}

Grid ComputeDevice::grid(size_t items) const {
  if (m_shape == KernelShape::Cpu) return {std::clamp<size_t>(items / grain(kCpuGrain), 1, kCpuGroups), 1};
  const size_t groups = std::clamp<size_t>((items + kGpuGroupSize - 1) / kGpuGroupSize, 1, 4 * maxGroups());
  return {groups * kGpuGroupSize, kGpuGroupSize};
}

Grid ComputeDevice::teamGrid(size_t items) const {
  // The CPU shape on a GPU, if somebody asks for it: memory is not ordered between its groups as a team needs it.
  const size_t most = m_description.type == "cpu" ? std::max(1u, m_description.computeUnits) : 1;
  return {std::clamp<size_t>(items / grain(kTeamGrain), 1, most), 1};
}

bool ComputeDevice::isForOne(size_t items) const { return m_shape == KernelShape::Cpu && items < grain(kOneGrain); }

unsigned ComputeDevice::residentGroups() const {
  if (m_shape != KernelShape::Gpu) return 0;
  if (const char* wanted = std::getenv("BTGPU_RESIDENT_GROUPS"))
    return std::min(std::strtoul(wanted, nullptr, 10), 4096ul);
  const bool nvidia = m_description.type == "gpu" && m_description.vendor.find("NVIDIA") != std::string::npos;
  return nvidia ? m_description.computeUnits : 0;
}

Grid ComputeDevice::chunkGrid(size_t items) const {
  const size_t groups = std::clamp<size_t>(items / grain(kChunkGrain), 1, maxGroups());
  return {groups * groupSize(), groupSize()};
}

}  // namespace btgpu
