// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Cases of docs/compatibility_api.md: a script of calls that runs on a stock world and on a btgpu world, and logs what
// it sees, callbacks too, in their order. The two logs must be equal: exactly where the values are the application's
// own or stock's path made them, within the rounding of the device's steps elsewhere.
//
//   API_CASE(World, Gravity, OnDevice()) { w.world.setGravity(...); LOG(w.world.getGravity()); w.step(); }
//
// The third argument says where the steps must have run. scripts/bullet_api.py holds it against the table's rows, and
// looks for each row's name in the case's text and in that of the functions of this folder that it calls.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/facade_world.h"
#include "tests/support/joints.h"

namespace btgpu::test::api {

struct Entry {
  std::string what, text;
  std::vector<double> numbers;
  bool exact = true;
  double scale = 1;  // of the tolerance, where a number is not a speed or a position
  int steps = 0;     // done before it was logged
};

class Log {
 public:
  int steps = 0;

  template <typename T>
  void exact(const std::string& what, const T& value) {
    add(what, value, true, 1);
  }
  // Of a size of up to 10 units; `scale`: by how much rounding of speeds is multiplied in it.
  template <typename T>
  void near(const std::string& what, const T& value, double scale = 1) {
    add(what, value, false, scale);
  }
  void note(const std::string& what) { m_entries.push_back({what, {}, {}, true, 1, steps}); }
  const std::vector<Entry>& entries() const { return m_entries; }

 private:
  template <typename T>
  void add(const std::string& what, const T& value, bool exact, double scale) {
    Entry entry{what, {}, {}, exact, scale, steps};
    put(entry, value);
    m_entries.push_back(std::move(entry));
  }
  static void put(Entry& e, const std::string& text) { e.text = text; }
  static void put(Entry& e, const char* text) { e.text = text ? text : "(null)"; }
  static void put(Entry& e, const btVector3& v) {
    for (int k = 0; k < 3; ++k) e.numbers.push_back(double(v[k]));
  }
  static void put(Entry& e, const btQuaternion& q) {
    for (int k = 0; k < 4; ++k) e.numbers.push_back(double(q[k]));
  }
  static void put(Entry& e, const btMatrix3x3& m) {
    for (int k = 0; k < 3; ++k) put(e, m[k]);
  }
  static void put(Entry& e, const btTransform& t) {
    put(e, t.getBasis());
    put(e, t.getOrigin());
  }
  template <typename T>
  static std::enable_if_t<std::is_arithmetic_v<T> || std::is_enum_v<T>> put(Entry& e, T value) {
    e.numbers.push_back(double(value));
  }
  std::vector<Entry> m_entries;
};

// Where the steps of a case must run.
struct Place {
  enum Kind { kDevice, kStock, kNoStep } kind;
  std::vector<std::string> named;  // by fallbackReport(): all of it
};
inline Place OnDevice() { return {Place::kDevice, {}}; }  // everything
// On the device, but for these, which the CPU does within the step.
template <typename... Names>
Place Shares(Names... names) {
  return {Place::kDevice, {names...}};
}
// All steps are stock's, for these reasons.
template <typename... Names>
Place StockPath(Names... names) {
  return {Place::kStock, {names...}};
}
inline Place NoStep() { return {Place::kNoStep, {}}; }

inline btTransform turnedAt(const btVector3& at) {
  return btTransform(btQuaternion(vector(1, 2, 3).normalized(), scalar(0.4)), at);
}
inline std::string hexOf(const char* bytes, size_t count) {
  std::string text;
  for (size_t i = 0; i < count; ++i) {
    for (const int shift : {4, 0}) text += "0123456789abcdef"[bytes[i] >> shift & 15];
  }
  return text;
}

struct Unit {
  btTransform at;
  btVector3 linear, angular;
};

// One of the two worlds, with its parts.
class Lab {
 public:
  template <typename Parts>
  Lab(Parts& parts, bool isStock)
      : world(parts.world),
        objects(parts.objects),
        dispatcher(parts.dispatcher),
        broadphase(parts.broadphase),
        solver(parts.solver),
        configuration(parts.configuration),
        m_isStock(isStock) {}

  btDiscreteDynamicsWorld& world;
  scenes::Objects& objects;
  btCollisionDispatcher& dispatcher;
  btDbvtBroadphase& broadphase;
  btSequentialImpulseConstraintSolver& solver;
  btDefaultCollisionConfiguration& configuration;
  Log log;

  // Lives until the world is gone.
  template <typename T, typename... Arguments>
  T* keep(Arguments&&... arguments) {
    auto made = std::make_shared<T>(std::forward<Arguments>(arguments)...);
    kept.push_back(made);
    return made.get();
  }
  std::vector<std::shared_ptr<void>> kept;

  void step(int count = 1, double timeStep = 1.0 / 60) {
    for (int i = 0; i < count; ++i) {
      ++log.steps;
      world.stepSimulation(scalar(timeStep), 0);
    }
  }
  // As the log names an object: its place in the world.
  int number(const btCollisionObject* object) const { return object ? object->getWorldArrayIndex() : -1; }

  // All bodies as they are now; and all manifolds with contacts, in the dispatcher's order or by pair.
  void logBodies(const std::string& when);
  void logContacts(const std::string& when, bool lifetimes = true, bool byPair = false);
  // Of the tolerance of bodies, where theirs are larger than speeds and turns of up to 10 units.
  double scale = 1;

  // Remembers the bodies, and where they go back to for each probe.
  void start();
  // One thing tried: steps from the start, and their outcome. It must differ from the last probe's, so that what was
  // set shows; with probeSame it must not. Then the bodies go back. Without joints, contacts are forgotten.
  void probe(const std::string& what, int steps = 1);
  void probeSame(const std::string& what, int steps = 1);
  // Either; true if it differs.
  bool probeAny(const std::string& what, int steps = 1);

  // Bodies that differ in one thing each from the first one, `reference`: each must fare differently.
  void expectEachDiffers(const std::vector<btRigidBody*>& bodies, const std::vector<std::string>& names);

 private:
  void restore();
  std::vector<double> outcome() const;
  bool runProbe(const std::string& what, int steps);

  bool m_isStock;
  std::map<btRigidBody*, Unit> m_start;
  std::vector<double> m_lastOutcome;
};

void runOnBoth(void (*script)(Lab&), const Place& place);

#define API_CASE(suite, name, place)                   \
  void suite##name(Lab& w);                            \
  TEST(suite, name) { runOnBoth(suite##name, place); } \
  void suite##name([[maybe_unused]] Lab& w)

// An expression of the application's own values, and one of what a step left.
#define LOG(...) w.log.exact(#__VA_ARGS__, __VA_ARGS__)
#define LOG_NEAR(...) w.log.near(#__VA_ARGS__, __VA_ARGS__)

}  // namespace btgpu::test::api
