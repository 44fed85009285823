// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Worlds on several threads, each thread with its own: an application's right in Bullet. Run under the thread
// sanitizer too (scripts/test.sh --long).
#include <atomic>
#include <thread>

#include "tests/support/facade_world.h"

namespace btgpu::test {
namespace {

// A leaning tower, made, stepped and destroyed on the calling thread.
std::vector<BodyState> simulate(int boxes, int steps) {
  GpuWorld w;
  std::vector<BodyState> states;
  w.world.setGravity(btVector3(0, -10, 0));
  w.objects.add(0, w.objects.box(btVector3(10, 1, 10)), btVector3(0, -1, 0));
  btBoxShape* box = w.objects.box(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
  for (int i = 0; i < boxes; ++i) w.objects.add(1, box, btVector3(btScalar(0.1 * i), btScalar(0.6 + 1.1 * i), 0));
  w.run(steps);
  EXPECT_EQ(w.world.statistics().m_deviceSteps, static_cast<unsigned long long>(steps));
  for (const btRigidBody* body : w.objects.bodies()) states.push_back(stateOf(*body));
  return states;
}

void expectSameStates(const std::vector<BodyState>& a, const std::vector<BodyState>& b, const std::string& what) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) expectSame(a[i], b[i], what + " body " + std::to_string(i));
}

// Results are those of one thread alone, bit by bit.
TEST(WorldsOnThreads, AsOnOneThread) {
  std::vector<BodyState> results[2];
  std::thread other([&] { results[1] = simulate(9, 60); });
  results[0] = simulate(5, 60);
  other.join();
  expectSameStates(results[0], simulate(5, 60), "first thread,");
  expectSameStates(results[1], simulate(9, 60), "second thread,");
}

// Many short lives side by side: the table of worlds, the shared device and its programs.
TEST(WorldsOnThreads, MadeAndDestroyed) {
  const auto alone = simulate(3, 5);
  std::atomic<int> equal{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 6; ++i) {
        const auto states = simulate(3, 5);
        bool same = states.size() == alone.size();
        for (size_t k = 0; same && k < states.size(); ++k) same = states[k].transform == alone[k].transform;
        if (same) ++equal;
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(equal, 18);
}

// What is missing is found out on whichever thread steps first, and each world goes on.
TEST(WorldsOnThreads, WithoutDevice) {
  btGpuSettings settings;
  settings.m_device = "no such device either";
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t) {
    threads.emplace_back([&] {
      GpuWorld w(settings);
      w.run(3);
      EXPECT_EQ(w.world.statistics().m_stockSteps, 3u);
      EXPECT_EQ(reported(w.world, "device").m_count, 3u);
    });
  }
  for (auto& thread : threads) thread.join();
}

}  // namespace
}  // namespace btgpu::test
