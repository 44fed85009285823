// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "random_walk.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstring>
#include <set>

namespace btgpu::test {
namespace {

btGpuSettings onDevice(int crosscheckEvery) {
  btGpuSettings settings;
  settings.m_smallWorld = 0;
  settings.m_smallBatch = 0;
  settings.m_crosscheckEvery = crosscheckEvery;
  return settings;
}

std::string listOf(const std::vector<int>& ids) {
  std::string text;
  for (const int id : ids) text += " " + std::to_string(id);
  return text;
}

int idOf(const btCollisionObject* object) { return object->getUserIndex(); }

// What a world holds, in its order, as ids.
std::string listsOf(Walker& w) {
  std::vector<int> objects, bodies, joints, flags, refs;
  for (int i = 0; i < w.world().getNumCollisionObjects(); ++i) {
    const btCollisionObject* object = w.world().getCollisionObjectArray()[i];
    objects.push_back(idOf(object));
    flags.push_back(object->getCollisionFlags());
    flags.push_back(object->getBroadphaseHandle()->m_collisionFilterGroup);
    flags.push_back(object->getBroadphaseHandle()->m_collisionFilterMask);
    if (const btRigidBody* body = btRigidBody::upcast(object)) refs.push_back(body->getNumConstraintRefs());
  }
  const auto& moving = w.world().getNonStaticRigidBodies();
  for (int i = 0; i < moving.size(); ++i) bodies.push_back(idOf(moving[i]));
  for (int i = 0; i < w.world().getNumConstraints(); ++i) {
    joints.push_back(w.world().getConstraint(i)->getUserConstraintId());
  }
  return "objects" + listOf(objects) + "; bodies" + listOf(bodies) + "; joints" + listOf(joints) + "; flags" +
         listOf(flags) + "; references" + listOf(refs);
}

// Whatever the world's parts point at is in the world.
std::string strangersIn(Walker& w) {
  std::set<const void*> objects, proxies;
  for (int i = 0; i < w.world().getNumCollisionObjects(); ++i) {
    btCollisionObject* object = w.world().getCollisionObjectArray()[i];
    objects.insert(object);
    proxies.insert(object->getBroadphaseHandle());
    if (object->getWorldArrayIndex() != i) return "an object does not know its place";
    if (object->getBroadphaseHandle()->m_clientObject != object) return "a proxy of another object";
  }
  const btBroadphasePairArray& pairs = w.world().getPairCache()->getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i) {
    if (!proxies.count(pairs[i].m_pProxy0) || !proxies.count(pairs[i].m_pProxy1)) return "a pair of what is gone";
  }
  for (int i = 0; i < w.dispatcher().getNumManifolds(); ++i) {
    const btPersistentManifold& m = *w.dispatcher().getManifoldByIndexInternal(i);
    if (!objects.count(m.getBody0()) || !objects.count(m.getBody1())) return "a manifold of what is gone";
  }
  for (const auto& [id, o] : w.objects()) {
    const btGhostObject* ghost = o.inWorld ? btGhostObject::upcast(o.object.get()) : nullptr;
    for (int i = 0; ghost && i < ghost->getNumOverlappingObjects(); ++i) {
      if (!objects.count(ghost->getOverlappingObject(i))) return "a ghost overlaps what is gone";
    }
  }
  return "";
}

// Bit by bit.
class Bits {
 public:
  template <typename T>
  void add(const T& value) {
    m_bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void add(const btVector3& v) {
    for (int k = 0; k < 3; ++k) add(v[k]);
  }
  void add(const btTransform& t) {
    for (int k = 0; k < 3; ++k) add(t.getBasis()[k]);
    add(t.getOrigin());
  }
  const std::string& bytes() const { return m_bytes; }

 private:
  std::string m_bytes;
};

std::string stateOf(const btCollisionObject& o) {
  Bits bits;
  bits.add(o.getWorldTransform());
  bits.add(o.getInterpolationWorldTransform());
  bits.add(o.getActivationState());
  bits.add(o.getDeactivationTime());
  bits.add(o.getHitFraction());
  if (const btRigidBody* body = btRigidBody::upcast(&o)) {
    bits.add(body->getLinearVelocity());
    bits.add(body->getAngularVelocity());
    bits.add(body->getTotalForce());
    bits.add(body->getTotalTorque());
    bits.add(body->getInvInertiaTensorWorld()[0]);
    bits.add(body->getInvInertiaTensorWorld()[1]);
  }
  return bits.bytes();
}

// A line a manifold, a word a number.
std::vector<std::string> contactsOf(Walker& w) {
  std::vector<std::string> lines;
  for (int i = 0; i < w.dispatcher().getNumManifolds(); ++i) {
    const btPersistentManifold& m = *w.dispatcher().getManifoldByIndexInternal(i);
    // How long an empty one stays is up to the host's broadphase, of what the host collides, and that depends on how
    // often it has been brought up to date: in a batch of substeps only after the last.
    if (m.getNumContacts() == 0) continue;
    std::string line = std::to_string(idOf(m.getBody0())) + " and " + std::to_string(idOf(m.getBody1()));
    char text[200];
    for (int k = 0; k < m.getNumContacts(); ++k) {
      const btManifoldPoint& p = m.getContactPoint(k);
      const btVector3& at = p.getPositionWorldOnB();
      std::snprintf(text, sizeof text, "; distance %a impulse %a life %d at %a %a %a%s", double(p.getDistance()),
                    double(p.getAppliedImpulse()), p.getLifeTime(), double(at.x()), double(at.y()), double(at.z()),
                    p.m_userPersistentData ? " marked" : "");
      line += text;
    }
    lines.push_back(line);
  }
  // Who comes first in the dispatcher's list is up to the host's broadphase, of what the host collides.
  std::sort(lines.begin(), lines.end());
  return lines;
}

// Two worlds of btgpu's that differ in who looks at them.
std::string differenceOf(Walker& a, Walker& b) {
  for (int i = 0; i < a.world().getNumCollisionObjects(); ++i) {
    const btCollisionObject& x = *a.world().getCollisionObjectArray()[i];
    const btCollisionObject& y = *b.world().getCollisionObjectArray()[i];
    if (stateOf(x) == stateOf(y)) continue;
    char text[300];
    const btVector3 &p = x.getWorldTransform().getOrigin(), &q = y.getWorldTransform().getOrigin();
    std::snprintf(text, sizeof text,
                  "object %d is not the same where nobody looks: at %.9g %.9g %.9g, state %d, or %.9g %.9g %.9g, %d",
                  idOf(&x), double(p.x()), double(p.y()), double(p.z()), x.getActivationState(), double(q.x()),
                  double(q.y()), double(q.z()), y.getActivationState());
    return text;
  }
  const std::vector<std::string> x = contactsOf(a), y = contactsOf(b);
  for (std::size_t i = 0; i < std::max(x.size(), y.size()); ++i) {
    const std::string one = i < x.size() ? x[i] : "none", other = i < y.size() ? y[i] : "none";
    if (one != other) {
      return "contacts are not the same where nobody looks: manifold " + std::to_string(i) + ": " + one + "\n  or " +
             other;
    }
  }
  return "";
}

std::string failuresOf(const std::vector<btGpuCheck>& checks) {
  std::string text;
  char line[200];
  for (const btGpuCheck& c : checks) {
    if (!c.m_failed) continue;
    std::snprintf(line, sizeof line, " %s %.4g > %.4g, objects %d %d, by %.4g;", c.m_name, c.m_value, c.m_limit,
                  c.m_bodyA ? idOf(c.m_bodyA) : 0, c.m_bodyB ? idOf(c.m_bodyB) : 0, c.m_difference);
    text += line;
  }
  return text;
}

std::string checkAll(Walker& stock, Walker& checked, Walker& alone) {
  const std::string lists = listsOf(stock);
  for (Walker* w : {&checked, &alone}) {
    if (listsOf(*w) != lists) return "other lists: stock " + lists + "\n  ours " + listsOf(*w);
  }
  for (Walker* w : {&stock, &checked, &alone}) {
    if (!w->problem().empty()) return w->problem();
    const std::string strangers = strangersIn(*w);
    if (!strangers.empty()) return strangers + (w == &stock ? ", in stock" : "");
  }
  const btGpuCrosscheckSummary summary = checked.gpu()->crosscheck();
  if (!summary.m_error.empty()) return "cross-check: " + summary.m_error;
  if (summary.m_failedSteps > 0) return "one step:" + failuresOf(summary.m_first.m_checks);
  return differenceOf(checked, alone);
}

}  // namespace

WalkResult runWalk(const std::vector<Operation>& walk, std::uint32_t seed, bool verbose) {
  const auto broadphase = seed % 3 == 2 ? Walker::Broadphase::AxisSweep : Walker::Broadphase::Dbvt;
  const btGpuSettings looked = onDevice(1), unlooked = onDevice(-1);
  WalkResult result;
  resetGlobals();
  {
    Walker stock(nullptr, broadphase), checked(&looked, broadphase), alone(&unlooked, broadphase);
    for (std::size_t i = 0; i < walk.size() && result.failure.empty(); ++i) {
      const auto before = checked.gpu()->crosscheck().m_checkedSteps;
      result.done.push_back(stock.apply(walk[i]));
      if (verbose) {
        std::printf("%zu: %s\n", i, result.done.back().c_str());
        std::fflush(stdout);
      }
      for (Walker* w : {&checked, &alone}) {
        const std::string ours = w->apply(walk[i]);
        if (ours != result.done.back()) result.failure = "another operation: " + ours;
      }
      const auto after = checked.gpu()->crosscheck().m_checkedSteps;
      result.checkedSteps += after < before ? after : after - before;
      if (result.failure.empty()) result.failure = checkAll(stock, checked, alone);
      result.failedAt = static_cast<int>(i);
    }
    result.deviceSteps = alone.gpu()->statistics().m_deviceSteps;
    result.stockSteps = alone.gpu()->statistics().m_stockSteps;
    result.restingSteps = alone.gpu()->statistics().m_restingSteps;
    result.fallbacks = alone.gpu()->fallbackReport();
  }
  resetGlobals();
  return result;
}

// What kind of failure it is: its words, without the numbers.
static std::string kindOf(const std::string& failure) {
  std::string kind;
  for (const char c : failure.substr(0, failure.find(','))) {
    if (!std::isdigit(static_cast<unsigned char>(c))) kind += c;
  }
  return kind.substr(0, 40);
}

std::vector<Operation> shrinkWalk(std::vector<Operation> walk, std::uint32_t seed, int attempts) {
  const std::string kind = kindOf(runWalk(walk, seed).failure);
  for (std::size_t piece = walk.size() / 2; piece > 0; piece /= 2) {
    for (std::size_t first = 0; first < walk.size() && attempts > 0;) {
      std::vector<Operation> less = walk;
      const auto begin = less.begin() + static_cast<std::ptrdiff_t>(first);
      less.erase(begin, begin + static_cast<std::ptrdiff_t>(std::min(piece, less.size() - first)));
      --attempts;
      const WalkResult result = runWalk(less, seed);
      if (kindOf(result.failure) != kind) {
        first += piece;
      } else {
        less.resize(static_cast<std::size_t>(result.failedAt) + 1);
        walk = std::move(less);
      }
    }
  }
  return walk;
}

}  // namespace btgpu::test
