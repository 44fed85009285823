// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Teams of work groups (kernels/lib/team.h): every part of every round is done once, and no round begins before the
// last one is done, however many members there are and whoever leaves.
#include <vector>

#include "gpu_engine/opencl/kernel.h"
#include "kernels/shared/team.h"
#include "tests/support/device_test.h"

namespace btgpu {
namespace {

constexpr uint kNever = 0xffffffffu;

class TeamTest : public DeviceTest {
 protected:
  void SetUp() override {
    DeviceTest::SetUp();
    m_team.copyFromHost(queue(), std::vector<uint>(TEAM_SIZE, 0));
  }

  // Plays the rounds with `members` work groups; the number of members that left early.
  uint expectPlayed(const std::vector<uint>& partsOf, uint items, size_t members, uint slowRound = kNever,
                    uint delay = 0) {
    Kernel play(device(), "primitives/team_rounds.cl", "playRounds");
    DeviceArray<uint> parts("parts"), values("values"), last("last values"), visits("visits"), impatient("impatient");
    std::vector<uint> even(items), odd(items), expectedVisits(TEAM_PARTS, 0);
    for (uint i = 0; i < items; ++i) odd[i] = i * i;
    parts.copyFromHost(queue(), partsOf);
    values.copyFromHost(queue(), even);
    last.copyFromHost(queue(), odd);
    visits.copyFromHost(queue(), expectedVisits);
    impatient.copyFromHost(queue(), {0});
    play.launch(queue(), {members, 1}, static_cast<uint>(partsOf.size()), items, slowRound, delay, parts, values, last,
                visits, impatient, m_team);

    for (size_t round = 0; round < partsOf.size(); ++round) {
      if (partsOf[round] == 0) continue;
      auto& to = round % 2 ? odd : even;
      const auto& from = round % 2 ? even : odd;
      for (uint i = 0; i < items; ++i) to[i] = from[(i + 1) % items] + from[(i + items - 1) % items] + 1;
      for (uint part = 0; part < partsOf[round]; ++part) ++expectedVisits[part];
    }
    EXPECT_EQ(values.toVector(queue()), even);
    EXPECT_EQ(last.toVector(queue()), odd);
    EXPECT_EQ(visits.toVector(queue()), expectedVisits);
    EXPECT_EQ(m_team.toVector(queue()), std::vector<uint>(TEAM_SIZE, 0)) << "not as it was found";
    return impatient.toVector(queue())[0];
  }

  DeviceArray<uint> m_team{"team"};
};

// Rounds of all sizes, some of them empty.
std::vector<uint> mixedRounds(size_t count) {
  std::vector<uint> partsOf;
  for (size_t i = 0; i < count; ++i) partsOf.push_back(static_cast<uint>(i * 7 % (TEAM_PARTS + 1)));
  return partsOf;
}

TEST_F(TeamTest, MembersSmall) {
  for (const size_t members : {1, 2, 5}) EXPECT_EQ(expectPlayed(mixedRounds(20), 100, members), 0u);
  expectPlayed({}, 1, 2);
  expectPlayed({1}, 1, 2);
}

// More members than threads: those that come late find everything done.
TEST_F(TeamTest, Members) {
  for (const size_t members : {1, 2, 3, 16, 100}) {
    SCOPED_TRACE(members);
    for (const uint items : {1u, 63u, 5000u}) expectPlayed(mixedRounds(300), items, members);
  }
}

// Rounds that are next to nothing, so that members meet at every claim.
TEST_F(TeamTest, ShortRounds) {
  for (const uint parts : {1u, 2u, 3u}) expectPlayed(std::vector<uint>(20000, parts), 3, 2);
}

// Who waits for a part that takes long leaves, and the others do the rest.
TEST_F(TeamTest, Impatience) {
  const size_t threads = device().description().computeUnits;
  uint impatient = 0;
  // Whether the other threads are awake by then is not in our hands.
  for (int attempt = 0; attempt < 20 && impatient == 0; ++attempt) {
    impatient = expectPlayed(std::vector<uint>(2000, 8), 5000, threads, 1000, 100'000'000);
  }
  EXPECT_EQ(impatient > 0, threads > 1);
  EXPECT_LT(impatient, threads) << "somebody carries on";
}

}  // namespace
}  // namespace btgpu
