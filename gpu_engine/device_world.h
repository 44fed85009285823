// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Every array that a world has on the device: what it holds, how long it is, and who writes it.
#pragma once

#include "../kernels/shared/soft.h"
#include "joint_colours.h"
#include "opencl/kernel.h"
#include "solver_variants.h"
#include "step_settings.h"
#include "world_input.h"

namespace btgpu {

// How much room there is for what a step finds out on the device. Grown when a step overflows.
struct Capacities {
  size_t bodies = 0;
  size_t pairs = 0;
  size_t slots = 0;         // constraint slots, padding included
  uint colourLaunches = 0;  // colours that get a launch of their own (GPU shape); all others share one
  uint colourRounds = 0;    // colouring rounds launched a step (GPU shape)
  size_t triangleHits = 0;  // triangles of meshes near other shapes
  uint residentGroups = 0;  // of a solver that is one launch (GPU shape); 0: a launch a colour
  uint colourGroups = 0;    // of a colouring that is one launch (GPU shape); 0: a launch a round
};

struct DeviceWorld {
  // ---- state that lives from step to step; length bodies ------------------------------------------------------------
  DeviceArray<BodyInfo> infos{"infos"};                    // host; stage 80 sets BODY_QUARANTINED
  DeviceArray<BodyPose> poses{"poses"};                    // host, stage 80
  DeviceArray<BodyVelocity> velocities{"velocities"};      // host, stages 80 and 90
  DeviceArray<BodyActivation> activations{"activations"};  // host, stage 90
  DeviceArray<BodyForces> forces{"forces"};                // host
  DeviceArray<BodyMass> masses{"masses"};                  // host
  DeviceArray<BodyMaterial> materials{"materials"};        // host
  DeviceArray<BodyDamping> dampings{"dampings"};           // host
  DeviceArray<Shape> shapes{"shapes"};                     // host; length: shapes
  DeviceArray<BodyPose> childPoses{"child poses"};         // host; of slots with BODY_CHILD; empty if there are none
  DeviceArray<Aabb> hostAabbs{"host aabbs"};               // host; of bodies whose shape is SHAPE_HOST; 1 if none is

  // All hulls, one behind the other (WorldInput::hulls).
  DeviceArray<float4> hullVertices{"hull vertices"};  // host
  DeviceArray<HullFace> hullFaces{"hull faces"};      // host
  DeviceArray<uint> hullCorners{"hull corners"};      // host
  DeviceArray<HullEdge> hullEdges{"hull edges"};      // host

  // All meshes, likewise (WorldInput::meshes).
  DeviceArray<Mesh> meshes{"meshes"};                         // host
  DeviceArray<MeshTriangle> meshTriangles{"mesh triangles"};  // host
  DeviceArray<MeshNode> meshNodes{"mesh nodes"};              // host
  DeviceArray<MeshPart> meshParts{"mesh parts"};              // host
  uint mostMeshParts = 0;                                     // of one mesh

  // The last step's result, read by the next one. Each has a twin that the running step writes; the two are
  // swapped when the step has succeeded, so a step can be repeated from an untouched state.
  DeviceArray<Aabb> oldAabbs{"old aabbs"};              // bodies
  DeviceArray<ulong> oldKeys{"old pair keys"};          // pairs; sorted (lower << 32 | higher body index)
  DeviceArray<uint> oldPairCount{"old pair count"};     // 1
  DeviceArray<Manifold> oldManifolds{"old manifolds"};  // pairs

  // A third of each, made when a step is first launched on top of one that still runs: that one's start is kept here,
  // in case it has to be repeated.
  DeviceArray<Aabb> spareAabbs{"spare aabbs"};
  DeviceArray<ulong> sparePairKeys{"spare pair keys"};
  DeviceArray<uint> sparePairCount{"spare pair count"};
  DeviceArray<Manifold> spareManifolds{"spare manifolds"};

  // ---- one step; length bodies --------------------------------------------------------------------------------------
  DeviceArray<uint> born{"born"};        // host: 1 where the slot's body is newer than the manifolds of the last step
  DeviceArray<BodyStep> steps{"steps"};  // stage 10
  DeviceArray<Aabb> aabbs{"aabbs"};      // stage 20
  DeviceArray<BodyActivation> stepActivations{"step activations"};  // stages 20 and 55
  DeviceArray<uint> roots{"island roots"};                          // stage 55: lowest body index of the island
  DeviceArray<uint> islandFlags{"island flags"};                    // stage 55, at the roots
  DeviceArray<uint> solved{"solved"};                               // stage 55: 1 where the solver writes the body back
  DeviceArray<SolverBody> solverBodies{"solver bodies"};            // stages 65 and 70
  DeviceArray<SolverMass> solverMasses{"solver masses"};            // stage 65

