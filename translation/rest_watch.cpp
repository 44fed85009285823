// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "rest_watch.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "../gpu_engine/zone.h"
#include "hash.h"
#include "parallel.h"
#include "prefetch.h"
#include "private_access.h"
#include "read_world.h"

BTGPU_TRANSLATION_BEGIN
namespace {

constexpr std::size_t kGrain = 512;  // objects

// A hash of 64 bits, four words at a time: whoever changes a bit of what goes into it changes it, but for one time in
// 2^64.
class Mark {
 public:
  template <typename T>
  void add(const T& value) {
    static_assert(sizeof(T) % sizeof(std::uint64_t) == 0, "whole words");
    constexpr std::size_t kWords = sizeof(T) / sizeof(std::uint64_t);
    std::uint64_t words[kWords];
    std::memcpy(words, &value, sizeof(T));
    for (std::size_t k = 0; k < kWords; ++k) mixWord(m_lanes[k % kLanes], words[k]);
  }
  std::uint64_t value() const {
    std::uint64_t all = 0;
    for (const std::uint64_t lane : m_lanes) mixWord(all, lane);
    return all;
  }

 private:
  static constexpr std::size_t kLanes = 4;
  std::uint64_t m_lanes[kLanes] = {1, 2, 3, 4};
};

// What of an object shows in stock's next step though nothing wakes: where it is (its AABB), what it collides as, and
// what the step overwrites. Friction, mass and the like are read when something wakes.
std::uint64_t markOf(const btCollisionObject& object) {
  struct Base {
    const btBroadphaseProxy* proxy;
    const btCollisionShape* shape;
    int flags, activation;
  };
  Mark mark;
  mark.add(object.getWorldTransform());
  mark.add(object.getInterpolationWorldTransform());
  mark.add(Base{object.getBroadphaseHandle(), object.getCollisionShape(), object.getCollisionFlags(),
                object.getActivationState()});
  if (const btRigidBody* body = btRigidBody::upcast(&object)) {
    mark.add(body->getLinearVelocity());
    mark.add(body->getAngularVelocity());
    mark.add(body->getTotalForce());
    mark.add(body->getTotalTorque());
  }
  return mark.value();
}

void prefetchMark(const btCollisionObject& object) {
  prefetch(&object, sizeof(btTransform) * 2 + 2 * kLine);
  const auto& body = static_cast<const btRigidBody&>(object);  // only for an address
  prefetch(&body.getLinearVelocity(), kLine);
  prefetch(&body.getTotalForce(), kLine);
}

bool isZero(const btVector3& v) { return v.x() == 0 && v.y() == 0 && v.z() == 0; }

// Something that stock's step does to an object though it is not awake.
bool needsSteps(const btCollisionObject& object) {
  if (object.isActive()) return true;
  // Its motion state is asked.
  if (object.isKinematicObject() && object.getActivationState() != ISLAND_SLEEPING) return true;
  const btRigidBody* body = btRigidBody::upcast(&object);
  return body && !(isZero(body->getTotalForce()) && isZero(body->getTotalTorque()));
}

// True if `differs` of any position, on several threads.
template <typename Differs>
bool anyOf(std::size_t count, const Differs& differs) {
  std::atomic<bool> found{false};
  parallelFor(count, kGrain, [&](std::size_t first, std::size_t last) {
    if (found.load(std::memory_order_relaxed)) return;
    for (std::size_t i = first; i < last; ++i) {
      if (!differs(i, last)) continue;
      found.store(true, std::memory_order_relaxed);
      return;
    }
  });
  return found;
}

}  // namespace

void RestWatch::endStep(bool still) {
  m_confirmed = false;
  if (still) {
    ++m_stillSteps;
  } else {
    forget();
  }
}

void RestWatch::forget() {
  m_stillSteps = 0;
  m_settled = m_confirmed = false;
}

void RestWatch::settle(const Objects& objects, const Bodies& bodies, const Joints& joints, WorldReader& reader) {
  m_stillSteps = 0;  // not again at once if it does not succeed
  m_joints.clear();
  for (int i = 0; i < joints.size(); ++i) m_joints.push_back(joints[i]);
  if (!sameLists(objects, bodies, joints, reader)) return;
  reader.rememberShapes();
  const auto count = static_cast<std::size_t>(objects.size());
  m_marks.resize(count);
  m_settled = !anyOf(count, [&](std::size_t i, std::size_t) {
    const btCollisionObject& object = *objects[static_cast<int>(i)];
    m_marks[i] = markOf(object);
    return needsSteps(object);
  });
}

// The lists of the world are those that the last step read.
bool RestWatch::sameLists(const Objects& objects, const Bodies& bodies, const Joints& joints,
                          const WorldReader& reader) const {
  return reader.isListed(objects, bodies) && static_cast<std::size_t>(joints.size()) == m_joints.size() &&
         (m_joints.empty() || std::equal(m_joints.begin(), m_joints.end(), &joints[0]));
}

bool RestWatch::isUndisturbed(const Objects& objects, const Bodies& bodies, const Joints& joints,
                              const WorldReader& reader, Watch watch) {
  if (!m_settled || m_confirmed) return m_settled;
  const Zone zone("watchSleepers");
  const auto count = static_cast<std::size_t>(objects.size());
  const auto at = [&objects](std::size_t i) -> const btCollisionObject& { return *objects[static_cast<int>(i)]; };
  const auto state = memberPointer(ActivationState());
  const bool disturbed = !sameLists(objects, bodies, joints, reader) ||
                         (watch == Watch::Everything && reader.hasChangedShapes()) ||
                         (watch == Watch::Activations ? anyOf(count,
                                                              [&](std::size_t i, std::size_t last) {
                                                                constexpr std::size_t kFar = 16;
                                                                if (i + kFar < last)
                                                                  __builtin_prefetch(&(at(i + kFar).*state));
                                                                return at(i).isActive();
                                                              })
                                                      : anyOf(count, [&](std::size_t i, std::size_t last) {
                                                          if (i + kAhead < last) prefetchMark(at(i + kAhead));
                                                          return markOf(at(i)) != m_marks[i];
                                                        }));
  if (disturbed) {
    forget();
  } else {
    m_confirmed = true;
  }
  return m_settled;
}

BTGPU_TRANSLATION_END
