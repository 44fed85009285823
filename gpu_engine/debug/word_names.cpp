// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "word_names.h"

#include <fmt/format.h>

#include <cstddef>
#include <map>
#include <type_traits>
#include <vector>

#include "../../kernels/shared/struct_fields.h"

namespace btgpu {
namespace {

struct Field {
  const char* name;
  size_t offset, bytes;
  size_t partBytes;  // of an array's element or a vector's component
  bool isFloat;
  const char* nested;  // the struct that it is made of, or null
};
struct Layout {
  size_t bytes;
  std::vector<Field> fields;
};

template <typename T>
using Base = std::remove_all_extents_t<T>;
template <typename T>
constexpr bool kVector = std::is_same_v<Base<T>, float4>;
template <typename T>
constexpr bool kNested = std::is_same_v<Base<T>, ContactPoint>;  // the only struct in a struct

template <typename T>
Field makeField(const char* name, size_t offset) {
  return {name,
          offset,
          sizeof(T),
          kVector<T> ? sizeof(float) : sizeof(Base<T>),
          kVector<T> || std::is_same_v<Base<T>, float>,
          kNested<T> ? "ContactPoint" : nullptr};
}

const std::map<std::string, Layout>& layouts() {
  static const std::map<std::string, Layout> all = [] {
    std::map<std::string, Layout> made;
    Layout* last = nullptr;
#define ADD_STRUCT(Struct, size) \
  last = &made[#Struct];         \
  last->bytes = size;
#define ADD_FIELD(Struct, field) \
  last->fields.push_back(makeField<decltype(Struct::field)>(#field, offsetof(Struct, field)));
    SHARED_STRUCTS(ADD_STRUCT, ADD_FIELD)
#undef ADD_STRUCT
#undef ADD_FIELD
    return made;
  }();
  return all;
}

WordName wordOfField(const Field& field, size_t offset) {
  const size_t part = offset / field.partBytes;
  WordName word{field.name, field.isFloat};
  if (field.bytes > field.partBytes) word.field += fmt::format("[{}]", part);
  if (!field.nested) return word;
  const WordName inner = nameOfWord(field.nested, field.partBytes, offset % field.partBytes);
  return {word.field + "." + inner.field, inner.isFloat};
}

}  // namespace

WordName nameOfWord(const std::string& type, size_t elementBytes, size_t offset) {
  if (type == "float") return {"", true};
  if (type == "float4") return {fmt::format("[{}]", offset / sizeof(float)), true};
  const auto it = layouts().find(type);
  if (it == layouts().end() || it->second.bytes != elementBytes) return {};
  for (const Field& field : it->second.fields) {
    if (offset >= field.offset && offset < field.offset + field.bytes) return wordOfField(field, offset - field.offset);
  }
  return {};
}

}  // namespace btgpu