  // ---- one step; length pairs ---------------------------------------------------------------------------------------
  DeviceArray<ulong> keys{"pair keys"};                         // stage 30, sorted
  DeviceArray<uint> pairCount{"pair count"};                    // 1; stage 30; may exceed the capacity
  DeviceArray<Pair> pairs{"pairs"};                             // stage 35
  DeviceArray<uint> items{"pair items"};                        // stage 35: pair indices bucket by bucket
  DeviceArray<uint> bucketFirst{"bucket starts"};               // BUCKET_COUNT + 1; stage 35
  DeviceArray<RawContacts> contacts{"contact candidates"};      // stages 42, 44 and 46
  DeviceArray<SeparatingAxis> axes{"separating axes"};          // stage 44; by position in the box-box bucket
  DeviceArray<ClosestFeatures> closest{"closest features"};     // stage 44; by position among the convex pairs
  DeviceArray<uint> nearPairs{"convex pairs near each other"};  // stage 44: such positions, ascending
  DeviceArray<uint> nearCount{"count of near convex pairs"};    // 1; stage 44
  // Triangles near the shapes of pairs in BUCKET_MESH. Searches: triangleGroups a pair, side by side.
  DeviceArray<uint> triangleFound{"triangles found"};                  // stage 40, by search: how many
  DeviceArray<uint> triangleFirst{"triangle starts"};                  // stage 40, by search: where they begin
  DeviceArray<TriangleHit> triangleHits{"triangle hits"};              // stage 40
  DeviceArray<TriangleContacts> triangleTouches{"triangle contacts"};  // stage 47, by hit
  uint triangleGroups = 1;
  // One a pair, then those of the host: manifoldCount in all, if there are any of the host.
  DeviceArray<Manifold> manifolds{"manifolds"};                 // stages 48, 50, 65 and 70
  DeviceArray<Manifold> hostManifolds{"host manifolds"};        // host
  DeviceArray<uint> manifoldCount{"manifold count"};            // 1; stage 50
  DeviceArray<Manifold> matchedManifolds{"matched manifolds"};  // copy after stage 48, if wanted
  DeviceArray<uint> constraints{"constraints"};                 // stage 55: manifolds that are solved, ascending
  DeviceArray<uint> constraintCount{"constraint count"};        // 1; stage 55

  // Indices of manifolds, ascending, if the host wants contacts: those with points; of these, the ones that it is sent.
  DeviceArray<uint> touching{"touching manifolds"}, fresh{"fresh manifolds"};  // stage 95

  DeviceArray<ulong> listedPairs{"ignored pairs"};  // host: sorted keys of pairs that must not collide
  uint listedCount = 0;
  bool onlyListed = false;  // ... of those alone that may
  uint listed() const { return listedCount | (onlyListed ? LISTED_ONLY : 0u); }

  // ---- joints, in the world's order ---------------------------------------------------------------------------------
  DeviceArray<Joint> joints{"joints"};                     // host
  DeviceArray<JointRow> jointRows{"joint rows"};           // host
  DeviceArray<uint> jointOrder{"joint order"};             // host: joints colour by colour
  DeviceArray<JointEffect> jointEffects{"joint effects"};  // stage 52, by row
  DeviceArray<float> jointImpulses{"joint impulses"};      // stages 52 and 70, by row
  DeviceArray<uint> jointSolved{"joints solved"};          // stage 55: 1 where the joint's island is awake
  // CPU shape: joints side by side in blocks (kernels/shared/joint.h).
  DeviceArray<uint> jointBlockColours{"joint block colours"};  // host: JointBlocks
  DeviceArray<uint> jointLanes{"joint lanes"};                 // likewise
  DeviceArray<uint> jointBlockRows{"joint block rows"};        // likewise
  DeviceArray<uint> jointHeads{"joint heads"};                 // stage 70; JOINT_HEAD_FIELDS a lane
  DeviceArray<float> jointLaneRows{"joint lane rows"};         // stage 70; JOINT_ROW_FIELDS a row and lane
  // Fast mode, by row: impulses of the last step, and the rows of the substeps.
  DeviceArray<float> lastJointImpulses{"last joint impulses"};    // host
  DeviceArray<SoftJointRow> softJointRows{"joint substep rows"};  // stage 70
  uint jointCount = 0;
  JointColours jointColours;  // of jointOrder
  int jointIterations = 0;    // most that a joint wants

  // ---- one step; length slots, in blocks of BTGPU_LANES -------------------------------------------------------------
  DeviceArray<uint> slotFirst{"slot starts"};           // COLOUR_TABLE; stage 60
  DeviceArray<SlotHeader> slots{"slots"};               // stage 60
  DeviceArray<float> rows{"rows"};                      // stages 65 and 70; SLOT_FIELDS a slot
  DeviceArray<float> tangent2{"second friction rows"};  // SLOT_TANGENT2_FIELDS a slot, if used
  DeviceArray<float> torsion{"torsional rows"};         // SLOT_TORSION_FIELDS a slot, if used
  DeviceArray<uint> solverTeam{"solver team"};          // TEAM_SIZE; stage 70
  // Fast mode.
  DeviceArray<float> softRows{"soft rows"};           // stages 65 and 70; SLOT_SOFT_FIELDS a slot
  DeviceArray<float> rolls{"rolling friction rows"};  // likewise, SLOT_ROLL_FIELDS a slot, if used
  DeviceArray<BodyVelocity> substepStarts{
      "starts of substeps"};  // stages 65 and 70, by body: velocity without impulses

