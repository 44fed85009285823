// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "stage_work.h"

#include <functional>
#include <map>

#include "kernels/shared/body.h"
#include "kernels/shared/contact.h"
#include "kernels/shared/rows.h"
#include "kernels/shared/shape.h"

namespace btgpu {
namespace {

template <typename... T>
constexpr double sizes() {
  return static_cast<double>((sizeof(T) + ...));
}

constexpr double kIndex = sizeof(uint), kKey = sizeof(ulong), kLine = 64;  // kLine: the head of a manifold
constexpr double kRows = SLOT_FIELDS * sizeof(float);
// Of a row's fields an iteration changes the impulses: normal, push and one friction a point.
constexpr double kChangedRows = MANIFOLD_POINTS * 3 * sizeof(float);
// A row: two dot products of 3 for each body, the clamp, and two updates of 6.
constexpr double kRowFlops = 45;

Work bodies(const StepSize& s, double bytes, double flops) { return {s.bodies * bytes, s.bodies * flops}; }
Work pairs(const StepSize& s, double bytes, double flops) { return {s.pairs * bytes, s.pairs * flops}; }
Work manifolds(const StepSize& s, double bytes, double flops) { return {s.manifolds * bytes, s.manifolds * flops}; }

Work solverWork(const StepSize& s) {
  // An iteration reads all rows and reads and writes both bodies' velocities: a normal, a push and a friction row a
  // point. At the end the impulses go to the manifolds.
  const double bytes = sizes<SlotHeader>() + kRows + kChangedRows + 4 * sizes<SolverBody>();
  const double flops = 3 * kRowFlops * s.points;
  return {s.iterations * s.manifolds * bytes + s.points * 3 * sizeof(float), s.iterations * flops};
}

using Model = std::function<Work(const StepSize&)>;

const std::map<std::string, Model>& models() {
  constexpr double kPoses = 2 * sizes<BodyPose>();
  static const std::map<std::string, Model> all = {
      {"10_apply_forces",
       [](const StepSize& s) {
         return bodies(s, sizes<BodyInfo, BodyPose, BodyVelocity, BodyForces, BodyMass, BodyDamping, BodyStep>(), 200);
       }},
      {"20_update_aabbs",
       [](const StepSize& s) {
         return bodies(s, sizes<BodyInfo, BodyPose, BodyStep, Aabb, Aabb>() + 2 * sizes<BodyActivation>(), 80);
       }},
      {"30_find_pairs",
       [](const StepSize& s) {
         const Work tree = bodies(s, sizes<BodyInfo, Aabb>(), 0);
         return Work{tree.bytes + s.pairs * kKey, 6 * s.pairs};
       }},
      {"35_group_pairs",
       [](const StepSize& s) { return pairs(s, 2 * kKey + 2 * sizes<BodyInfo>() + sizes<Pair>() + kIndex, 0); }},
      {"44_find_separating_axis",
       [](const StepSize& s) { return pairs(s, sizes<Pair, SeparatingAxis>() + kPoses + kIndex, 600); }},
      {"46_clip_faces",
       [](const StepSize& s) { return manifolds(s, sizes<SeparatingAxis, Pair, RawContacts>() + kPoses, 800); }},
      {"44_find_closest_features",
       [](const StepSize& s) { return pairs(s, sizes<Pair, ClosestFeatures>() + kPoses + kIndex, 3000); }},
      {"46_clip_convex_faces",
       [](const StepSize& s) { return manifolds(s, sizes<ClosestFeatures, Pair, RawContacts>() + kPoses, 800); }},
      {"48_reduce_and_match_contacts",
       [](const StepSize& s) {
         const Work heads = pairs(s, sizes<Pair>() + 2 * kLine, 0);
         return Work{heads.bytes + s.manifolds * (sizes<RawContacts>() + 2 * sizes<Manifold>() + kPoses),
                     s.points * 150};
       }},
      {"55_build_islands",
       [](const StepSize& s) {
         return Work{s.pairs * kLine + s.bodies * (2 * sizes<BodyActivation>() + 3 * kIndex) + s.manifolds * kIndex, 0};
       }},
      {"60_colour_constraints",
       [](const StepSize& s) { return manifolds(s, kIndex + kLine + sizes<SlotHeader>(), 0); }},
      {"65_prepare_contacts",
       [](const StepSize& s) {
         const Work own = bodies(s, sizes<BodyStep, BodyVelocity, SolverBody, SolverMass>(), 60);
         const double bytes = sizes<SlotHeader, Manifold>() + kRows + 2 * sizes<SolverMass, BodyMaterial, BodyPose>();
         return Work{own.bytes + s.manifolds * bytes, own.flops + s.points * 250};
       }},
      {"70_solve_velocities", solverWork},
      {"80_integrate_poses",
       [](const StepSize& s) {
         return bodies(s, sizes<BodyInfo, SolverBody, BodyStep>() + 2 * sizes<BodyPose>() + sizes<BodyVelocity>(), 80);
       }},
      {"90_update_activation",
       [](const StepSize& s) {
         return bodies(s, sizes<BodyInfo, BodyVelocity>() + 2 * sizes<BodyActivation>() + kIndex, 10);
       }},
      {"95_gather_contacts", [](const StepSize& s) { return pairs(s, kLine + kIndex, 0); }},
  };
  return all;
}

}  // namespace

Work workOf(const std::string& stage, const StepSize& size) {
  using Shapes = StepSize::Shapes;
  const bool ofBoxes = stage == "44_find_separating_axis" || stage == "46_clip_faces";
  const bool ofConvex = stage == "44_find_closest_features" || stage == "46_clip_convex_faces";
  if (ofBoxes && size.shapes != Shapes::Boxes) return {};
  if (ofConvex && size.shapes != Shapes::Convex) return {};
  const auto it = models().find(stage);
  return it == models().end() ? Work{} : it->second(size);
}

}  // namespace btgpu
