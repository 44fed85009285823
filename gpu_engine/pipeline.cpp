// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "pipeline.h"

#include <algorithm>

namespace btgpu {

WorldTraits traitsOf(const WorldInput& input) {
  WorldTraits traits;
  for (const Shape& shape : input.shapes.values) traits.shapeTypes |= 1u << shape.type;
  traits.torsionRows = std::any_of(input.materials.values.begin(), input.materials.values.end(),
                                   [](const BodyMaterial& m) { return m.rollingFriction != 0.0f; });
  return traits;
}

Pipeline::Pipeline(ComputeDevice& device)
    : m_followSubstep(device),
      m_applyForces(device),
      m_updateAabbs(device),
      m_findPairs(device),
      m_groupPairs(device),
      m_findSeparatingAxis(device),
      m_clipFaces(device),
      m_findClosestFeatures(device),
      m_reduceAndMatchContacts(device),
      m_appendHostContacts(device),
      m_buildIslands(device),
      m_colourConstraints(device),
      m_prepareContacts(device),
      m_solveVelocities(device),
      m_integratePoses(device),
      m_updateActivation(device),
      m_gatherContacts(device) {}

void Pipeline::enqueueStep(Queue& queue, DeviceWorld& world, const StepSettings& settings, const WorldTraits& traits) {
  const bool boxes = traits.has(SHAPE_BOX);
  m_applyForces.enqueue(queue, world);                           // 10
  m_updateAabbs.enqueue(queue, world);                           // 20
  m_findPairs.enqueue(queue, world);                             // 30
  m_groupPairs.enqueue(queue, world);                            // 35
  m_collidePrimitives.enqueue(queue, world, traits.shapeTypes);  // 42
  if (boxes) m_findSeparatingAxis.enqueue(queue, world);         // 44
  if (boxes) m_clipFaces.enqueue(queue, world);                  // 46
  if (traits.convexPairs()) {
    m_findClosestFeatures.enqueue(queue, world);  // 44
    m_clipConvexFaces.enqueue(queue, world);      // 46
  }
  m_reduceAndMatchContacts.enqueue(queue, world);                               // 48
  if (world.hostManifoldCount > 0) m_appendHostContacts.enqueue(queue, world);  // 50
  if (settings.keepContacts) world.keepMatchedManifolds(queue);
  if (world.jointCount > 0) m_prepareJoints.enqueue(queue, world);                             // 52
  m_buildIslands.enqueue(queue, world);                                                        // 55
  m_colourConstraints.enqueue(queue, world);                                                   // 60
  m_prepareContacts.enqueue(queue, world);                                                     // 65
  m_solveVelocities.enqueue(queue, world, settings, traits.torsionRows);                       // 70
  m_integratePoses.enqueue(queue, world);                                                      // 80
  m_updateActivation.enqueue(queue, world);                                                    // 90
  if (settings.sendsContacts()) m_gatherContacts.enqueue(queue, world, settings.allContacts);  // 95
}

}  // namespace btgpu
