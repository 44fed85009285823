// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#pragma once

#include "../opencl/kernel.h"
#include "../query_world.h"

namespace btgpu {

// Closest points of many pairs, by stage 44's functions. Keeps the world's shapes on the device until its version
// changes. Waits for the device, unlike a stage of the step.
class ClosestPoints {
 public:
  explicit ClosestPoints(ComputeDevice& device);
  void find(Queue& queue, const QueryWorld& world, const std::vector<ClosestQuery>& queries,
            std::vector<ClosestAnswer>& answers);

 private:
  void upload(Queue& queue, const QueryWorld& world);

  Kernel m_closestPoints;
  std::uint64_t m_version = 0;
  std::vector<float4> m_paddedVertices;
  DeviceArray<Shape> m_shapes{"closest shapes"};
  DeviceArray<float4> m_hullVertices{"closest hull vertices"};
  DeviceArray<HullFace> m_hullFaces{"closest hull faces"};
  DeviceArray<uint> m_hullCorners{"closest hull corners"};
  DeviceArray<HullEdge> m_hullEdges{"closest hull edges"};
  DeviceArray<ClosestQuery> m_queries{"closest queries"};
  DeviceArray<ClosestAnswer> m_answers{"closest answers"};
};

}  // namespace btgpu
