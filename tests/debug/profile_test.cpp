// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The profile's recorder by itself: sums, nesting, limits, files. No device.
#include "compat/profile.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <new>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "compat/profile_files.h"
#include "compat/profile_text.h"
#include "tests/support/subprocess.h"

// Allocations of this thread, for the cost of zones that nobody listens to.
static thread_local long allocations = 0;
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace btgpu::test {
namespace {

using nlohmann::json;

struct CountingSink final : ZoneSink {
  void enter(const char*) noexcept override { ++entered; }
  void leave() noexcept override { ++left; }
  void add(const DeviceSlices&) noexcept override {}
  int entered = 0, left = 0;
};

const ProfileData::Node* find(const ProfileData& data, const std::string& name, const std::string& parent = "") {
  for (const auto& n : data.nodes) {
    const std::string above = n.parent < 0 ? "" : data.name(data.nodes[static_cast<size_t>(n.parent)].name);
    if (data.name(n.name) == name && (parent.empty() || above == parent)) return &n;
  }
  return nullptr;
}

json traceOf(const ProfileData& data) {
  char* text = nullptr;
  size_t size = 0;
  std::FILE* file = open_memstream(&text, &size);
  writeTrace(file, data);
  std::fclose(file);
  const std::string copy(text, size);
  std::free(text);
  return json::parse(copy);
}

std::vector<json> eventsOf(const json& trace, const std::string& category) {
  std::vector<json> events;
  for (const auto& e : trace.at("traceEvents")) {
    if (e.value("cat", "") == category) events.push_back(e);
  }
  return events;
}

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

DeviceSlice sliceAt(std::int64_t start, const char* stage = "10_stage", const char* kernel = "kernel") {
  return {stage, kernel, start - 30, start - 20, start, start + 1000};
}

TEST(Zone, CostsNothingWithoutSink) {
  const long before = allocations;
  for (int i = 0; i < 1000; ++i) const Zone zone("nobody listens");
  EXPECT_EQ(allocations, before);
  EXPECT_EQ(currentZoneSink(), nullptr);
}

TEST(Zone, GoesToTheInnermostScopeOfItsThread) {
  CountingSink outer, inner;
  {
    const ZoneSinkScope a(&outer);
    const Zone one("one");
    {
      const ZoneSinkScope b(&inner);
      const Zone two("two");
      std::thread([] { const Zone other("another thread's"); }).join();
    }
    {
      const ZoneSinkScope none(nullptr);
      const Zone unheard("unheard");
    }
    const Zone three("three");
  }
  const Zone late("late");
  EXPECT_EQ(outer.entered, 2);
  EXPECT_EQ(outer.left, 2);
  EXPECT_EQ(inner.entered, 1);
  EXPECT_EQ(inner.left, 1);
}

TEST(Profile, SumsByPath) {
  Profile profile;
  for (int i = 0; i < 3; ++i) {
    profile.enter("step");
    profile.enter("part");
    profile.leave();
    profile.enter("other");
    profile.enter("part");
    profile.leave();
    profile.leave();
    profile.leave();
  }
  const ProfileData data = profile.data();
  ASSERT_EQ(data.nodes.size(), 4u);
  for (const auto& n : data.nodes) {
    EXPECT_EQ(n.calls, 3u);
    EXPECT_GE(n.total, n.inChildren);
  }
  const auto *step = find(data, "step"), *part = find(data, "part", "step"), *other = find(data, "other", "step"),
             *inner = find(data, "part", "other");
  ASSERT_TRUE(step && part && other && inner);
  EXPECT_EQ(step->inChildren, part->total + other->total);
  EXPECT_EQ(other->inChildren, inner->total);
  EXPECT_EQ(inner->depth, 2);
  EXPECT_EQ(data.events.size(), 12u);
  EXPECT_EQ(treeOrder(data), (std::vector<int>{0, 1, 2, 3}));
}

TEST(Profile, ThreadsHaveTheirOwnStacks) {
  Profile profile;
  profile.enter("mine");
  std::thread([&] {
    profile.enter("theirs");
    profile.leave();
    profile.leave();  // one too many: no harm
  }).join();
  profile.leave();
  const ProfileData data = profile.data();
  EXPECT_EQ(data.threads, 2);
  ASSERT_NE(find(data, "theirs"), nullptr);
  EXPECT_EQ(find(data, "theirs")->depth, 0);
  ASSERT_EQ(data.events.size(), 2u);
  EXPECT_NE(data.events[0].thread, data.events[1].thread);
}

TEST(Profile, KeepsTheLastEventsAndCountsTheOthers) {
  Profile profile(10);
  const int device = profile.addDevice();
  for (int i = 0; i < 25; ++i) {
    profile.enter("zone");
    profile.leave();
    const DeviceSlice slice = sliceAt(1000 * i);
    profile.add(device, {&slice, 1, 500, 0});
  }
  profile.add(device, {nullptr, 0, 500, 2});  // without times
  const ProfileData data = profile.data();
  ASSERT_EQ(data.events.size(), 10u);
  EXPECT_EQ(data.lostEvents, 15u);
  for (size_t i = 1; i < 10; ++i) EXPECT_GE(data.events[i].start, data.events[i - 1].start);
  ASSERT_EQ(data.slices.size(), 10u);
  EXPECT_EQ(data.slices.back().started - data.slices.front().started, 9000);
  EXPECT_EQ(data.lostSlices, 17u);
  EXPECT_EQ(find(data, "zone")->calls, 25u) << "the sums have all";
  ASSERT_EQ(data.launches.size(), 1u);
  EXPECT_EQ(data.launches[0].count, 25u);
  EXPECT_EQ(data.launches[0].total, 25'000);
  const json trace = traceOf(data);
  EXPECT_EQ(trace["otherData"]["lostZones"], 15);
  EXPECT_EQ(trace["otherData"]["lostLaunches"], 17);
}

TEST(Profile, IsBoundedWhateverTheApplicationEnters) {
  Profile profile(10);
  for (int i = 0; i < 50'000; ++i) {
    profile.enter(std::to_string(i).c_str());
    profile.leave();
  }
  for (int i = 0; i < 1000; ++i) profile.enter("deeper and deeper");
  for (int i = 0; i < 1000; ++i) profile.leave();
  profile.enter("7");
  profile.leave();
  const ProfileData data = profile.data();
  EXPECT_LE(data.names.size(), 4096u);
  EXPECT_LE(data.nodes.size(), 16384u);
  EXPECT_EQ(find(data, "7")->calls, 2u) << "known names go on";
  EXPECT_GT(data.lostEvents, 40'000u);
  EXPECT_EQ(profile.depth(), 0u);
}

TEST(Profile, ClosesWhatWasLeftOpen) {
  Profile profile;
  profile.enter("world");
  const size_t depth = profile.depth();
  profile.enter("forgotten");
  profile.enter("too");
  profile.closeTo(depth);
  EXPECT_EQ(profile.depth(), 1u);
  profile.leave();
  EXPECT_EQ(find(profile.data(), "forgotten")->calls, 1u);
}

TEST(Profile, ClearKeepsOpenZones) {
  Profile profile;
  const int device = profile.addDevice();
  profile.enter("open");
  profile.enter("before");
  profile.leave();
  const DeviceSlice slice = sliceAt(0);
  profile.add(device, {&slice, 1, 1, 0});
  profile.countStep();
  profile.clear();
  profile.leave();
  const ProfileData data = profile.data();
  EXPECT_EQ(find(data, "open")->calls, 1u);
  EXPECT_EQ(find(data, "before")->calls, 0u);
  EXPECT_EQ(data.events.size(), 1u);
  EXPECT_EQ(deviceTime(data), 0);
  EXPECT_EQ(data.steps, 0u);
}

TEST(ProfileText, TraceSurvivesNamesOfAnyKind) {
  Profile profile;
  const char* names[] = {"quote \" and \\", "line\nbreak\ttab", "\xff\xfe no UTF-8", "", "a,b"};
  for (const char* name : names) {
    profile.enter(name);
    profile.leave();
  }
  profile.nameDevice(profile.addDevice(), "device \"0\"");
  const auto events = eventsOf(traceOf(profile.data()), "host");
  ASSERT_EQ(events.size(), 5u);
  EXPECT_EQ(events[0]["name"], names[0]);
  EXPECT_EQ(events[1]["name"], names[1]);
  EXPECT_EQ(events[4]["name"], "a,b");
}

TEST(ProfileText, EmptyTraceIsValid) { EXPECT_TRUE(traceOf({}).at("traceEvents").is_array()); }

TEST(ProfileText, DeviceSlices) {
  Profile profile;
  const int device = profile.addDevice();
  const DeviceSlice slices[] = {sliceAt(5000, "30_find", "first"), sliceAt(7500, "70_solve", "second")};
  profile.add(device, {slices, 2, 2500, 0});
  const json trace = traceOf(profile.data());
  const auto events = eventsOf(trace, "device");
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0]["name"], "30_find first");
  EXPECT_EQ(events[1]["args"]["stage"], "70_solve");
  EXPECT_EQ(events[1]["args"]["kernel"], "second");
  // Printed with three digits, of numbers that count from another start: a nanosecond of rounding each.
  EXPECT_NEAR(events[1]["ts"].get<double>() - events[0]["ts"].get<double>(), 2.5, 2.1e-3);
  EXPECT_NEAR(events[0]["dur"].get<double>(), 1.0, 1e-9);
  EXPECT_NEAR(events[0]["ts"].get<double>() - events[0]["args"]["queuedUs"].get<double>(), 0.03, 2.1e-3);
  EXPECT_EQ(trace["otherData"]["deviceClockAccuracyUs"], 2.5);
}

TEST(ProfileText, CsvHasItsColumns) {
  Profile profile;
  const int device = profile.addDevice();
  profile.enter("step");
  profile.enter("a,b");
  profile.leave();
  profile.leave();
  profile.countStep();
  const DeviceSlice slice = sliceAt(0);
  profile.add(device, {&slice, 1, 1, 0});
  const auto lines = linesOf(toCsv(profile.data()));
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_EQ(lines[0], "row,path,name,depth,calls,totalMs,msPerStep,selfMs,share");
  EXPECT_EQ(lines[1].rfind("host,step,step,0,1,", 0), 0u) << lines[1];
  EXPECT_EQ(lines[2].rfind("host,\"step/a,b\",\"a,b\",1,1,", 0), 0u) << lines[2];
  EXPECT_EQ(lines[3], "device,10_stage/kernel,kernel,1,1,0.001000,0.001000,0.001000,1.000000");
}

TEST(ProfileFiles, OneProfileAFileWrittenWhenItsLastWorldGoes) {
  const TemporaryFolder folder;
  const std::string path = folder.file("trace.json");
  auto first = openProfileFile(path);
  ASSERT_NE(first, nullptr);
  EXPECT_TRUE(json::parse(readFile(path)).at("traceEvents").is_array()) << "valid from the start";
  auto second = openProfileFile(path);
  EXPECT_EQ(first.get(), second.get());
  first->enter("zone");
  first->leave();
  first.reset();
  EXPECT_TRUE(eventsOf(json::parse(readFile(path)), "host").empty());
  second.reset();
  EXPECT_EQ(eventsOf(json::parse(readFile(path)), "host").size(), 1u);
  auto third = openProfileFile(path);  // the next level of a game
  third->enter("zone");
  third->leave();
  third.reset();
  EXPECT_EQ(eventsOf(json::parse(readFile(path)), "host").size(), 2u);
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

TEST(ProfileFiles, NameSaysKindAndProcess) {
  const TemporaryFolder folder;
  openProfileFile(folder.file("table-%p.csv"));
  const auto lines = linesOf(readFile(folder.file("table-" + std::to_string(getpid()) + ".csv")));
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0].rfind("row,path", 0), 0u);
}

TEST(ProfileFiles, WhatCannotBeWrittenIsSaidAtOnce) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(openProfileFile("/nowhere/at/all.json"), nullptr);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("/nowhere/at/all.json can't be written"), std::string::npos) << said;
  EXPECT_EQ(openProfileFile(""), nullptr);
}

}  // namespace
}  // namespace btgpu::test
