// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "pairs_bench.h"

#include <btBulletCollisionCommon.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>

#include "compat/engine_loader.h"
#include "compat/pair_finder_choice.h"
#include "kernels/shared/contact.h"

namespace btgpu::tool {
namespace {

constexpr const char* kDbvt = "dbvt";
constexpr unsigned kSeed = 12345;
constexpr float kRoom = 4;  // the scene's volume over that of all bodies

// ---- the scene ------------------------------------------------------------------------------------------------------

// Cubes in a cube, some of which move on straight lines and turn back at its sides.
class BoxScene {
 public:
  BoxScene(int bodies, const PairsCriteria& criteria) : m_random(kSeed), m_criteria(criteria) {
    const auto count = static_cast<size_t>(bodies);
    m_places.resize(count);
    double volume = 0;
    for (Place& p : m_places) {
      p.size = randomSize();
      volume += double(p.size) * p.size * p.size;
    }
    m_extent = static_cast<float>(std::cbrt(volume * kRoom));
    for (Place& p : m_places) put(p);
    BodyInfo info{};
    info.flags = BODY_PRESENT | BODY_RIGID;
    info.filterGroup = btBroadphaseProxy::DefaultFilter;
    info.filterMask = btBroadphaseProxy::AllFilter;
    infos.assign(count, info);
    aabbs.resize(count);
    for (size_t i = 0; i < count; ++i) setAabb(i);
  }

  std::vector<BodyInfo> infos;
  std::vector<Aabb> aabbs;
  std::vector<size_t> moved, replaced;  // in the last step

  void step() {
    moved.clear();
    replaced.clear();
    const auto newOnes = static_cast<size_t>(std::llround(m_criteria.churn * double(m_places.size())));
    for (size_t k = 0; k < newOnes; ++k) replaced.push_back(m_random() % m_places.size());
    std::sort(replaced.begin(), replaced.end());
    replaced.erase(std::unique(replaced.begin(), replaced.end()), replaced.end());
    for (const size_t i : replaced) {
      m_places[i].size = randomSize();
      put(m_places[i]);
      setAabb(i);
    }
    for (size_t i = 0; i < m_places.size(); ++i) {
      if (!m_places[i].moves || std::binary_search(replaced.begin(), replaced.end(), i)) continue;
      move(m_places[i]);
      setAabb(i);
      moved.push_back(i);
    }
  }

 private:
  struct Place {
    float size = 1, at[3] = {}, by[3] = {};
    bool moves = false;
  };

  float between(float low, float high) { return std::uniform_real_distribution<float>(low, high)(m_random); }
  float randomSize() { return static_cast<float>(std::pow(m_criteria.spread, double(between(0, 1)))); }
  void put(Place& p) {
    p.moves = between(0, 1) < static_cast<float>(m_criteria.moving);
    float length = 0;
    for (int axis = 0; axis < 3; ++axis) {
      p.at[axis] = between(0, m_extent);
      p.by[axis] = between(-1, 1);
      length += p.by[axis] * p.by[axis];
    }
    const float scale = static_cast<float>(m_criteria.speed) * p.size / std::sqrt(std::max(length, 1e-6f));
    for (float& v : p.by) v *= scale;
  }
  void move(Place& p) const {
    for (int axis = 0; axis < 3; ++axis) {
      p.at[axis] += p.by[axis];
      if (p.at[axis] < 0 || p.at[axis] > m_extent) p.by[axis] = -p.by[axis];
    }
  }
  void setAabb(size_t i) {
    const Place& p = m_places[i];
    const float half = 0.5f * p.size;
    aabbs[i] = {{p.at[0] - half, p.at[1] - half, p.at[2] - half, 0},
                {p.at[0] + half, p.at[1] + half, p.at[2] + half, 0}};
  }

  std::mt19937 m_random;
  PairsCriteria m_criteria;
  float m_extent = 1;
  std::vector<Place> m_places;
};

// ---- who finds the pairs --------------------------------------------------------------------------------------------

class PairsWorld {
 public:
  explicit PairsWorld(std::string name) : m_name(std::move(name)) {}
  virtual ~PairsWorld() = default;
  const std::string& name() const { return m_name; }
  // Milliseconds of one step; *repeated as in PairsRow.
  virtual double step(const BoxScene& scene, bool& repeated) = 0;
  // Sorted.
  virtual std::vector<ulong> keys() = 0;

