// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Capture files (docs/capture.md): what is written is read again; whatever is damaged is refused, and never believed.
#include "gpu_engine/debug/capture_file.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "gpu_engine/debug/array_difference.h"
#include "gpu_engine/debug/capture_bytes.h"
#include "gpu_engine/debug/capture_request.h"
#include "gpu_engine/debug/word_names.h"
#include "gpu_engine/opencl/error.h"
#include "kernels/shared/contact.h"
#include "tests/support/subprocess.h"

namespace btgpu {
namespace {

constexpr size_t kHeader = 32, kChecksum = 24;

// One of everything.
Capture example() {
  using Kind = CapturedArgument::Kind;
  Capture c;
  c.stage = "44_find_separating_axis";
  c.step = 120;
  c.version = "0.1.0";
  c.device = "a device";
  c.driver = "1.2";
  c.cpuShape = true;
  c.buildOptions = "-DX";
  c.arrays.push_back({"poses", "uint", 4, {1, 2, 3, 4, 5, 6, 7, 8}, {}});
  c.arrays.push_back({"pairs", "ulong", 8, {1, 2, 3, 4, 5, 6, 7, 8}, {8, 7, 6, 5, 4, 3, 2, 1}});
  c.commands.emplace_back(CapturedLaunch{
      "stages/44.cl",
      "find",
      "-DKEY",
      256,
      128,
      {{Kind::Array, 1, {}}, {Kind::Null, 0, "uint"}, {Kind::Uint, 7, {}}, {Kind::Float, 0x3f800000u, {}}}});
  c.commands.emplace_back(CapturedWrite{0, 4, {9, 9}});
  c.commands.emplace_back(CapturedCopy{0, 1, 1, 2, 3});
  c.views.push_back({"poses", 0, 1, 8, 4});
  c.views.push_back({"joints", CapturedView::kNone, CapturedView::kNone, 0, 0});
  c.numbers = {7, ~0ull};
  return c;
}

std::string messageOf(const Bytes& bytes) {
  try {
    decodeCapture(bytes);
  } catch (const CaptureError& e) { return e.what(); }
  return "";
}

Bytes withChecksum(Bytes bytes) {
  const std::uint64_t sum = checksumOf(bytes.data() + kHeader, bytes.size() - kHeader);
  std::memcpy(bytes.data() + kChecksum, &sum, sizeof sum);
  return bytes;
}

// Damage that the checksum does not show: either it is refused, or it gave another capture, whole in itself.
bool expectRefusedOrWhole(const Bytes& bytes) {
  try {
    EXPECT_EQ(encodeCapture(decodeCapture(bytes)), bytes);
    return false;
  } catch (const CaptureError&) { return true; }
}

TEST(CaptureFile, IsReadAsWritten) {
  const Bytes bytes = encodeCapture(example());
  const Capture c = decodeCapture(bytes);
  EXPECT_EQ(c.stage, "44_find_separating_axis");
  EXPECT_EQ(c.step, 120u);
  EXPECT_EQ(c.device + c.driver + c.version + c.buildOptions, "a device1.20.1.0-DX");
  EXPECT_TRUE(c.cpuShape);
  ASSERT_EQ(c.arrays.size(), 2u);
  EXPECT_EQ(c.arrays[0].name, "poses");
  EXPECT_EQ(c.arrays[0].elementBytes, 4u);
  EXPECT_EQ(c.arrays[0].expected(), example().arrays[0].before);
  EXPECT_EQ(c.arrays[1].expected(), example().arrays[1].after);
  ASSERT_EQ(c.commands.size(), 3u);
  const auto& launch = std::get<CapturedLaunch>(c.commands[0]);
  EXPECT_EQ(launch.file + launch.name + launch.options, "stages/44.clfind-DKEY");
  EXPECT_EQ(launch.global, 256u);
  EXPECT_EQ(launch.local, 128u);
  ASSERT_EQ(launch.arguments.size(), 4u);
  EXPECT_EQ(launch.arguments[1].type, "uint");
  EXPECT_EQ(launch.arguments[3].value, 0x3f800000u);
  EXPECT_EQ(std::get<CapturedWrite>(c.commands[1]).offset, 4u);
  EXPECT_EQ(std::get<CapturedCopy>(c.commands[2]).bytes, 3u);
  ASSERT_EQ(c.views.size(), 2u);
  EXPECT_EQ(c.views[0].array + c.views[1].array, "posesjoints");
  EXPECT_EQ(c.views[0].after, 1u);
  EXPECT_EQ(c.views[0].bytesAfter, 4u);
  EXPECT_EQ(c.views[1].before, CapturedView::kNone);
  EXPECT_EQ(c.numbers, (std::vector<std::uint64_t>{7, ~0ull}));
  EXPECT_EQ(encodeCapture(c), bytes);
}

// Captures made before there was anything for the reference.
TEST(CaptureFile, TheFormatWithoutInputs) {
  Capture c = example();
  c.views.clear();
  c.numbers.clear();
  const Bytes bytes = encodeCapture(c);
  EXPECT_EQ(bytes[8], 1);
  EXPECT_EQ(encodeCapture(decodeCapture(bytes)), bytes);
  Bytes other = bytes;
  other[8] = 2;
  EXPECT_NE(messageOf(other), "");
  other = encodeCapture(example());
  other[8] = 1;
  EXPECT_NE(messageOf(other), "");
}

// The bytes of docs/capture.md.
TEST(CaptureFile, HeaderIsAsDocumented) {
  const Bytes bytes = encodeCapture(example());
  EXPECT_EQ(std::string(bytes.begin(), bytes.begin() + 8), "btgpucap");
  EXPECT_EQ(Bytes(bytes.begin() + 8, bytes.begin() + 16), (Bytes{2, 0, 0, 0, 0, 0, 0, 0}));
  std::uint64_t size;
  std::memcpy(&size, bytes.data() + 16, sizeof size);
  EXPECT_EQ(size, bytes.size());
  EXPECT_EQ(Bytes(bytes.begin() + 32, bytes.begin() + 40), (Bytes{23, 0, 0, 0, '4', '4', '_', 'f'}));
}

TEST(CaptureFile, EachByteOfTheHeaderCounts) {
  const Bytes good = encodeCapture(example());
  for (size_t i = 0; i < kHeader; ++i) {
    Bytes bytes = good;
    bytes[i] ^= 0x41;
    const char* part = i < 8    ? "no capture"
                       : i < 12 ? "format"
                       : i < 16 ? "unused"
                       : i < 24 ? "bytes long"
                                : "checksum";
    EXPECT_NE(messageOf(bytes).find(part), std::string::npos) << i << ": " << messageOf(bytes);
  }
}

TEST(CaptureFile, CutOffAnywhere) {
  const Bytes good = encodeCapture(example());
  for (size_t length = 0; length < good.size(); ++length) {
    const Bytes cut(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_NE(messageOf(cut), "") << length;
    if (length < kHeader) continue;
    // Even one that claims to be whole.
    Bytes lying = cut;
    const std::uint64_t size = length;
    std::memcpy(lying.data() + 16, &size, sizeof size);
    EXPECT_NE(messageOf(withChecksum(lying)), "") << length;
  }
  Bytes longer = good;
  longer.push_back(0);
  EXPECT_NE(messageOf(longer), "");
}

TEST(CaptureFile, FlippedBits) {
  const Bytes good = encodeCapture(example());
  std::mt19937 random(1);
  int refused = 0, other = 0;
  for (int i = 0; i < 200; ++i) {
    Bytes bytes = good;
    bytes[random() % bytes.size()] ^= static_cast<unsigned char>(1u << random() % 8);
    EXPECT_NE(messageOf(bytes), "") << i;
    ++(expectRefusedOrWhole(withChecksum(bytes)) ? refused : other);
  }
  EXPECT_GT(refused, 0);
  EXPECT_GT(other, 0) << "the checksum was not made good";
}

// Lengths, indices and ranges of all sizes, at every place: nothing is allocated that the file can't hold.
TEST(CaptureFile, NumbersThatCanNotBe) {
  const Bytes good = encodeCapture(example());
  int refused = 0;
  for (const std::uint64_t number :
       {~0ull, 1ull << 63, 0xffffffffull, 0x7fffffffull, 0x100000000ull, 1ull << 40, 0ull}) {
    for (size_t at = kHeader; at + 8 <= good.size(); ++at) {
      Bytes bytes = good;
      std::memcpy(bytes.data() + at, &number, sizeof number);
      refused += expectRefusedOrWhole(withChecksum(bytes));
    }
  }
  EXPECT_GT(refused, 100);
}

TEST(CaptureFile, ContradictionsAreRefused) {
  const auto refused = [](const std::function<void(Capture&)>& spoil) {
    Capture c = example();
    spoil(c);
    return messageOf(encodeCapture(c));
  };
  const auto launch = [](Capture& c) -> CapturedLaunch& { return std::get<CapturedLaunch>(c.commands[0]); };
  EXPECT_EQ(refused([](Capture&) {}), "");
  EXPECT_NE(refused([](Capture& c) { c.arrays[0].before.pop_back(); }), "");
  EXPECT_NE(refused([](Capture& c) { c.arrays[0].elementBytes = 0; }), "");
  EXPECT_NE(refused([](Capture& c) { c.arrays[0].before.clear(); }), "");
  EXPECT_NE(refused([&](Capture& c) { launch(c).arguments[0].value = 2; }), "");
  EXPECT_NE(refused([&](Capture& c) { launch(c).local = 100; }), "");
  EXPECT_NE(refused([&](Capture& c) { launch(c).local = 0; }), "");
  EXPECT_NE(refused([&](Capture& c) { launch(c).file = "../../etc/passwd"; }), "");
  EXPECT_NE(refused([](Capture& c) { std::get<CapturedWrite>(c.commands[1]).offset = 7; }), "");
  EXPECT_NE(refused([](Capture& c) { std::get<CapturedWrite>(c.commands[1]).offset = ~0ull; }), "");
  EXPECT_NE(refused([](Capture& c) { std::get<CapturedCopy>(c.commands[2]).fromOffset = 6; }), "");
  EXPECT_NE(refused([](Capture& c) { std::get<CapturedCopy>(c.commands[2]).to = 0; }), "");
  EXPECT_NE(refused([](Capture& c) { c.views[0].before = 2; }), "");
  EXPECT_NE(refused([](Capture& c) { c.views[0].bytesAfter = 9; }), "");
}

TEST(CaptureFile, FilesThatAreNone) {
  const test::TemporaryFolder folder;
  for (const std::string& path : {folder.file("missing"), folder.path().string(), std::string("/dev/zero")}) {
    EXPECT_THROW(readCapture(path), CaptureError) << path;
  }
  test::writeFile(folder.file("empty"), "");
  EXPECT_THROW(readCapture(folder.file("empty")), CaptureError);
  EXPECT_THROW(writeCapture(folder.file("no/such/folder"), example()), CaptureError);
  writeCapture(folder.file("good"), example());
  EXPECT_EQ(encodeCapture(readCapture(folder.file("good"))), encodeCapture(example()));
}

TEST(CaptureRequests, Forms) {
  const auto requests = parseCaptureRequests("44@120,70_solve_velocities@0");
  ASSERT_EQ(requests.size(), 2u);
  EXPECT_TRUE(requests[0].matches("44_find_separating_axis", 120));
  EXPECT_TRUE(requests[0].matches("44_find_closest_features", 120));
  EXPECT_FALSE(requests[0].matches("44_find_separating_axis", 119));
  EXPECT_FALSE(requests[0].matches("46_clip_faces", 120));
  EXPECT_TRUE(requests[1].matches("70_solve_velocities", 0));
  EXPECT_FALSE(requests[1].matches("70_solve", 0));
  const auto all = parseCaptureRequests("all@7").front();
  EXPECT_TRUE(all.matches("44_find_separating_axis", 7));
  EXPECT_FALSE(all.matches("44_find_separating_axis", 6));
  EXPECT_TRUE((CaptureRequest{"all", CaptureRequest::kEveryStep}.matches("10_apply_forces", 0)));
  for (const char* bad :
       {"all", "al@1", "44", "@3", "44@", "44@x", "44@-1", "4@1", "44@1,,45@1", "44@9999999999", "44 @1", "x"}) {
    EXPECT_THROW(parseCaptureRequests(bad), OpenClError) << bad;
  }
}

TEST(WordNames, Fields) {
  EXPECT_EQ(nameOfWord("float", 4, 0).field, "");
  EXPECT_TRUE(nameOfWord("float", 4, 0).isFloat);
  EXPECT_FALSE(nameOfWord("uint", 4, 0).isFloat);
  EXPECT_EQ(nameOfWord("BodyPose", 32, 20).field, "orientation[1]");
  EXPECT_TRUE(nameOfWord("BodyPose", 32, 20).isFloat);
  EXPECT_EQ(nameOfWord("Pair", 16, 12).field, "bucket");
  EXPECT_FALSE(nameOfWord("Pair", 16, 12).isFloat);
  const size_t second = offsetof(Manifold, points) + sizeof(ContactPoint);
  EXPECT_EQ(nameOfWord("Manifold", 480, second + 4).field, "points[1].localPointA[1]");
  EXPECT_EQ(nameOfWord("Manifold", 480, second + offsetof(ContactPoint, lifeTime)).field, "points[1].lifeTime");
  EXPECT_FALSE(nameOfWord("Manifold", 480, second + offsetof(ContactPoint, lifeTime)).isFloat);
  EXPECT_EQ(nameOfWord("Manifold", 479, 0).field, "") << "a struct of another version";
  EXPECT_EQ(nameOfWord("Nothing", 8, 0).field, "");
}

template <typename T>
Bytes bytesOf(const std::vector<T>& values) {
  const auto* from = reinterpret_cast<const unsigned char*>(values.data());
  return {from, from + values.size() * sizeof(T)};
}

TEST(ArrayDifference, Floats) {
  const CapturedArray was{"speeds", "float", 4, bytesOf<float>({1, 2, -0.0f, 4}), {}};
  const ArrayDifference same = compareArray(was, was.before);
  EXPECT_EQ(same.different, 0u);
  EXPECT_EQ(same.elements, 4u);
  const ArrayDifference d = compareArray(was, bytesOf<float>({1, std::nextafter(2.0f, 3.0f), 0.0f, 5}));
  EXPECT_EQ(d.different, 3u);
  EXPECT_EQ(d.firstElement, 1u);
  EXPECT_EQ(d.mostUlps, 1u << 21);  // from 4 to 5: a quarter of the 2^23 floats between 4 and 8
  EXPECT_EQ(d.mostAbsolute, 1);
  EXPECT_EQ(
      describe(was, d),
      "speeds: 3 of 4 elements differ, by up to 2097152 ulps (1); first: [1] is 2.00000024 (0x40000001) and was 2 "
      "(0x40000000)");
}

TEST(ArrayDifference, AcrossZeroAndNan) {
  const float tiny = std::nextafter(0.0f, 1.0f), nan = std::nanf("");
  const CapturedArray was{"a", "float", 4, bytesOf<float>({tiny, nan}), {}};
  EXPECT_EQ(compareArray(was, bytesOf<float>({-tiny, nan})).mostUlps, 2u);
  const ArrayDifference d = compareArray(was, bytesOf<float>({tiny, 1}));
  EXPECT_EQ(d.different, 1u);
  EXPECT_NE(describe(was, d).find("by NaN"), std::string::npos) << describe(was, d);
}

TEST(ArrayDifference, StructsAndLongs) {
  std::vector<Pair> pairs = {{1, 2, 3, 4}, {5, 6, 7, 8}};
  const CapturedArray was{"pairs", "Pair", 16, {}, bytesOf(pairs)};
  pairs[1].oldManifold = 9;
  const ArrayDifference d = compareArray(was, bytesOf(pairs));
  EXPECT_EQ(describe(was, d),
            "pairs: 1 of 2 elements differ; first: [1].oldManifold is 9 (0x00000009) and was 7 (0x00000007)");
  const CapturedArray keys{"keys", "ulong", 8, bytesOf<ulong>({1, 1ul << 32 | 5}), {}};
  EXPECT_EQ(describe(keys, compareArray(keys, bytesOf<ulong>({1, 1ul << 32 | 6}))),
            "keys: 1 of 2 elements differ; first: [1] is 0x0000000100000006 and was 0x0000000100000005");
}

}  // namespace
}  // namespace btgpu
