// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "55_build_islands_reference.h"

#include <queue>

#include "../../kernels/shared/shape.h"
#include "../slots.h"

namespace btgpu {
namespace {

bool has(const BodyInfo& body, uint flag) { return (body.flags & flag) != 0; }

// In an island at all, if only its own.
bool isMember(const BodyInfo& body) {
  return has(body, BODY_PRESENT) && !has(body, BODY_CHILD) && !has(body, BODY_STATIC) && !has(body, BODY_KINEMATIC);
}

// btCollisionObject::mergesSimulationIslands; a quarantined body is as good as absent.
bool merges(const BodyInfo& body) {
  return isMember(body) && !has(body, BODY_NO_RESPONSE) && !has(body, BODY_QUARANTINED);
}

bool keepsAwake(int state) { return state == STATE_ACTIVE || state == STATE_DISABLE_DEACTIVATION; }

// Then islands need not be known.
bool allStayAwake(const std::vector<BodyInfo>& infos, const std::vector<BodyActivation>& activations) {
  for (size_t i = 0; i < infos.size(); ++i) {
    if (isMember(infos[i]) && !keepsAwake(activations[i].state)) return false;
  }
  return true;
}

std::vector<uint> findRoots(const std::vector<BodyInfo>& infos, const std::vector<Pair>& pairs,
                            const std::vector<Joint>& joints) {
  std::vector<std::vector<uint>> neighbours(infos.size());
  const auto join = [&neighbours](uint a, uint b) {
    neighbours[a].push_back(b);
    neighbours[b].push_back(a);
  };
  for (const Pair& pair : pairs) {
    const uint a = ownerOf(infos, pair.bodyA), b = ownerOf(infos, pair.bodyB);
    if (merges(infos[a]) && merges(infos[b])) join(a, b);
  }
  for (const Joint& joint : joints) {
    if (joint.enabled && joint.islandA != NO_INDEX && joint.islandB != NO_INDEX) join(joint.islandA, joint.islandB);
  }
  std::vector<uint> roots(infos.size(), NO_INDEX);
  for (uint start = 0; start < infos.size(); ++start) {
    if (roots[start] != NO_INDEX) continue;
    roots[start] = start;
    std::queue<uint> open;
    for (open.push(start); !open.empty(); open.pop()) {
      for (const uint next : neighbours[open.front()]) {
        if (roots[next] != NO_INDEX) continue;
        roots[next] = start;
        open.push(next);
      }
    }
  }
  return roots;
}

// btCollisionObject::setActivationState.
void setState(BodyActivation& activation, int state) {
  if (activation.state == STATE_DISABLE_DEACTIVATION || activation.state == STATE_DISABLE_SIMULATION) return;
  activation.state = state;
}

// btCollisionObject::isActive.
bool isActive(const BodyActivation& activation) {
  return activation.state != STATE_FIXED_BASE && activation.state != STATE_SLEEPING &&
         activation.state != STATE_DISABLE_SIMULATION;
}

void decideSleep(const std::vector<BodyInfo>& infos, const std::vector<uint>& roots,
                 std::vector<BodyActivation>& activations) {
  std::vector<char> awake(infos.size(), 0);  // by root
  for (uint i = 0; i < infos.size(); ++i) {
    if (isMember(infos[i]) && keepsAwake(activations[i].state)) awake[roots[i]] = 1;
  }
  for (uint i = 0; i < infos.size(); ++i) {
    if (!isMember(infos[i])) continue;
    if (!awake[roots[i]]) {
      setState(activations[i], STATE_SLEEPING);
    } else if (activations[i].state == STATE_SLEEPING) {
      activations[i] = {STATE_WANTS_DEACTIVATION, 0.0f};
    }
  }
}

// A pair whose algorithm has run has a manifold in Bullet, with points or without.
bool isMade(const Manifold& m) { return m.bucket != BUCKET_NONE; }

// btCollisionObject::activate by an awake kinematic body.
void wakeBy(const BodyInfo& waker, const BodyActivation& wakerActivation, const BodyInfo& other,
            BodyActivation& activation) {
  if (!has(waker, BODY_KINEMATIC) || has(waker, BODY_NO_RESPONSE)) return;
  if (wakerActivation.state == STATE_SLEEPING || !isMember(other)) return;
  setState(activation, STATE_ACTIVE);
  activation.deactivationTime = 0.0f;
}

void wake(const StepParams& params, const std::vector<BodyInfo>& infos, const std::vector<Pair>& pairs,
          const std::vector<Manifold>& manifolds, std::vector<BodyActivation>& activations) {
  for (size_t i = 0; i < pairs.size(); ++i) {
    const Pair& pair = pairs[i];
    const uint a = ownerOf(infos, pair.bodyA), b = ownerOf(infos, pair.bodyB);
    if (!isMade(manifolds[i])) continue;
    if ((params.flags & STEP_WAKE_BY_CONTACT) && manifolds[i].pointCount == 0) continue;
    wakeBy(infos[a], activations[a], infos[b], activations[b]);
    wakeBy(infos[b], activations[b], infos[a], activations[a]);
  }
  for (size_t i = pairs.size(); i < manifolds.size() && (params.flags & STEP_WAKE_BY_CONTACT); ++i) {
    const uint a = manifolds[i].bodyA, b = manifolds[i].bodyB;
    if (manifolds[i].pointCount == 0) continue;
    wakeBy(infos[a], activations[a], infos[b], activations[b]);
    wakeBy(infos[b], activations[b], infos[a], activations[a]);
  }
}

bool canMove(const BodyStep& step) { return step.angularVelocity.w != 0.0f; }

}  // namespace

IslandsReference buildIslandsReference(const StepParams& params, const std::vector<BodyInfo>& infos,
                                       const std::vector<BodyStep>& steps,
                                       const std::vector<BodyActivation>& activations, const std::vector<Pair>& pairs,
                                       const std::vector<Manifold>& manifolds, const std::vector<Joint>& joints) {
  IslandsReference out;
  const bool asked = (params.flags & STEP_ISLAND_ROOTS) != 0;
  out.roots = !asked && allStayAwake(infos, activations) ? findRoots(infos, {}, {}) : findRoots(infos, pairs, joints);
  out.activations = activations;
  decideSleep(infos, out.roots, out.activations);
  wake(params, infos, pairs, manifolds, out.activations);

  std::vector<char> islandSolved(infos.size(), 0);  // by root
  for (uint i = 0; i < infos.size(); ++i) {
    if (isMember(infos[i]) && isActive(out.activations[i])) islandSolved[out.roots[i]] = 1;
  }
  out.solved.assign(infos.size(), 0);
  for (uint i = 0; i < infos.size(); ++i) out.solved[i] = isMember(infos[i]) && islandSolved[out.roots[i]];

  const bool oneIsland = (params.flags & STEP_ONE_ISLAND) != 0;
  const auto isSolved = [&](uint body) { return isMember(infos[body]) && islandSolved[out.roots[body]]; };
  for (uint m = 0; m < manifolds.size(); ++m) {
    const uint a = manifolds[m].bodyA, b = manifolds[m].bodyB;
    out.contactPoints += static_cast<uint>(manifolds[m].pointCount);
    if (manifolds[m].pointCount == 0) continue;
    if (!oneIsland && (has(infos[a], BODY_NO_RESPONSE) || has(infos[b], BODY_NO_RESPONSE))) continue;
    if (!isMember(infos[a]) && !isMember(infos[b])) continue;
    if (!canMove(steps[a]) && !canMove(steps[b])) continue;
    if (out.activations[a].state == STATE_SLEEPING && out.activations[b].state == STATE_SLEEPING) continue;
    // btSimulationIslandManager::getIslandId; an island of all is solved as long as one of it is awake.
    const uint island = isMember(infos[a]) ? out.roots[a] : out.roots[b];
    if (oneIsland ? !isSolved(a) && !isSolved(b) : !islandSolved[island]) continue;
    out.constraints.push_back(m);
    // Kinematic bodies that were left with mass are in no island, but the solver moves them.
    for (const uint body : {a, b}) {
      if (!isMember(infos[body]) && canMove(steps[body])) out.solved[body] = 1;
    }
  }
  for (const Joint& joint : joints) {
    // btGetConstraintIslandId.
    const uint member = joint.islandA != NO_INDEX ? joint.islandA : joint.islandB;
    const bool solved = member != NO_INDEX && islandSolved[out.roots[member]];
    out.jointSolved.push_back(solved ? 1 : 0);
    for (const uint body : {joint.bodyA, joint.bodyB}) {
      if (solved && joint.rowCount > 0 && body != NO_INDEX && canMove(steps[body])) out.solved[body] = 1;
    }
  }
  return out;
}

}  // namespace btgpu