 private:
  std::string m_name;
};

// A finder of btgpu. Its AABBs are on the device before the time starts, as stage 20 leaves them there.
class DeviceFinder : public PairsWorld {
 public:
  DeviceFinder(const std::string& name, PairFinder finder, const std::string& device) : PairsWorld(name) {
    std::string error;
    m_search = createPairSearch(device, finder, error);
    if (!m_search) throw std::runtime_error(error);
  }
  double step(const BoxScene& scene, bool& repeated) override {
    require(m_search->setBodies(scene.infos, scene.aabbs));
    PairSearchTimes times;
    require(m_search->find(times));
    repeated = times.repeated;
    return times.milliseconds;
  }
  std::vector<ulong> keys() override {
    std::vector<ulong> keys;
    require(m_search->readKeys(keys));
    return keys;
  }

 private:
  void require(Status status) const {
    if (status != Status::Ok) throw std::runtime_error(name() + ": " + m_search->lastError());
  }
  std::unique_ptr<PairSearch> m_search;
};

// Bullet's own: setting the AABBs that changed is part of its work, as it moves leaves of a tree.
class DbvtWorld : public PairsWorld {
 public:
  explicit DbvtWorld(const BoxScene& scene) : PairsWorld(kDbvt), m_indices(scene.aabbs.size()) {
    for (size_t i = 0; i < m_indices.size(); ++i) {
      m_indices[i] = static_cast<uint>(i);
      m_proxies.push_back(nullptr);
      create(scene, i);
    }
  }
  ~DbvtWorld() override {
    for (btBroadphaseProxy* proxy : m_proxies) m_broadphase.destroyProxy(proxy, &m_dispatcher);
  }
  DbvtWorld(const DbvtWorld&) = delete;
  DbvtWorld& operator=(const DbvtWorld&) = delete;

  double step(const BoxScene& scene, bool&) override {
    const auto start = std::chrono::steady_clock::now();
    for (const size_t i : scene.replaced) {
      m_broadphase.destroyProxy(m_proxies[i], &m_dispatcher);
      create(scene, i);
    }
    for (const size_t i : scene.moved) {
      m_broadphase.setAabb(m_proxies[i], toBullet(scene.aabbs[i].lower), toBullet(scene.aabbs[i].upper), &m_dispatcher);
    }
    m_broadphase.calculateOverlappingPairs(&m_dispatcher);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    return took.count();
  }
  std::vector<ulong> keys() override {
    std::vector<ulong> keys;
    const btBroadphasePairArray& pairs = m_broadphase.getOverlappingPairCache()->getOverlappingPairArray();
    for (int k = 0; k < pairs.size(); ++k) {
      keys.push_back(pairKeyOf(*static_cast<uint*>(pairs[k].m_pProxy0->m_clientObject),
                               *static_cast<uint*>(pairs[k].m_pProxy1->m_clientObject)));
    }
    std::sort(keys.begin(), keys.end());
    return keys;
  }

 private:
  static btVector3 toBullet(float4 v) { return {btScalar(v.x), btScalar(v.y), btScalar(v.z)}; }
  void create(const BoxScene& scene, size_t i) {
    m_proxies[i] =
        m_broadphase.createProxy(toBullet(scene.aabbs[i].lower), toBullet(scene.aabbs[i].upper), BOX_SHAPE_PROXYTYPE,
                                 &m_indices[i], scene.infos[i].filterGroup, scene.infos[i].filterMask, &m_dispatcher);
  }

  btDefaultCollisionConfiguration m_configuration;
  btCollisionDispatcher m_dispatcher{&m_configuration};
  btDbvtBroadphase m_broadphase;
  std::vector<uint> m_indices;
  std::vector<btBroadphaseProxy*> m_proxies;
};

std::unique_ptr<PairsWorld> makeWorld(const std::string& name, const BoxScene& scene, const std::string& device) {
  if (name == kDbvt) return std::make_unique<DbvtWorld>(scene);
  for (const auto& [known, finder] : pairFinderNames()) {
    if (known == name) return std::make_unique<DeviceFinder>(name, finder, device);
  }
  throw std::runtime_error("no pair finder " + name);
}

// ---- results --------------------------------------------------------------------------------------------------------

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(std::lround(share * double(values.size() - 1)))];
}

