// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// btgpu rays: a batch of rays into a scene, timed against a loop over stock's rayTest in the same world, and compared
// with it ray by ray.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <random>

#include "arguments.h"
#include "bullet_file.h"
#include "commands.h"
#include "worlds.h"

namespace btgpu::tool {
namespace {

struct RaysArguments {
  std::string scene = "rocks", size, device;
  int rays = 1000000, stockRays = 100000, steps = 60, repeats = 5;
};

using Clock = std::chrono::steady_clock;
double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// From all around the bodies that can move to points among them.
std::vector<btGpuRay> makeRays(const btDynamicsWorld& world, int count) {
  btVector3 lower(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT), upper = -lower;
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    const btCollisionObject& object = *world.getCollisionObjectArray()[i];
    if (object.isStaticObject()) continue;
    lower.setMin(object.getWorldTransform().getOrigin());
    upper.setMax(object.getWorldTransform().getOrigin());
  }
  const btVector3 middle = (lower + upper) / 2, half = (upper - lower) / 2;
  const btScalar radius = 2 * half.length();
  std::mt19937 random(1);
  std::uniform_real_distribution<btScalar> uniform(-1, 1);
  const auto point = [&] { return btVector3(uniform(random), uniform(random), uniform(random)); };
  std::vector<btGpuRay> rays(static_cast<size_t>(count));
  for (btGpuRay& ray : rays) {
    btVector3 direction = point();
    while (!(direction.length2() > btScalar(1e-3))) direction = point();
    direction.setY(btFabs(direction.y()));
    ray.m_from = middle + direction.normalized() * radius;
    // Twice as far as there, so that nearly every ray ends at something or leaves the scene.
    ray.m_to = ray.m_from.lerp(middle + half * point(), 2);
  }
  return rays;
}

// To the first rays of a batch, each of which is as good as any other.
struct StockAnswers {
  std::vector<const btCollisionObject*> objects;
  std::vector<btScalar> fractions;
  double milliseconds = 0;
  int hits = 0;
};

StockAnswers askStock(const btDiscreteDynamicsWorld& world, const std::vector<btGpuRay>& rays) {
  StockAnswers answers;
  answers.objects.resize(rays.size());
  answers.fractions.resize(rays.size());
  const auto start = Clock::now();
  for (size_t i = 0; i < rays.size(); ++i) {
    btCollisionWorld::ClosestRayResultCallback hit(rays[i].m_from, rays[i].m_to);
    world.rayTest(rays[i].m_from, rays[i].m_to, hit);
    answers.objects[i] = hit.m_collisionObject;
    answers.fractions[i] = hit.m_closestHitFraction;
  }
  answers.milliseconds = millisecondsSince(start);
  for (const auto* object : answers.objects) answers.hits += object ? 1 : 0;
  return answers;
}

// Milliseconds of each of some batches.
std::vector<double> timeBatches(const btGpuDynamicsWorld& world, const std::vector<btGpuRay>& rays,
                                std::vector<btGpuRayHit>& hits, int repeats) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const auto start = Clock::now();
    world.rayTestBatch(rays, hits);
    times.push_back(millisecondsSince(start));
  }
  return times;
}

