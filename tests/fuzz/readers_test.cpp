// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The fuzzers' entry points without a fuzzer: the corpus, and thousands of files made of it by a fixed seed. All are
// refused or whole; nothing crashes (the sanitizers' builds run this too).
#include "tests/fuzz/readers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "tests/support/subprocess.h"

namespace btgpu {
namespace {

using Random = std::mt19937;

std::vector<Bytes> corpus(const std::string& reader) {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(BTGPU_SOURCE_DIR "/tests/fuzz/corpus/" + reader)) {
    paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<Bytes> files;
  for (const auto& path : paths) {
    const std::string text = test::readFile(path);
    files.emplace_back(text.begin(), text.end());
  }
  return files;
}

std::ptrdiff_t place(Random& random, const Bytes& bytes) {
  return static_cast<std::ptrdiff_t>(random() % (bytes.size() + 1));
}

// Numbers at which sizes and indices go wrong.
void putNumber(Random& random, Bytes& bytes) {
  constexpr std::uint64_t kNumbers[] = {0,          1,          2,          255,        0x7fffffff,
                                        0x80000000, 0xffffffff, 1ull << 32, 1ull << 40, (1ull << 63) - 1,
                                        1ull << 63, ~0ull - 31, ~0ull - 1,  ~0ull};
  const std::uint64_t number = kNumbers[random() % std::size(kNumbers)];
  const size_t at = random() % (bytes.size() + 1);
  std::memcpy(bytes.data() + at, &number, std::min(bytes.size() - at, random() % 2 ? sizeof number : size_t{4}));
}

void cutOrInsert(Random& random, Bytes& bytes) {
  const auto at = bytes.begin() + place(random, bytes);
  if (random() % 2) {
    bytes.insert(at, random() % 9, static_cast<unsigned char>(random()));
  } else {
    bytes.erase(at, at + static_cast<std::ptrdiff_t>(random() % (static_cast<size_t>(bytes.end() - at) + 1)));
  }
}

// The beginning of one with the end of another.
void splice(Random& random, Bytes& bytes, const Bytes& other) {
  bytes.erase(bytes.begin() + place(random, bytes), bytes.end());
  bytes.insert(bytes.end(), other.begin() + place(random, other), other.end());
}

Bytes mutated(Random& random, const std::vector<Bytes>& files) {
  Bytes bytes = files[random() % files.size()];
  for (size_t i = 1 + random() % 3; i > 0; --i) {
    const auto kind = random() % 8;
    if (kind < 3 && !bytes.empty()) bytes[random() % bytes.size()] ^= static_cast<unsigned char>(1u << random() % 8);
    if (kind >= 3 && kind < 6 && !bytes.empty()) putNumber(random, bytes);
    if (kind == 6) cutOrInsert(random, bytes);
    if (kind == 7) splice(random, bytes, files[random() % files.size()]);
  }
  return bytes;
}

struct Counts {
  int believed = 0, refused = 0;
};

Counts feed(const std::vector<Bytes>& files, int count, const std::function<bool(const Bytes&)>& reader) {
  Random random(1);
  Counts counts;
  for (int i = 0; i < count; ++i) ++(reader(mutated(random, files)) ? counts.believed : counts.refused);
  return counts;
}

// Files whose names begin with "good" are believed, all others refused.
void expectSorted(const std::string& folder, const std::function<bool(const Bytes&)>& reader) {
  int good = 0, bad = 0;
  for (const auto& entry : std::filesystem::directory_iterator(BTGPU_SOURCE_DIR "/tests/fuzz/corpus/" + folder)) {
    const std::string text = test::readFile(entry.path()), name = entry.path().filename().string();
    const bool isGood = name.rfind("good", 0) == 0;
    EXPECT_EQ(reader({text.begin(), text.end()}), isGood) << name;
    ++(isGood ? good : bad);
  }
  EXPECT_GT(good, 0);
  EXPECT_GT(bad, 0);
}

TEST(Readers, CaptureCorpus) { expectSorted("capture", fuzz::tryCapture); }

TEST(Readers, ProgramEntryCorpus) { expectSorted("program_entry", fuzz::tryProgramEntry); }

TEST(Readers, MutatedCaptures) {
  const auto files = corpus("capture");
  const Counts plain = feed(files, 5000, fuzz::tryCapture), mended = feed(files, 5000, fuzz::tryMendedCapture);
  EXPECT_GT(plain.refused, 4500) << "the checksum lets damage through";
  EXPECT_GT(mended.believed, 100) << "nothing gets past the header";
  EXPECT_GT(mended.refused, 100);
}

TEST(Readers, MutatedProgramEntries) {
  const auto files = corpus("program_entry");
  const Counts plain = feed(files, 5000, fuzz::tryProgramEntry),
               mended = feed(files, 5000, fuzz::tryMendedProgramEntry);
  EXPECT_GT(plain.refused, 4500) << "the checksum lets damage through";
  EXPECT_GT(mended.believed, 100) << "nothing gets past the header";
  EXPECT_GT(mended.refused, 100);
}

// What makes a mutation of nothing else.
TEST(Readers, NoiseOfAllLengths) {
  Random random(2);
  for (size_t length = 0; length < 600; ++length) {
    Bytes bytes(length);
    for (auto& b : bytes) b = static_cast<unsigned char>(random() % 4 ? random() : 0);
    EXPECT_FALSE(fuzz::tryCapture(bytes));
    EXPECT_FALSE(fuzz::tryProgramEntry(bytes));
    fuzz::tryMendedCapture(bytes);
    fuzz::tryMendedProgramEntry(bytes);
  }
}

}  // namespace
}  // namespace btgpu
