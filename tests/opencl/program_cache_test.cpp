// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The program cache on disk, and the errors of programs that do not build. Each test has a cache directory of
// its own; "a second process" is a second ComputeDevice, which has a context and a program cache of its own.
#include "gpu_engine/opencl/program_cache.h"

#include <sys/resource.h>

#include <csignal>
#include <fstream>

#include "gpu_engine/opencl/kernel_sources.h"
#include "gpu_engine/primitives/primitives.h"
#include "tests/support/device_test.h"
#include "tests/support/scoped_environment.h"
#include "tests/support/subprocess.h"

namespace btgpu {
namespace {

using Statistics = ProgramCache::Statistics;
using test::readFile;
using test::TemporaryFolder;
using test::writeFile;

void expectStatistics(const Statistics& s, int built, int loaded, int rejected) {
  EXPECT_EQ(s.built, built);
  EXPECT_EQ(s.loaded, loaded);
  EXPECT_EQ(s.rejected, rejected);
}

class ProgramCacheTest : public DeviceTest {
 protected:
  std::shared_ptr<ComputeDevice> freshDevice() {
    return std::make_shared<ComputeDevice>(device().device(), device().description(), device().shape());
  }

  // Fills an array on a fresh device, checks the result and saves the programs: what a process does.
  Statistics runProcess() {
    const auto fresh = freshDevice();
    Queue freshQueue(fresh, false);
    Fill fill(*fresh);
    DeviceArray<uint> data("data");
    data.copyFromHost(freshQueue, std::vector<uint>(300, 7));
    fill.run(freshQueue, data, 1, 298, 42);
    std::vector<uint> expected(300, 42);
    expected.front() = expected.back() = 7;
    EXPECT_EQ(data.toVector(freshQueue), expected);
    saveAll(*fresh);
    return fresh->programs().statistics();
  }

  static void saveAll(ComputeDevice& device) {
    while (device.programs().saveNext()) continue;
  }

  std::vector<std::filesystem::path> entries() const {
    std::vector<std::filesystem::path> paths;
    for (const auto& entry : std::filesystem::directory_iterator(m_directory.path())) paths.push_back(entry.path());
    return paths;
  }

  // All kernel sources, as a checkout has them below `root`.
  static void writeKernels(const std::filesystem::path& root) {
    for (const auto& [path, text] : embeddedKernels()) {
      std::filesystem::create_directories((root / path).parent_path());
      writeFile(root / path, text);
    }
  }

  // The damaged entry must be rejected and rebuilt, and after that be good again.
  void expectRejected(const std::filesystem::path& path, const std::string& damaged, const std::string& what) {
    SCOPED_TRACE(what);
    writeFile(path, damaged);
    expectStatistics(runProcess(), 1, 0, 1);
    expectStatistics(runProcess(), 0, 1, 0);
  }

