// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Every shared struct with its size in bytes and all its fields, for the checks that both sides lay them out
// alike: static_asserts on the host (gpu_engine/opencl/struct_sizes.cpp), and the offsets that a kernel
// reports (tests/regression/struct_layout_test.cpp).
#ifndef BTGPU_SHARED_STRUCT_FIELDS_H
#define BTGPU_SHARED_STRUCT_FIELDS_H
#include "body.h"
#include "bvh.h"
#include "contact.h"
#include "debug.h"
#include "joint.h"
#include "mesh.h"
#include "query.h"
#include "rows.h"
#include "shape.h"
#include "soft.h"
#include "step.h"

// For each struct SIZE(struct, bytes), followed by FIELD(struct, field) for its fields in order.
// clang-format off
#define SHARED_STRUCTS(SIZE, FIELD)                                                                         \
  SIZE(BodyPose, 32)                                                                                        \
    FIELD(BodyPose, position) FIELD(BodyPose, orientation)                                                  \
  SIZE(BodyVelocity, 32)                                                                                    \
    FIELD(BodyVelocity, linear) FIELD(BodyVelocity, angular)                                                \
  SIZE(BodyForces, 32)                                                                                      \
    FIELD(BodyForces, force) FIELD(BodyForces, torque)                                                      \
  SIZE(BodyMass, 48)                                                                                        \
    FIELD(BodyMass, inverseInertiaLocal) FIELD(BodyMass, linearFactor) FIELD(BodyMass, angularFactor)       \
  SIZE(BodyMaterial, 48)                                                                                    \
    FIELD(BodyMaterial, friction) FIELD(BodyMaterial, rollingFriction)                                      \
    FIELD(BodyMaterial, spinningFriction) FIELD(BodyMaterial, restitution)                                  \
    FIELD(BodyMaterial, contactStiffness) FIELD(BodyMaterial, contactDamping)                               \
    FIELD(BodyMaterial, contactProcessingThreshold) FIELD(BodyMaterial, unused)                             \
    FIELD(BodyMaterial, anisotropicFriction)                                                                \
  SIZE(BodyDamping, 32)                                                                                     \
    FIELD(BodyDamping, linear) FIELD(BodyDamping, angular) FIELD(BodyDamping, additionalFactor)             \
    FIELD(BodyDamping, additionalLinearThresholdSqr) FIELD(BodyDamping, additionalAngularThresholdSqr)      \
    FIELD(BodyDamping, unused) FIELD(BodyDamping, linearSleepingThreshold)                                  \
    FIELD(BodyDamping, angularSleepingThreshold)                                                            \
  SIZE(BodyInfo, 32)                                                                                        \
    FIELD(BodyInfo, shapeIndex) FIELD(BodyInfo, flags) FIELD(BodyInfo, filterGroup)                         \
    FIELD(BodyInfo, filterMask) FIELD(BodyInfo, uniqueId) FIELD(BodyInfo, parent)                           \
    FIELD(BodyInfo, child) FIELD(BodyInfo, depth)                                                                  \
  SIZE(BodyActivation, 8)                                                                                   \
    FIELD(BodyActivation, state) FIELD(BodyActivation, deactivationTime)                                    \
  SIZE(BodyStep, 144)                                                                                       \
    FIELD(BodyStep, linearVelocity) FIELD(BodyStep, angularVelocity) FIELD(BodyStep, externalLinear)        \
    FIELD(BodyStep, externalAngular) FIELD(BodyStep, inverseInertia0) FIELD(BodyStep, inverseInertia1)      \
    FIELD(BodyStep, inverseInertia2) FIELD(BodyStep, predictedPosition)                                     \
    FIELD(BodyStep, predictedOrientation)                                                                   \
  SIZE(SolverBody, 64)                                                                                      \
    FIELD(SolverBody, deltaLinear) FIELD(SolverBody, deltaAngular) FIELD(SolverBody, pushLinear)            \
    FIELD(SolverBody, turnAngular)                                                                          \
  SIZE(SolverMass, 48)                                                                                      \
    FIELD(SolverMass, row0) FIELD(SolverMass, row1) FIELD(SolverMass, row2)                                 \
  SIZE(Aabb, 32)                                                                                            \
    FIELD(Aabb, lower) FIELD(Aabb, upper)                                                                   \
  SIZE(BvhLevels, 128)                                                                                      \
    FIELD(BvhLevels, levelCount) FIELD(BvhLevels, first) FIELD(BvhLevels, size) FIELD(BvhLevels, unused)    \
  SIZE(Pair, 16)                                                                                            \
    FIELD(Pair, bodyA) FIELD(Pair, bodyB) FIELD(Pair, oldManifold) FIELD(Pair, bucket)                      \
  SIZE(SeparatingAxis, 32)                                                                                  \
    FIELD(SeparatingAxis, normal) FIELD(SeparatingAxis, code) FIELD(SeparatingAxis, unused)                 \
  SIZE(ClosestFeatures, 48)                                                                                 \
    FIELD(ClosestFeatures, normal) FIELD(ClosestFeatures, onA) FIELD(ClosestFeatures, onB)                  \
  SIZE(RawContacts, 160)                                                                                    \
    FIELD(RawContacts, normal) FIELD(RawContacts, points) FIELD(RawContacts, count)                         \
    FIELD(RawContacts, axis) FIELD(RawContacts, unused)                                                     \
  SIZE(ContactPoint, 112)                                                                                   \
    FIELD(ContactPoint, localPointA) FIELD(ContactPoint, localPointB) FIELD(ContactPoint, normalWorldOnB)   \
    FIELD(ContactPoint, lateralFrictionDir1) FIELD(ContactPoint, lateralFrictionDir2)                       \
    FIELD(ContactPoint, combined) FIELD(ContactPoint, combinedStiffness)                                    \
    FIELD(ContactPoint, combinedDamping) FIELD(ContactPoint, lifeTime) FIELD(ContactPoint, flags)           \
  SIZE(Manifold, 480)                                                                                       \
    FIELD(Manifold, bodyA) FIELD(Manifold, bodyB) FIELD(Manifold, pointCount) FIELD(Manifold, bucket)       \
    FIELD(Manifold, breakingThreshold) FIELD(Manifold, processingThreshold) FIELD(Manifold, unseen)         \
    FIELD(Manifold, axis) FIELD(Manifold, points)                                                           \
  SIZE(Joint, 48)                                                                                           \
    FIELD(Joint, bodyA) FIELD(Joint, bodyB) FIELD(Joint, islandA) FIELD(Joint, islandB)                     \
    FIELD(Joint, firstRow) FIELD(Joint, rowCount) FIELD(Joint, iterations) FIELD(Joint, enabled)            \
    FIELD(Joint, damping) FIELD(Joint, leastMobility) FIELD(Joint, equalRows)                               \
    FIELD(Joint, boundRows)                                                                                 \
  SIZE(JointRow, 64)                                                                                        \
    FIELD(JointRow, linearA) FIELD(JointRow, angularA) FIELD(JointRow, linearB) FIELD(JointRow, angularB)   \
  SIZE(JointEffect, 8)                                                                                      \
    FIELD(JointEffect, jac) FIELD(JointEffect, rhs)                                                         \
  SIZE(SoftJointRow, 8)                                                                                     \
    FIELD(SoftJointRow, wanted) FIELD(SoftJointRow, impulse)                                                \
  SIZE(SlotHeader, 16)                                                                                      \
    FIELD(SlotHeader, bodyA) FIELD(SlotHeader, bodyB) FIELD(SlotHeader, manifold)                           \
    FIELD(SlotHeader, pointCount)                                                                           \
  SIZE(Shape, 96)                                                                                           \
    FIELD(Shape, type) FIELD(Shape, margin) FIELD(Shape, breakingThreshold) FIELD(Shape, variant)           \
    FIELD(Shape, extents) FIELD(Shape, centre) FIELD(Shape, firstVertex) FIELD(Shape, vertexCount)          \
    FIELD(Shape, firstFace) FIELD(Shape, faceCount) FIELD(Shape, firstEdge) FIELD(Shape, edgeCount)         \
    FIELD(Shape, radius) FIELD(Shape, halfLength) FIELD(Shape, boundsMargins) FIELD(Shape, unused)          \
  SIZE(Ray, 48)                                                                                             \
    FIELD(Ray, from) FIELD(Ray, to) FIELD(Ray, filterGroup) FIELD(Ray, filterMask) FIELD(Ray, flags)        \
    FIELD(Ray, ignored)                                                                                     \
  SIZE(ItemPose, 48)                                                                                        \
    FIELD(ItemPose, row0) FIELD(ItemPose, row1) FIELD(ItemPose, row2)                                       \
  SIZE(ItemForm, 32)                                                                                        \
    FIELD(ItemForm, scaling) FIELD(ItemForm, child) FIELD(ItemForm, flags) FIELD(ItemForm, firstSphere)     \
    FIELD(ItemForm, sphereCount)                                                                            \
  SIZE(Sweep, 128)                                                                                          \
    FIELD(Sweep, from) FIELD(Sweep, to) FIELD(Sweep, orientation) FIELD(Sweep, turn) FIELD(Sweep, lower)    \
    FIELD(Sweep, upper) FIELD(Sweep, filterGroup) FIELD(Sweep, filterMask) FIELD(Sweep, ignored)            \
    FIELD(Sweep, shape) FIELD(Sweep, allowedPenetration) FIELD(Sweep, unused)                               \
  SIZE(SweepHit, 48)                                                                                        \
    FIELD(SweepHit, normal) FIELD(SweepHit, point) FIELD(SweepHit, object) FIELD(SweepHit, unused)          \
  SIZE(RayHit, 32)                                                                                          \
    FIELD(RayHit, normal) FIELD(RayHit, object) FIELD(RayHit, part) FIELD(RayHit, triangle)                 \
    FIELD(RayHit, unused)                                                                                   \
  SIZE(CompoundChild, 128)                                                                                  \
    FIELD(CompoundChild, pose) FIELD(CompoundChild, objectAabb) FIELD(CompoundChild, childAabb)             \
    FIELD(CompoundChild, child) FIELD(CompoundChild, unused)                                                \
  SIZE(ClosestQuery, 112)                                                                                   \
    FIELD(ClosestQuery, poseA) FIELD(ClosestQuery, poseB) FIELD(ClosestQuery, shapeA)                       \
    FIELD(ClosestQuery, shapeB) FIELD(ClosestQuery, radiusB) FIELD(ClosestQuery, limit)                     \
  SIZE(ClosestAnswer, 64)                                                                                   \
    FIELD(ClosestAnswer, onA) FIELD(ClosestAnswer, onB) FIELD(ClosestAnswer, normal)                        \
    FIELD(ClosestAnswer, found) FIELD(ClosestAnswer, unused)                                                \
  SIZE(HullFace, 32)                                                                                        \
    FIELD(HullFace, plane) FIELD(HullFace, firstCorner) FIELD(HullFace, cornerCount)                        \
    FIELD(HullFace, unused)                                                                                 \
  SIZE(HullEdge, 48)                                                                                        \
    FIELD(HullEdge, normalA) FIELD(HullEdge, normalB) FIELD(HullEdge, from) FIELD(HullEdge, to)             \
    FIELD(HullEdge, unused)                                                                                 \
  SIZE(StepParams, 84)                                                                                      \
    FIELD(StepParams, timeStep) FIELD(StepParams, flags) FIELD(StepParams, erp2)                            \
    FIELD(StepParams, globalCfm) FIELD(StepParams, splitImpulsePenetrationThreshold)                        \
    FIELD(StepParams, splitImpulseTurnErp) FIELD(StepParams, linearSlop)                                    \
    FIELD(StepParams, warmStartingFactor) FIELD(StepParams, sor)                                            \
    FIELD(StepParams, restitutionVelocityThreshold) FIELD(StepParams, maxGyroscopicForce)                   \
    FIELD(StepParams, contactThreshold) FIELD(StepParams, deactivationTime)                                 \
    FIELD(StepParams, hostManifoldCount) FIELD(StepParams, substeps) FIELD(StepParams, contactHertz)        \
    FIELD(StepParams, contactDampingRatio) FIELD(StepParams, pushSpeed)                                     \
    FIELD(StepParams, jointHertz) FIELD(StepParams, jointDampingRatio) FIELD(StepParams, frictionErp)       \
  SIZE(StepCounters, 64)                                                                                    \
    FIELD(StepCounters, overflow) FIELD(StepCounters, pairCount) FIELD(StepCounters, constraintCount)       \
    FIELD(StepCounters, slotCount) FIELD(StepCounters, colourCount) FIELD(StepCounters, serialCount)        \
    FIELD(StepCounters, triangleHits) FIELD(StepCounters, colourRounds) FIELD(StepCounters, contactPoints)    \
    FIELD(StepCounters, quarantined) FIELD(StepCounters, boxOverlaps) FIELD(StepCounters, outOfBounds)      \
    FIELD(StepCounters, touchingCount) FIELD(StepCounters, freshCount) FIELD(StepCounters, largeColours) \
    FIELD(StepCounters, bouncing)                                                                           \
  SIZE(Mesh, 64)                                                                                            \
    FIELD(Mesh, lower) FIELD(Mesh, perStep) FIELD(Mesh, firstTriangle) FIELD(Mesh, triangleCount)           \
    FIELD(Mesh, firstNode) FIELD(Mesh, nodeCount) FIELD(Mesh, firstPart) FIELD(Mesh, partCount)             \
    FIELD(Mesh, unused)                                                                                     \
  SIZE(MeshNode, 16)                                                                                        \
    FIELD(MeshNode, x) FIELD(MeshNode, y) FIELD(MeshNode, z) FIELD(MeshNode, link)                          \
  SIZE(MeshPart, 8)                                                                                         \
    FIELD(MeshPart, firstNode) FIELD(MeshPart, nodeCount)                                                   \
  SIZE(MeshTriangle, 64)                                                                                    \
    FIELD(MeshTriangle, a) FIELD(MeshTriangle, b) FIELD(MeshTriangle, c) FIELD(MeshTriangle, part)          \
    FIELD(MeshTriangle, index) FIELD(MeshTriangle, unused)                                                  \
  SIZE(TriangleHit, 8)                                                                                      \
    FIELD(TriangleHit, pair) FIELD(TriangleHit, triangle)                                                   \
  SIZE(TriangleContacts, 80)                                                                                \
    FIELD(TriangleContacts, normal) FIELD(TriangleContacts, points)                                         \
  SIZE(DebugRecord, 992)                                                                                    \
    FIELD(DebugRecord, failures) FIELD(DebugRecord, kind) FIELD(DebugRecord, line) FIELD(DebugRecord, item) \
    FIELD(DebugRecord, values) FIELD(DebugRecord, arrayCount) FIELD(DebugRecord, unused)                    \
    FIELD(DebugRecord, names) FIELD(DebugRecord, lengths) FIELD(DebugRecord, file) FIELD(DebugRecord, text)
// clang-format on

#endif
