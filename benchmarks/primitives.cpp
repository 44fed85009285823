// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Google Benchmark of the parallel primitives: time on the device by events, without the gaps between launches, and the
// share of what the device could do at most (roof.h). The device is chosen as ever (BTGPU_DEVICE, BTGPU_KERNEL_SHAPE).
#include <fmt/format.h>

#include <cstdio>
#include <random>

#include "gpu_engine/primitives/primitives.h"
#include "roof.h"

namespace {

using namespace btgpu;

constexpr double kUint = sizeof(uint);
constexpr size_t kBins = 256;

struct Bench {
  std::shared_ptr<ComputeDevice> device;
  Queue queue;
  Roof roof;

  Bench() : device(ComputeDevice::open("")), queue(device, true), roof(measureRoof(queue)) {}

  DeviceArray<uint> upload(const std::vector<uint>& values) {
    DeviceArray<uint> array("benchmark");
    array.copyFromHost(queue, values);
    return array;
  }
  DeviceArray<uint> room(size_t count) {
    DeviceArray<uint> array("benchmark");
    array.resize(queue, count);
    return array;
  }
  double deviceSeconds() {
    double ms = 0;
    for (const StageTime& t : queue.takeProfile(nullptr)) ms += t.milliseconds;
    return ms * 1e-3;
  }
};

std::vector<uint> randomUints(size_t count, uint limit) {
  std::mt19937 random(1);
  std::vector<uint> values(count);
  for (uint& v : values) v = static_cast<uint>(random()) % limit;
  return values;
}

// prepare() is not timed.
template <typename Prepare, typename Run>
void measure(benchmark::State& state, Bench& bench, const Work& work, const Prepare& prepare, const Run& run) {
  prepare();
  run();  // builds programs, makes room
  bench.queue.finish();
  bench.deviceSeconds();
  double sum = 0;
  for (auto _ : state) {
    prepare();
    bench.queue.finish();
    run();
    const double seconds = bench.deviceSeconds();
    state.SetIterationTime(seconds);
    sum += seconds;
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
  reportRoof(state, bench.roof, work, sum / static_cast<double>(state.iterations()));
}

void fill(benchmark::State& state, Bench& b) {
  const size_t n = static_cast<size_t>(state.range(0));
  Fill primitive(*b.device);
  auto data = b.room(n);
  measure(
      state, b, {kUint * double(n), 0}, [] {}, [&] { primitive.run(b.queue, data, 0, n, 7); });
}

void reduce(benchmark::State& state, Bench& b) {
  const size_t n = static_cast<size_t>(state.range(0));
  Reduce primitive(*b.device);
  auto data = b.upload(randomUints(n, 1000)), result = b.room(1);
  measure(
      state, b, {kUint * double(n), double(n)}, [] {}, [&] { primitive.sum(b.queue, {n}, data, result); });
}

void scan(benchmark::State& state, Bench& b) {
  const size_t n = static_cast<size_t>(state.range(0));
  Scan primitive(*b.device);
  auto data = b.upload(randomUints(n, 1000)), out = b.room(n), total = b.room(1);
  measure(
      state, b, {2 * kUint * double(n), double(n)}, [] {},
      [&] { primitive.exclusive(b.queue, {n}, data, out, total); });
}

// Half of the flags are set.
void compact(benchmark::State& state, Bench& b) {
  const size_t n = static_cast<size_t>(state.range(0));
  Compact primitive(*b.device);
  auto flags = b.upload(randomUints(n, 2)), out = b.room(n), total = b.room(1);
  measure(
      state, b, {1.5 * kUint * double(n), double(n)}, [] {}, [&] { primitive.run(b.queue, {n}, flags, out, total); });
}

void histogram(benchmark::State& state, Bench& b) {
  const size_t n = static_cast<size_t>(state.range(0));
  Histogram primitive(*b.device);
  auto keys = b.upload(randomUints(n, kBins)), out = b.room(kBins);
  measure(
      state, b, {kUint * double(n), double(n)}, [] {}, [&] { primitive.run(b.queue, {n}, keys, kBins, out); });
}

// As many keys as elements; the search is in cached memory but for the first steps, so that both are read once.
void boundSearch(benchmark::State& state, Bench& b) {
  const size_t n = static_cast<size_t>(state.range(0));
  BoundSearch primitive(*b.device);
  std::vector<uint> sorted(n);
  for (size_t i = 0; i < n; ++i) sorted[i] = static_cast<uint>(i);
  auto data = b.upload(sorted), out = b.room(n);
  measure(
      state, b, {2 * kUint * double(n), 0}, [] {}, [&] { primitive.lower(b.queue, {n}, data, n, out); });
}

// All 32 bits with values: the least work is that of passes of 8 bits, which read and write keys and values.
void radixSort(benchmark::State& state, Bench& b) {
  const size_t n = static_cast<size_t>(state.range(0));
  RadixSort<uint> primitive(*b.device);
  const auto random = randomUints(n, 0xffffffffu);
  auto keys = b.upload(random), values = b.upload(random);
  const auto source = b.upload(random);
  measure(
      state, b, {4 * 4 * kUint * double(n), 0},
      [&] { b.queue.copy(source.buffer(), keys.buffer(), 0, 0, n * sizeof(uint)); },
      [&] {
        primitive.pairs(b.queue, {n}, keys, values, {{0, 32}});
      });
}

void add(const char* name, void (*run)(benchmark::State&, Bench&), Bench& bench) {
  benchmark::RegisterBenchmark(name, [run, &bench](benchmark::State& state) { run(state, bench); })
      ->RangeMultiplier(16)
      ->Range(1 << 12, 1 << 24)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond);
}

}  // namespace

int main(int count, char** arguments) {
  benchmark::Initialize(&count, arguments);
  if (benchmark::ReportUnrecognizedArguments(count, arguments)) return 2;
  try {
    Bench bench;
    describeRoof(*bench.device, bench.roof);
    add("fill", fill, bench);
    add("reduce", reduce, bench);
    add("scan", scan, bench);
    add("compact", compact, bench);
    add("histogram", histogram, bench);
    add("bound_search", boundSearch, bench);
    add("radix_sort", radixSort, bench);
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& e) {
    fmt::print(stderr, "primitives: {}\n", e.what());
    return 1;
  }
  return 0;
}