  TemporaryFolder m_directory;
  ScopedVariable m_variable{"BTGPU_CACHE_DIR", m_directory.path().string()};
};

TEST_F(ProgramCacheTest, BuiltOnceThenLoaded) {
  expectStatistics(runProcess(), 1, 0, 0);
  ASSERT_EQ(entries().size(), 1u) << "one entry, and no temporary file left";
  expectStatistics(runProcess(), 0, 1, 0);
  expectStatistics(runProcess(), 0, 1, 0);
  EXPECT_EQ(entries().size(), 1u);
}

TEST_F(ProgramCacheTest, InMemoryWithinADevice) {
  const auto fresh = freshDevice();
  Fill first(*fresh), second(*fresh);
  expectStatistics(fresh->programs().statistics(), 1, 0, 0);
}

// Also programs that a world comes to need long after its first step are kept for the next process.
TEST_F(ProgramCacheTest, SavedOneByOne) {
  const auto fresh = freshDevice();
  ProgramCache& programs = fresh->programs();
  EXPECT_FALSE(programs.saveNext());
  programs.get("primitives/fill.cl");
  programs.get("primitives/bound_search.cl");
  EXPECT_TRUE(entries().empty());
  EXPECT_TRUE(programs.saveNext());
  EXPECT_EQ(entries().size(), 1u);
  EXPECT_TRUE(programs.saveNext());
  EXPECT_EQ(entries().size(), 2u);
  EXPECT_FALSE(programs.saveNext());
  programs.get("primitives/compact.cl");
  EXPECT_TRUE(programs.saveNext());
  EXPECT_EQ(entries().size(), 3u);
}

// Each set of options and each shape is a program of its own.
TEST_F(ProgramCacheTest, OptionsMakeOtherEntries) {
  const auto otherShape = device().shape() == KernelShape::Cpu ? KernelShape::Gpu : KernelShape::Cpu;
  const auto fresh = freshDevice();
  const auto twin = std::make_shared<ComputeDevice>(device().device(), device().description(), otherShape);
  fresh->programs().get("primitives/radix_sort.cl");
  fresh->programs().get("primitives/radix_sort.cl", "-DBTGPU_KEY64");
  twin->programs().get("primitives/radix_sort.cl");
  expectStatistics(fresh->programs().statistics(), 2, 0, 0);
  expectStatistics(twin->programs().statistics(), 1, 0, 0);
  saveAll(*fresh);
  saveAll(*twin);
  EXPECT_EQ(entries().size(), 3u);
}

// The types of arguments are still checked when the program comes from disk.
TEST_F(ProgramCacheTest, LoadedProgramsAreStillChecked) {
  runProcess();
  const auto fresh = freshDevice();
  Queue freshQueue(fresh, false);
  Kernel fill(*fresh, "primitives/fill.cl", "fillUint");
  expectStatistics(fresh->programs().statistics(), 0, 1, 0);
  DeviceArray<float> floats("floats");
  floats.copyFromHost(freshQueue, {1.0f});
  EXPECT_THROW(fill.launch(freshQueue, fresh->grid(1), 0u, 1u, 9u, floats), OpenClError);
}

TEST_F(ProgramCacheTest, DamagedFilesAreRejected) {
  runProcess();
  ASSERT_EQ(entries().size(), 1u);
  const auto path = entries().front();
  const std::string good = readFile(path);
  ASSERT_GT(good.size(), 1000u);

  expectRejected(path, "", "empty");
  expectRejected(path, good.substr(0, 10), "ends in the header");
  expectRejected(path, good.substr(0, 100), "ends in the key");
  expectRejected(path, good.substr(0, good.size() - 1), "last byte missing");
  expectRejected(path, good + "x", "one byte too long");
  expectRejected(path, std::string(good.size(), '\0'), "all zero");
  // Bits of the magic number, the three sizes of the header (32 bytes), the key and the binary.
  for (const size_t at : {size_t{0}, size_t{8}, size_t{15}, size_t{16}, size_t{23}, size_t{24}, size_t{31}, size_t{32},
                          size_t{200}, good.size() / 2, good.size() - 1}) {
    std::string damaged = good;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    expectRejected(path, damaged, "bit flipped at byte " + std::to_string(at));
  }
}

// An entry of another program under this one's name, as after a collision of hashes: whole, but not ours.
TEST_F(ProgramCacheTest, EntryOfAnotherProgramIsRejected) {
  runProcess();
  ASSERT_EQ(entries().size(), 1u);
  const auto path = entries().front();
  std::filesystem::remove(path);
  const auto fresh = freshDevice();
  fresh->programs().get("primitives/bound_search.cl");
  saveAll(*fresh);
  ASSERT_EQ(entries().size(), 1u);
  std::filesystem::rename(entries().front(), path);
  expectStatistics(runProcess(), 1, 0, 1);
  expectStatistics(runProcess(), 0, 1, 0);
}

// The source is part of the key, so an edited kernel is never served from an old entry.
TEST_F(ProgramCacheTest, EditedSourceIsBuiltAnew) {
  const TemporaryFolder sources;
  writeKernels(sources.path());
  const ScopedVariable root("BTGPU_KERNEL_DIR", sources.path().string());
  expectStatistics(runProcess(), 1, 0, 0);
  expectStatistics(runProcess(), 0, 1, 0);
  const auto file = sources.path() / "kernels/primitives/fill.cl";
  writeFile(file, readFile(file) + "\n// edited\n");
  expectStatistics(runProcess(), 1, 0, 0);
  const auto header = sources.path() / "kernels/lib/kernel.h";
  writeFile(header, readFile(header) + "\n// edited\n");
  expectStatistics(runProcess(), 1, 0, 0);
}

// The tests may run as root, whom no permission stops: a directory below a file can't be made by anyone.
TEST_F(ProgramCacheTest, UnwritableDirectoryOnlyCostsTime) {
  const auto file = m_directory.path() / "file";
  writeFile(file, "not a directory");
  const ScopedVariable variable("BTGPU_CACHE_DIR", (file / "cache").string());
  expectStatistics(runProcess(), 1, 0, 0);
  expectStatistics(runProcess(), 1, 0, 0);
  EXPECT_EQ(readFile(file), "not a directory");
}

// While it lives no file can grow: what is written ends as on a full disk.
class FullDisk {
 public:
  FullDisk() : m_handler(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &m_before);
    rlimit none = m_before;
    none.rlim_cur = 16;  // the beginning of an entry still fits
    setrlimit(RLIMIT_FSIZE, &none);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &m_before);
    std::signal(SIGXFSZ, m_handler);
  }

