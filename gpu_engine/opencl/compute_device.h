// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cl.h"

namespace btgpu {

class ProgramCache;

// How kernels are built and launched (kernels/lib/kernel.h).
enum class KernelShape { Gpu, Cpu };

struct DeviceDescription {
  int index = 0;                                              // in the order that listDevices gives
  std::string name, vendor, platform, version, driver, type;  // type: "gpu", "cpu" or "accelerator"
  unsigned computeUnits = 0;
  unsigned long globalMemory = 0, largestAllocation = 0, localMemory = 0;  // bytes
};

// Work sizes of one launch.
struct Grid {
  size_t global = 1, local = 1;
  size_t groups() const { return global / local; }
};

// An OpenCL device with its context and programs, shared by all worlds of a process that use it. Thread-safe:
// each world has a queue and kernels of its own.
class ComputeDevice {
 public:
  // All devices, GPUs first, then accelerators, then CPUs; in platform order within each.
  static std::vector<DeviceDescription> listDevices();

  // Opens (or shares) a device. `wanted`: empty for the first one, else an index of listDevices, "gpu", "cpu" or
  // a part of the name in any case; the variable BTGPU_DEVICE stands in for an empty wish. Throws OpenClError.
  // debugKernels: with kernels that check themselves (docs/debugging.md).
  static std::shared_ptr<ComputeDevice> open(const std::string& wanted, bool debugKernels = false);
  // Whether BTGPU_DEBUG_KERNELS asks for them.
  static bool debugKernelsWanted();

  ComputeDevice(cl::Device device, DeviceDescription description, KernelShape shape, bool debugKernels = false);
  ~ComputeDevice();

  const cl::Context& context() const { return m_context; }
  const cl::Device& device() const { return m_device; }
  const DeviceDescription& description() const { return m_description; }
  KernelShape shape() const { return m_shape; }
  bool debugKernels() const { return m_debugKernels; }
  bool correctlyRounded() const { return m_correctlyRounded; }
  ProgramCache& programs() { return *m_programs; }

  // Grid for kernels that loop over `items` items; never more than maxGroups() groups.
  Grid grid(size_t items) const;
  // Grid of kernels that work on contiguous chunks, one a group; `items` is an upper bound.
  Grid chunkGrid(size_t items) const;
  // Grid of a team (kernels/lib/team.h), which loops over `items` items in every round: no more groups than can run at
  // once, and one on what is not a CPU.
  Grid teamGrid(size_t items) const;
  // Whether so little is to be done that on a CPU one work item does it in less time than several launches take to
  // share it out.
  bool isForOne(size_t items) const;
  // Groups of RESIDENT_GROUP work items that wait for each other (kernels/lib/resident.h); 0 where they must not: on
  // what is not an NVIDIA GPU nothing is known of whether groups get to run at the same time, and whether what one
  // writes reaches another in the middle of a launch. The variable BTGPU_RESIDENT_GROUPS says otherwise.
  unsigned residentGroups() const;
  size_t maxGroups() const;
  size_t groupSize() const;

 private:
  static size_t grain(size_t normal);

  cl::Device m_device;
  cl::Context m_context;
  DeviceDescription m_description;
  KernelShape m_shape;
  bool m_debugKernels;
  bool m_correctlyRounded;
  std::unique_ptr<ProgramCache> m_programs;
};

}  // namespace btgpu
