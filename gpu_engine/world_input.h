// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// What goes down the seam: the whole world as contiguous arrays and indices, and which of it changed. Filled by
// translation/ from Bullet's objects; the engine keeps a copy of it on the device. No Bullet and no OpenCL in here.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "../kernels/shared/body.h"
#include "../kernels/shared/contact.h"
#include "../kernels/shared/joint.h"
#include "../kernels/shared/mesh.h"
#include "../kernels/shared/shape.h"

namespace btgpu {

// One array over all bodies with the indices that changed since the last step, ascending, each once.
template <typename T>
struct Tracked {
  std::vector<T> values;
  std::vector<std::uint32_t> changed;
};

// Vertices, faces and edges of all hulls; Shape says which are a hull's own.
struct HullArrays {
  std::vector<float4> vertices;
  std::vector<HullFace> faces;
  std::vector<uint>
      corners;  // of the faces: vertices in turn, anticlockwise from outside, counted from the hull's first
  std::vector<HullEdge> edges;
  bool changed = false;  // since the last step
};

// All meshes; Mesh says what is a mesh's own.
struct MeshArrays {
  std::vector<Mesh> meshes;
  std::vector<MeshTriangle> triangles;
  std::vector<MeshNode> nodes;  // links count from the mesh's first triangle
  std::vector<MeshPart> parts;  // nodes count from the mesh's first node
  bool changed = false;         // since the last step
};

// An AABB that stays as it is.
struct KeptAabb {
  std::uint32_t slot;
  Aabb box;
};

struct WorldInput {
  // Length of every body array: slots in use and free ones (flags without BODY_PRESENT).
  std::uint32_t bodyCount = 0;

  Tracked<BodyInfo> infos;
  Tracked<BodyPose> poses;
  Tracked<BodyVelocity> velocities;
  Tracked<BodyForces> forces;
  Tracked<BodyMass> masses;
  Tracked<BodyMaterial> materials;
  Tracked<BodyDamping> dampings;
  Tracked<BodyActivation> activations;
  std::vector<std::uint32_t> born;  // slots that hold another body than in the last step, ascending

  Tracked<Shape> shapes;  // indexed by BodyInfo::shapeIndex
  // A compound's shapes take slots of their own, with BODY_CHILD and the body's flags, filters and proxy id in their
  // infos; of all that is by body the rest has no meaning there but this: the shape's pose in the body's axes. Length
  // bodyCount, or empty while there are none.
  Tracked<BodyPose> childPoses;
  HullArrays hulls;
  MeshArrays meshes;

  // What the host has found for this step, of pairs with a body whose shape is SHAPE_HOST or that has
  // BODY_HOST_CONTACTS: their manifolds, any number a pair, and the AABBs of the former (by body; empty if there is
  // none), which cover the predicted motion.
  std::vector<Manifold> hostManifolds;
  std::vector<Aabb> hostAabbs;

  // Without StepSettings::forceUpdateAllAabbs inactive bodies keep the AABB that they have, wherever they are moved. Of
  // those that have changed the one that Bullet's broadphase has, as long as that is kept current (hostAabbsCurrent).
  // Not of the shapes of compounds, which meet what is where they are.
  std::vector<KeptAabb> keptAabbs;
  bool hostAabbsCurrent = false;

  // All joints in the world's order and their rows, made anew each step from the poses at its start.
  std::vector<Joint> joints;
  std::vector<JointRow> jointRows;
  std::vector<float> jointImpulses;  // of the last step, by row; empty: none known. For the fast mode

  // Pairs that must not collide (setIgnoreCollisionCheck, joints between linked bodies): sorted keys, lower body index
  // << 32 | higher one. Or, where the application filters pairs by a callback (onlyListedPairs), those alone that may,
  // and behind them, with PAIR_KEEPS_CONTACTS, those that the callback let through and that must not for that reason.
  std::vector<ulong> listedPairs;
  bool onlyListedPairs = false;

  // Origin of the region that all positions are relative to, in world coordinates. When it changes, all poses are
  // in poses.changed.
  double regionOrigin[3] = {0, 0, 0};

  // Manifolds to start from, when the last step ran elsewhere (on the stock CPU path): replaces the device's own.
  // Sorted by (lower, higher) slot; A and B in manifold order. Their bodies are slots: of a compound the one of the
  // shape that touches.
  bool replaceManifolds = false;
  std::vector<Manifold> manifolds;

  // Of a WorldInput or a const one.
  template <typename Input>
  static auto changeLists(Input& in) {
    return std::array{&in.infos.changed,
                      &in.poses.changed,
                      &in.velocities.changed,
                      &in.forces.changed,
                      &in.masses.changed,
                      &in.materials.changed,
                      &in.dampings.changed,
                      &in.activations.changed,
                      &in.shapes.changed,
                      &in.childPoses.changed,
                      &in.born};
  }

  // False if anything of the bodies, shapes, hulls and meshes changed since the last step.
  bool unchanged() const {
    for (const auto* list : changeLists(*this)) {
      if (!list->empty()) return false;
    }
    return !hulls.changed && !meshes.changed && !replaceManifolds;
  }

  void clearChanges() {
    for (auto* list : changeLists(*this)) list->clear();
    hulls.changed = meshes.changed = false;
    replaceManifolds = false;
    manifolds.clear();
  }
};

}  // namespace btgpu