 private:
  void (*m_handler)(int);
  rlimit m_before{};
};

// PoCL ends the process if its linker finds no room, so it has to have linked the program before.
TEST_F(ProgramCacheTest, FullDiskOnlyCostsTime) {
  runProcess();
  std::filesystem::remove(entries().at(0));
  for (int i = 0; i < 2; ++i) {
    const auto fresh = freshDevice();
    Fill fill(*fresh);
    const FullDisk full;
    saveAll(*fresh);
    expectStatistics(fresh->programs().statistics(), 1, 0, 0);
    EXPECT_TRUE(entries().empty()) << "half an entry was left";
  }
  expectStatistics(runProcess(), 1, 0, 0);
  expectStatistics(runProcess(), 0, 1, 0);
}

// A directory where the entry should be: it can be neither read nor replaced.
TEST_F(ProgramCacheTest, EntryThatCannotBeReplaced) {
  runProcess();
  ASSERT_EQ(entries().size(), 1u);
  const auto path = entries().front();
  std::filesystem::remove(path);
  std::filesystem::create_directories(path / "inside");
  expectStatistics(runProcess(), 1, 0, 1);
  expectStatistics(runProcess(), 1, 0, 1);
  EXPECT_EQ(entries().size(), 1u) << "a temporary file was left";
}

TEST_F(ProgramCacheTest, NoDirectoryAtAll) {
  const ScopedVariable none("BTGPU_CACHE_DIR", ""), xdg("XDG_CACHE_HOME", ""), home("HOME", "");
  EXPECT_TRUE(ProgramCache::directory().empty());
  expectStatistics(runProcess(), 1, 0, 0);
  expectStatistics(runProcess(), 1, 0, 0);
}

TEST_F(ProgramCacheTest, DirectoryByEnvironment) {
  EXPECT_EQ(ProgramCache::directory(), m_directory.path());
  const ScopedVariable none("BTGPU_CACHE_DIR", ""), home("HOME", "/home/someone");
  {
    const ScopedVariable xdg("XDG_CACHE_HOME", "/somewhere/cache");
    EXPECT_EQ(ProgramCache::directory(), "/somewhere/cache/btgpu");
  }
  const ScopedVariable xdg("XDG_CACHE_HOME", "relative");  // the XDG specification: ignore it
  EXPECT_EQ(ProgramCache::directory(), "/home/someone/.cache/btgpu");
}

// A copy of kernels/ in which one line has been replaced.
class BuildErrorTest : public ProgramCacheTest {
 protected:
  BuildErrorTest() { writeKernels(m_sources.path()); }

