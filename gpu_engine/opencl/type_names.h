// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// How kernels spell the types that cross to the device.
#pragma once

#include "../../kernels/shared/body.h"
#include "../../kernels/shared/bvh.h"
#include "../../kernels/shared/contact.h"
#include "../../kernels/shared/joint.h"
#include "../../kernels/shared/mesh.h"
#include "../../kernels/shared/query.h"
#include "../../kernels/shared/rows.h"
#include "../../kernels/shared/shape.h"
#include "../../kernels/shared/soft.h"
#include "../../kernels/shared/step.h"

namespace btgpu {

template <typename T>
struct TypeName;

#define BTGPU_TYPE_NAME(T)                   \
  template <>                                \
  struct TypeName<T> {                       \
    static constexpr const char* value = #T; \
  };

BTGPU_TYPE_NAME(uint)
BTGPU_TYPE_NAME(ulong)
BTGPU_TYPE_NAME(float)
BTGPU_TYPE_NAME(float4)
BTGPU_TYPE_NAME(Aabb)
BTGPU_TYPE_NAME(BodyActivation)
BTGPU_TYPE_NAME(BodyDamping)
BTGPU_TYPE_NAME(BodyForces)
BTGPU_TYPE_NAME(BodyInfo)
BTGPU_TYPE_NAME(BodyMass)
BTGPU_TYPE_NAME(BodyMaterial)
BTGPU_TYPE_NAME(BodyPose)
BTGPU_TYPE_NAME(BodyStep)
BTGPU_TYPE_NAME(BodyVelocity)
BTGPU_TYPE_NAME(BvhLevels)
BTGPU_TYPE_NAME(ClosestFeatures)
BTGPU_TYPE_NAME(ClosestAnswer)
BTGPU_TYPE_NAME(ClosestQuery)
BTGPU_TYPE_NAME(CompoundChild)
BTGPU_TYPE_NAME(HullEdge)
BTGPU_TYPE_NAME(HullFace)
BTGPU_TYPE_NAME(ItemForm)
BTGPU_TYPE_NAME(ItemPose)
BTGPU_TYPE_NAME(Joint)
BTGPU_TYPE_NAME(JointEffect)
BTGPU_TYPE_NAME(JointRow)
BTGPU_TYPE_NAME(Manifold)
BTGPU_TYPE_NAME(Mesh)
BTGPU_TYPE_NAME(MeshNode)
BTGPU_TYPE_NAME(MeshPart)
BTGPU_TYPE_NAME(MeshTriangle)
BTGPU_TYPE_NAME(Pair)
BTGPU_TYPE_NAME(RawContacts)
BTGPU_TYPE_NAME(Ray)
BTGPU_TYPE_NAME(RayHit)
BTGPU_TYPE_NAME(SeparatingAxis)
BTGPU_TYPE_NAME(Shape)
BTGPU_TYPE_NAME(SlotHeader)
BTGPU_TYPE_NAME(SoftJointRow)
BTGPU_TYPE_NAME(SolverBody)
BTGPU_TYPE_NAME(SolverMass)
BTGPU_TYPE_NAME(StepCounters)
BTGPU_TYPE_NAME(StepParams)
BTGPU_TYPE_NAME(Sweep)
BTGPU_TYPE_NAME(SweepHit)
BTGPU_TYPE_NAME(TriangleContacts)
BTGPU_TYPE_NAME(TriangleHit)

#undef BTGPU_TYPE_NAME

}  // namespace btgpu