double median(std::vector<double> times) {
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

struct Timing {
  std::string what;
  size_t rays;
  double milliseconds;
  double microsecondsARay() const { return 1e3 * milliseconds / static_cast<double>(rays); }
};

void print(const std::vector<Timing>& lines) {
  fmt::print("{:<44} {:>9} {:>10} {:>10} {:>8}\n", "", "rays", "ms", "us a ray", "times");
  for (const Timing& t : lines) {
    fmt::print("{:<44} {:>9} {:>10.1f} {:>10.3f} {:>8.2f}\n", t.what, t.rays, t.milliseconds, t.microsecondsARay(),
               lines.front().microsecondsARay() / t.microsecondsARay());
  }
}

// True if the answers are the same but for one ray in 1000.
bool compareAnswers(const StockAnswers& stock, const std::vector<btGpuRayHit>& hits) {
  const size_t count = stock.objects.size();
  size_t others = 0, fractions = 0;
  for (size_t i = 0; i < count; ++i) {
    if (hits[i].m_collisionObject != stock.objects[i]) {
      ++others;
    } else if (btFabs(hits[i].m_closestHitFraction - stock.fractions[i]) > btScalar(1e-4)) {
      ++fractions;
    }
  }
  const double percent = 100.0 / static_cast<double>(count);
  fmt::print(
      "of {} rays that stock was asked too {} hit ({:.1f} %); {} hit another body than stock's ({:.4f} %), {} have a "
      "fraction more than 1e-4 off\n",
      count, stock.hits, stock.hits * percent, others, static_cast<double>(others) * percent, fractions);
  return others + fractions <= count / 1000;
}

int runRays(const RaysArguments& arguments) {
  const scenes::Scene& scene = sceneNamed(arguments.scene);
  const scenes::Size usual = scene.benchmark.sizeFor ? scene.benchmark.size : scene.size;
  const scenes::Size size = arguments.size.empty() ? usual : parseSize(arguments.size);
  btGpuSettings settings;
  settings.m_stockOnly = true;  // the tree that stock's rayTest goes through is to be stock's own
  TestWorld<btGpuDynamicsWorld> test(builderOf(scene, size), settings);
  btGpuDynamicsWorld& world = test.world();
  for (int i = 0; i < arguments.steps; ++i) world.stepSimulation(static_cast<btScalar>(scene.timeStep), 0);
  const auto rays = makeRays(world, arguments.rays);
  const std::vector<btGpuRay> some(rays.begin(), rays.begin() + std::min(arguments.stockRays, arguments.rays));
  const StockAnswers stock = askStock(world, some);

  std::vector<btGpuRayHit> hits;
  const double onHost = median(timeBatches(world, some, hits, arguments.repeats));
  settings.m_stockOnly = false;
  settings.m_smallBatch = 0;
  settings.m_device = arguments.device;
  btGpuDynamicsWorld::configure(&world, settings);
  const double first = timeBatches(world, rays, hits, 1).front();
  const std::vector<double> times = timeBatches(world, rays, hits, arguments.repeats);
  const btGpuStatistics statistics = world.statistics();

  fmt::print("{} {},{},{}: {} objects after {} steps; {} rays; device: {}\n", arguments.scene, size.x, size.y, size.z,
             world.getNumCollisionObjects(), arguments.steps, rays.size(), statistics.m_device);
  const std::string repeats = fmt::format("median of {}", arguments.repeats);
  print({{"stock rayTest in a loop, one thread", some.size(), stock.milliseconds},
         {"rayTestBatch on the CPU, " + repeats, some.size(), onHost},
         {"rayTestBatch on the device, the first", rays.size(), first},
         {"rayTestBatch on the device, " + repeats, rays.size(), median(times)}});
  for (const auto& f : world.fallbackReport()) {
    if (!f.m_wholeStep) fmt::print("on the CPU: {}: {}\n", f.m_what, f.m_reason);
  }
  if (statistics.m_deviceRays == 0) {
    fmt::print("no ray was cast on a device\n");
    return kFailed;
  }
  return compareAnswers(stock, hits) ? kAgreed : kFailed;
}

}  // namespace

Command addRaysCommand(CLI::App& tool) {
  const auto arguments = std::make_shared<RaysArguments>();
  CLI::App* rays = tool.add_subcommand("rays", "a batch of rays into a scene, against a loop over stock's rayTest");
  rays->add_option("scene", arguments->scene, "scene, as 'btgpu scenes' lists them")->check(kNotEmpty);
  rays->add_option("--size", arguments->size, "size of the scene, as X,Y,Z; default: that of btgpu bench")
      ->check(kNotEmpty);
  rays->add_option("--rays", arguments->rays, "how many")->check(CLI::Range(1, 100000000))->capture_default_str();
  rays->add_option("--stock-rays", arguments->stockRays,
                   "how many of them, the first, are cast by stock, and by a batch on the CPU; those are compared")
      ->check(CLI::Range(1, 100000000))
      ->capture_default_str();
  rays->add_option("--steps", arguments->steps, "steps on Bullet's CPU path before")
      ->check(CLI::Range(0, 1000000))
      ->capture_default_str();
  rays->add_option("--repeats", arguments->repeats, "batches that the median is of")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  rays->add_option("--device", arguments->device, "OpenCL device: index, part of its name, gpu or cpu");
  return {rays, [arguments] { return runRays(*arguments); }};
}

}  // namespace btgpu::tool