  // Puts `text` in place of the line that contains `where`; returns that line's number.
  int breakLine(const std::string& file, const std::string& where, const std::string& text) {
    std::ifstream in(m_sources.path() / file);
    std::string out, line;
    int number = 0, broken = 0;
    while (std::getline(in, line)) {
      ++number;
      if (!broken && line.find(where) != std::string::npos) {
        broken = number;
        line = text;
      }
      out += line + "\n";
    }
    in.close();
    writeFile(m_sources.path() / file, out);
    EXPECT_NE(broken, 0) << file << " has no " << where;
    return broken;
  }

  void expectBuildError(const std::string& program, const std::string& file, int line) {
    try {
      device().programs().get(program);
      FAIL() << "the program was built";
    } catch (const OpenClError& e) {
      EXPECT_EQ(e.kind(), OpenClError::Kind::Build);
      const std::string message = e.what();
      EXPECT_NE(message.find("kernels/" + program), std::string::npos) << message;
      EXPECT_NE(message.find(file + ":" + std::to_string(line)), std::string::npos)
          << "no " << file << ":" << line << " in\n"
          << message;
    }
  }

  TemporaryFolder m_sources;
  ScopedVariable m_root{"BTGPU_KERNEL_DIR", m_sources.path().string()};
};

TEST_F(BuildErrorTest, NamesFileAndLine) {
  const int line = breakLine("kernels/primitives/fill.cl", "FOR_EACH", "  this_is_no_type x;");
  expectBuildError("primitives/fill.cl", "kernels/primitives/fill.cl", line);
}

TEST_F(BuildErrorTest, NamesTheIncludedFile) {
  const int line = breakLine("kernels/lib/kernel.h", "return counter ?", "  return this_is_unknown;");
  expectBuildError("primitives/fill.cl", "kernels/lib/kernel.h", line);
}

// Behind includes that include others the line numbers are right again.
TEST_F(BuildErrorTest, NamesTheLineBehindIncludes) {
  const int line = breakLine("kernels/stages/46_clip_faces.cl", "= raw;", "    AT(contacts, i) = rav;");
  expectBuildError("stages/46_clip_faces.cl", "kernels/stages/46_clip_faces.cl", line);
}

// As NVIDIA's compiler counts: lines of the source that it was given, whatever #line says.
TEST(BuildLog, LinesOfTheExpandedSourceAreNamed) {
  const std::string source =
      "#line 1 \"kernels/a.cl\"\nfirst\n#line 1 \"kernels/lib/b.h\"\nin b\nagain\n#line 3 \"kernels/a.cl\"\nthird\n";
  EXPECT_EQ(nameLines("<kernel>:2:7: error: x\n<kernel>:5:1: note: y\n<kernel>:7:2: z\n", source),
            "kernels/a.cl:1:7: error: x\nkernels/lib/b.h:2:1: note: y\nkernels/a.cl:3:2: z\n");
  EXPECT_EQ(nameLines("kernels/a.cl:9:1: error\n<kernel>:99:1: beyond\n<kernel>:0:1\n", source),
            "kernels/a.cl:9:1: error\n<kernel>:99:1: beyond\n<kernel>:0:1\n");
  EXPECT_EQ(nameLines("", source), "");
}

TEST_F(BuildErrorTest, MissingIncludeIsNamed) {
  breakLine("kernels/lib/group_scan.h", "#include", "#include \"missing.h\"");
  try {
    device().programs().get("primitives/scan.cl");
    FAIL() << "the program was built";
  } catch (const OpenClError& e) {
    EXPECT_EQ(e.kind(), OpenClError::Kind::Build);
    EXPECT_NE(std::string(e.what()).find("kernels/lib/missing.h"), std::string::npos) << e.what();
  }
}

// A failed build is not remembered: once the source is right it builds.
TEST_F(BuildErrorTest, RightedSourceBuilds) {
  const auto file = m_sources.path() / "kernels/primitives/fill.cl";
  const std::string good = readFile(file);
  writeFile(file, good + "\nerror\n");
  EXPECT_THROW(runProcess(), OpenClError);
  EXPECT_TRUE(entries().empty());
  writeFile(file, good);
  expectStatistics(runProcess(), 1, 0, 0);
}

}  // namespace
}  // namespace btgpu