// All finders have the same pairs, and Bullet's fat, history-dependent ones contain them.
void checkPairs(const std::vector<std::unique_ptr<PairsWorld>>& worlds, PairsResult& result) {
  std::vector<ulong> first, bullets;
  std::string firstName;
  for (const auto& world : worlds) {
    std::vector<ulong> keys = world->keys();
    if (world->name() == kDbvt) {
      bullets = std::move(keys);
      result.dbvtPairs = bullets.size();
    } else if (firstName.empty()) {
      first = std::move(keys);
      firstName = world->name();
      result.pairs = first.size();
    } else if (keys != first) {
      throw std::runtime_error(fmt::format("{} found {} pairs, {} found {}, and they differ", firstName, first.size(),
                                           world->name(), keys.size()));
    }
  }
  if (!firstName.empty() && result.dbvtPairs > 0 &&
      !std::includes(bullets.begin(), bullets.end(), first.begin(), first.end())) {
    throw std::runtime_error("btDbvtBroadphase lacks a pair that " + firstName + " found");
  }
}

const PairsRow* rowOf(const PairsResult& result, const std::string& world) {
  for (const PairsRow& row : result.rows) {
    if (row.world == world) return &row;
  }
  return nullptr;
}

std::string ratio(const PairsResult& result, const PairsRow& row) {
  const PairsRow* dbvt = rowOf(result, kDbvt);
  return dbvt ? fmt::format("{:.2f}", dbvt->msMedian / row.msMedian) : "";
}

}  // namespace

std::vector<std::string> pairsWorldNames() {
  std::vector<std::string> names;
  for (const auto& [name, finder] : pairFinderNames()) names.push_back(name);
  names.emplace_back(kDbvt);
  return names;
}

PairsResult benchPairs(int bodies, const PairsCriteria& criteria, const PairsOptions& options) {
  PairsResult result;
  result.bodies = bodies;
  result.criteria = criteria;
  BoxScene scene(bodies, criteria);
  std::vector<std::unique_ptr<PairsWorld>> worlds;
  for (const PairsWish& wish : options.worlds) {
    if (bodies <= wish.mostBodies) {
      worlds.push_back(makeWorld(wish.name, scene, options.device));
    } else {
      result.leftOut.push_back(fmt::format("{}: left out, more than {} bodies", wish.name, wish.mostBodies));
    }
  }
  std::vector<std::vector<double>> times(worlds.size());
  std::vector<size_t> repeats(worlds.size());
  for (int step = 0; step < options.steps; ++step) {
    scene.step();
    for (size_t w = 0; w < worlds.size(); ++w) {
      bool repeated = false;
      const double ms = worlds[w]->step(scene, repeated);
      if (step < options.steps / 2) continue;
      times[w].push_back(ms);
      repeats[w] += repeated;
    }
    if (options.progress) options.progress(step + 1);
  }
  checkPairs(worlds, result);
  for (size_t w = 0; w < worlds.size(); ++w) {
    result.rows.push_back({worlds[w]->name(), quantile(times[w], 0.5), quantile(times[w], 0.95), repeats[w]});
  }
  return result;
}

std::string toText(const PairsResult& r) {
  std::string text = fmt::format(
      "pairs: {} bodies, {:g} % move by {:g} of their size a step, largest {:g} times the smallest, {:g} % replaced; "
      "{} pairs",
      r.bodies, 100 * r.criteria.moving, r.criteria.speed, r.criteria.spread, 100 * r.criteria.churn, r.pairs);
  if (r.dbvtPairs > 0) text += fmt::format(" (btDbvtBroadphase: {})", r.dbvtPairs);
  text += fmt::format("\n  {:<12} {:>10} {:>10} {:>8}\n", "", "median ms", "p95 ms", "x dbvt");
  for (const PairsRow& row : r.rows) {
    text += fmt::format("  {:<12} {:>10.3f} {:>10.3f} {:>8}{}\n", row.world, row.msMedian, row.msP95, ratio(r, row),
                        row.repeated ? fmt::format("  ({} steps repeated for lack of room)", row.repeated) : "");
  }
  for (const std::string& line : r.leftOut) text += "  " + line + "\n";
  return text;
}

std::string toCsv(const std::vector<PairsResult>& results) {
  std::string text = "bodies,moving,speed,spread,churn,pairs,dbvt_pairs,world,median_ms,p95_ms,times_dbvt\n";
  for (const PairsResult& r : results) {
    for (const PairsRow& row : r.rows) {
      text += fmt::format("{},{:g},{:g},{:g},{:g},{},{},{},{:.4f},{:.4f},{}\n", r.bodies, r.criteria.moving,
                          r.criteria.speed, r.criteria.spread, r.criteria.churn, r.pairs, r.dbvtPairs, row.world,
                          row.msMedian, row.msP95, ratio(r, row));
    }
  }
  return text;
}

}  // namespace btgpu::tool
