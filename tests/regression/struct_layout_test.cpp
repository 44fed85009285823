// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The device's compiler must lay out every shared struct as the host's does; a kernel reports what it sees.
#include <cstddef>
#include <regex>
#include <set>

#include "gpu_engine/opencl/kernel.h"
#include "gpu_engine/opencl/kernel_sources.h"
#include "kernels/shared/struct_fields.h"
#include "tests/support/device_test.h"

namespace btgpu {
namespace {

struct Field {
  std::string name;
  size_t offset, size;
};
struct Layout {
  std::string name;
  size_t size;
  std::vector<Field> fields;
};

std::vector<Layout> hostLayouts() {
  std::vector<Layout> layouts;
#define ADD_STRUCT(Struct, bytes) layouts.push_back({#Struct, sizeof(Struct), {}});
#define ADD_FIELD(Struct, field) \
  layouts.back().fields.push_back({#field, offsetof(Struct, field), sizeof(Struct::field)});
  SHARED_STRUCTS(ADD_STRUCT, ADD_FIELD)
  return layouts;
}

using StructLayoutTest = DeviceTest;

TEST_F(StructLayoutTest, DeviceAgreesSmall) {
  const auto layouts = hostLayouts();
  size_t expected = 0;
  for (const Layout& l : layouts) expected += 1 + 2 * l.fields.size();

  Kernel report(device(), "primitives/struct_layout.cl", "reportLayout");
  DeviceArray<uint> written("written"), values("layout");
  written.copyFromHost(queue(), {0});
  values.copyFromHost(queue(), std::vector<uint>(expected, 0xdeadbeef));
  report.launch(queue(), {1, 1}, static_cast<uint>(expected), written, values);
  ASSERT_EQ(written.toVector(queue()).at(0), expected);

  const auto device = values.toVector(queue());
  size_t n = 0;
  for (const Layout& l : layouts) {
    EXPECT_EQ(device[n++], l.size) << "size of " << l.name;
    for (const Field& f : l.fields) {
      EXPECT_EQ(device[n++], f.offset) << "offset of " << l.name << "::" << f.name;
      EXPECT_EQ(device[n++], f.size) << "size of " << l.name << "::" << f.name;
    }
  }
}

// Padding is named, so the listed fields follow each other without a gap from begin to end. This also finds a
// field that is missing from the list.
TEST(StructFields, CoverEveryStruct) {
  for (const Layout& l : hostLayouts()) {
    size_t end = 0;
    for (const Field& f : l.fields) {
      EXPECT_EQ(f.offset, end) << l.name << "::" << f.name;
      end = f.offset + f.size;
    }
    EXPECT_EQ(end, l.size) << l.name;
  }
}

TEST(StructFields, ListEveryStruct) {
  std::set<std::string> listed, declared;
  for (const Layout& l : hostLayouts()) listed.insert(l.name);
  EXPECT_EQ(listed.size(), hostLayouts().size()) << "a struct is listed twice";
  const std::regex declaration("^STRUCT\\((\\w+)\\)", std::regex::multiline);
  for (const auto& [path, text] : embeddedKernels()) {
    if (path.rfind("kernels/shared/", 0) != 0) continue;
    const std::string source = text;
    for (std::sregex_iterator it(source.begin(), source.end(), declaration), end; it != end; ++it) {
      declared.insert((*it)[1]);
    }
  }
  EXPECT_EQ(listed, declared);
}

}  // namespace
}  // namespace btgpu