  SplitArrays split;
  BatchArrays batches;

  // ---- the step itself ----------------------------------------------------------------------------------------------
  DeviceArray<StepParams> params{"step params"};        // 1; host
  DeviceArray<StepCounters> counters{"step counters"};  // 1; all stages

  Capacities capacities;
  size_t bodyCount = 0;
  uint hostManifoldCount = 0;

  // f(array) for each of the above.
  template <typename F>
  void forEachArray(const F& f) const {
    const auto all = [&](const auto&... arrays) { (f(arrays), ...); };
    all(infos, poses, velocities, activations, forces, masses, materials, dampings, shapes, childPoses, hostAabbs);
    all(hullVertices, hullFaces, hullCorners, hullEdges, meshes, meshTriangles, meshNodes, meshParts);
    all(oldAabbs, oldKeys, oldPairCount, oldManifolds, spareAabbs, sparePairKeys, sparePairCount, spareManifolds);
    all(born, steps, aabbs, stepActivations, roots, islandFlags, solved, solverBodies, solverMasses);
    all(keys, pairCount, pairs, items, bucketFirst, contacts, axes);
    all(triangleFound, triangleFirst, triangleHits, triangleTouches);
    all(closest, nearPairs, nearCount, manifolds, hostManifolds, manifoldCount, matchedManifolds);
    all(constraints, constraintCount, touching, fresh, listedPairs);
    all(joints, jointRows, jointOrder, jointEffects, jointImpulses, jointSolved, lastJointImpulses, softJointRows);
    all(jointBlockColours, jointLanes, jointBlockRows, jointHeads, jointLaneRows);
    all(slotFirst, slots, rows, tangent2, torsion, solverTeam, softRows, rolls, substepStarts, params, counters);
    all(split.copyFirst, split.joints, split.copies, split.copyMasses, split.jointRows);
    all(batches.split, batches.groupBatches, batches.batchFirst);
  }

  // Makes every array as long as `wanted` asks for. Contents of the one-step arrays are lost.
  void reserve(Queue& queue, const Capacities& wanted, bool twoFriction, bool torsionRows);
  // After reserve(): room for what the fast mode needs besides.
  void reserveSubsteps(Queue& queue, bool torsionRows);

  // Brings everything that changed in `input` to the device, without waiting.
  void upload(Queue& queue, const WorldInput& input);
  // Without setForceUpdateAllAabbs, bodies at rest keep the AABB of an earlier step. After upload(): takes those that
  // the input brings, and forgets the others that the application's changes made wrong.
  void keepAabbs(Queue& queue, const WorldInput& input);

  // Copies the manifolds as stage 48 left them, before the solver changes their impulses.
  void keepMatchedManifolds(Queue& queue);

  // In a debug build of the kernels, before a step: fills what the step is to write with DEBUG_PATTERN, so that what it
  // does not write shows.
  void spoilStepArrays(Queue& queue);

  // After a successful step: its results become the last step's.
  void swapStepResults();

  // Before a step is launched on top of the running one: the running one's results become the last step's, and what it
  // started from is put aside. retreat() undoes it.
  void advance(Queue& queue);
  void retreat();
  void dropSpare();

  // True if the world on the device is already what a step from `input` would upload.
  bool holds(const WorldInput& input) const;
  // The next upload() brings all of the state that a step changes.
  void forgetBodies(Queue& queue);
  // The next upload() brings everything: an earlier one may have broken off. What the last step left stays.
  void forgetUploads(Queue& queue);

 private:
  void swapWithSpare();
  void uploadHulls(Queue& queue, const HullArrays& hulls);
  void uploadManifolds(Queue& queue, const WorldInput& input);
  void uploadMeshes(Queue& queue, const MeshArrays& arrays);
  void uploadJoints(Queue& queue, const WorldInput& input);
  void uploadLastImpulses(Queue& queue, const WorldInput& input);
  void colourJoints(Queue& queue, const WorldInput& input);
  void layJoints(Queue& queue, const std::vector<Joint>& joints);
  void forgetStaleAabbs(Queue& queue, const WorldInput& input);
  void uploadBorn(Queue& queue, const std::vector<std::uint32_t>& bornNow, bool manifoldsKnowThem);

  // Host copies of uploads that may still be pending.
  std::vector<uint> m_bornFlags, m_count;
  std::vector<ulong> m_keys;
  std::vector<Manifold> m_manifolds;
  std::vector<float> m_lastJointImpulses;
  std::vector<Aabb> m_noAabbs;
  bool m_noLastImpulses = false;  // m_lastJointImpulses are zeros
  bool m_begun = false;           // what has to be there before the first step is
  bool m_anyBorn = false;
  size_t m_knownAabbs = 0;  // of oldAabbs, those that were written
  std::vector<Joint> m_colouredJoints;
  JointBlocks m_jointBlocks;
  std::vector<uint> m_laidRowCounts;     // by joint, of m_jointBlocks; empty: none
  std::vector<float4> m_paddedVertices;  // of all hulls, with HULL_PADDING; the queue reads them later
  std::vector<ulong> m_listedPairs;
};

}  // namespace btgpu
