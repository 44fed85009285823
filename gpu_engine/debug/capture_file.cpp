// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "capture_file.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "capture_bytes.h"

namespace btgpu {
namespace {

constexpr unsigned char kMagic[8] = {'b', 't', 'g', 'p', 'u', 'c', 'a', 'p'};
// 2 has views and numbers behind the commands, for the stage's reference; 1 has not.
constexpr std::uint32_t kPlain = 1, kWithInputs = 2;
constexpr size_t kHeaderBytes = 32;
enum Command : std::uint8_t { kLaunch = 0, kWrite = 1, kCopy = 2 };

// ---- writing --------------------------------------------------------------------------------------------------------

void put(ByteWriter& out, const CapturedArray& array) {
  out.text(array.name);
  out.text(array.type);
  out.number<std::uint32_t>(array.elementBytes);
  out.number<std::uint64_t>(array.before.size());
  out.raw(array.before);
  out.number<std::uint8_t>(array.after.empty() ? 0 : 1);
  out.raw(array.after);
}

void put(ByteWriter& out, const CapturedArgument& argument) {
  out.number(static_cast<std::uint8_t>(argument.kind));
  if (argument.kind == CapturedArgument::Kind::Null) {
    out.text(argument.type);
  } else {
    out.number<std::uint32_t>(argument.value);
  }
}

void put(ByteWriter& out, const CapturedLaunch& launch) {
  out.number<std::uint8_t>(kLaunch);
  out.text(launch.file);
  out.text(launch.name);
  out.text(launch.options);
  out.number<std::uint64_t>(launch.global);
  out.number<std::uint64_t>(launch.local);
  out.number(static_cast<std::uint32_t>(launch.arguments.size()));
  for (const CapturedArgument& argument : launch.arguments) put(out, argument);
}

void put(ByteWriter& out, const CapturedWrite& write) {
  out.number<std::uint8_t>(kWrite);
  out.number<std::uint32_t>(write.array);
  out.number<std::uint64_t>(write.offset);
  out.number<std::uint64_t>(write.data.size());
  out.raw(write.data);
}

void put(ByteWriter& out, const CapturedCopy& copy) {
  out.number<std::uint8_t>(kCopy);
  out.number<std::uint32_t>(copy.from);
  out.number<std::uint32_t>(copy.to);
  for (const std::uint64_t n : {copy.fromOffset, copy.toOffset, copy.bytes}) out.number(n);
}

void putCommands(ByteWriter& out, const Capture& capture) {
  out.number(static_cast<std::uint32_t>(capture.commands.size()));
  for (const CapturedCommand& command : capture.commands) {
    std::visit([&](const auto& c) { put(out, c); }, command);
  }
}

bool hasInputs(const Capture& capture) { return !capture.views.empty() || !capture.numbers.empty(); }

void putInputs(ByteWriter& out, const Capture& capture) {
  out.number(static_cast<std::uint32_t>(capture.views.size()));
  for (const CapturedView& view : capture.views) {
    out.text(view.array);
    for (const std::uint32_t n : {view.before, view.after}) out.number(n);
    for (const std::uint64_t n : {view.bytesBefore, view.bytesAfter}) out.number(n);
  }
  out.number(static_cast<std::uint32_t>(capture.numbers.size()));
  for (const std::uint64_t n : capture.numbers) out.number(n);
}

// ---- reading --------------------------------------------------------------------------------------------------------

void check(bool holds, const char* what) {
  if (!holds) throw CaptureError(fmt::format("is damaged: {}", what));
}

CapturedArray takeArray(ByteReader& in) {
  CapturedArray array;
  array.name = in.text();
  array.type = in.text();
  array.elementBytes = in.number<std::uint32_t>();
  const auto bytes = in.number<std::uint64_t>();
  check(array.elementBytes > 0 && bytes > 0 && bytes % array.elementBytes == 0, "an array is no whole elements");
  array.before = in.raw(bytes);
  const auto changed = in.number<std::uint8_t>();
  check(changed <= 1, "an array is neither changed nor unchanged");
  if (changed) array.after = in.raw(bytes);
  return array;
}

std::uint32_t takeIndex(ByteReader& in, const Capture& capture) {
  const auto index = in.number<std::uint32_t>();
  check(index < capture.arrays.size(), "an array is meant that is not there");
  return index;
}

void checkRange(const Capture& capture, std::uint32_t array, std::uint64_t offset, std::uint64_t bytes) {
  const std::uint64_t size = capture.arrays[array].before.size();
  check(bytes > 0 && offset <= size && bytes <= size - offset, "a transfer lies outside its array");
}

CapturedArgument takeArgument(ByteReader& in, const Capture& capture) {
  using Kind = CapturedArgument::Kind;
  CapturedArgument argument;
  const auto kind = in.number<std::uint8_t>();
  check(kind <= static_cast<std::uint8_t>(Kind::Float), "an argument is of no kind");
  argument.kind = static_cast<Kind>(kind);
  if (argument.kind == Kind::Null) {
    argument.type = in.text();
  } else {
    argument.value = argument.kind == Kind::Array ? takeIndex(in, capture) : in.number<std::uint32_t>();
  }
  return argument;
}

CapturedLaunch takeLaunch(ByteReader& in, const Capture& capture) {
  constexpr std::uint64_t kMostItems = 1ull << 32;
  CapturedLaunch launch;
  launch.file = in.text();
  launch.name = in.text();
  launch.options = in.text();
  check(launch.file.find("..") == std::string::npos && !launch.name.empty(), "a kernel has no name");
  launch.global = in.number<std::uint64_t>();
  launch.local = in.number<std::uint64_t>();
  check(launch.local > 0 && launch.global > 0 && launch.global <= kMostItems && launch.global % launch.local == 0,
        "a grid is not whole");
  const size_t count = in.count(1);
  for (size_t i = 0; i < count; ++i) launch.arguments.push_back(takeArgument(in, capture));
  return launch;
}

CapturedWrite takeWrite(ByteReader& in, const Capture& capture) {
  CapturedWrite write;
  write.array = takeIndex(in, capture);
  write.offset = in.number<std::uint64_t>();
  const auto bytes = in.number<std::uint64_t>();
  checkRange(capture, write.array, write.offset, bytes);
  write.data = in.raw(bytes);
  return write;
}

CapturedCopy takeCopy(ByteReader& in, const Capture& capture) {
  CapturedCopy copy;
  copy.from = takeIndex(in, capture);
  copy.to = takeIndex(in, capture);
  for (auto* n : {&copy.fromOffset, &copy.toOffset, &copy.bytes}) *n = in.number<std::uint64_t>();
  check(copy.from != copy.to, "an array is copied into itself");
  checkRange(capture, copy.from, copy.fromOffset, copy.bytes);
  checkRange(capture, copy.to, copy.toOffset, copy.bytes);
  return copy;
}

CapturedCommand takeCommand(ByteReader& in, const Capture& capture) {
  switch (in.number<std::uint8_t>()) {
    case kLaunch:
      return takeLaunch(in, capture);
    case kWrite:
      return takeWrite(in, capture);
    case kCopy:
      return takeCopy(in, capture);
  }
  throw CaptureError("is damaged: a command is of no kind");
}

void checkView(const Capture& capture, std::uint32_t array, std::uint64_t bytes) {
  if (array == CapturedView::kNone) return;
  check(array < capture.arrays.size(), "an array is meant that is not there");
  check(bytes <= capture.arrays[array].before.size(), "an array uses more than it has");
}

CapturedView takeView(ByteReader& in, const Capture& capture) {
  CapturedView view;
  view.array = in.text();
  for (auto* n : {&view.before, &view.after}) *n = in.number<std::uint32_t>();
  for (auto* n : {&view.bytesBefore, &view.bytesAfter}) *n = in.number<std::uint64_t>();
  checkView(capture, view.before, view.bytesBefore);
  checkView(capture, view.after, view.bytesAfter);
  return view;
}

void takeInputs(ByteReader& in, Capture& capture) {
  for (size_t i = in.count(1); i > 0; --i) capture.views.push_back(takeView(in, capture));
  for (size_t i = in.count(sizeof(std::uint64_t)); i > 0; --i) capture.numbers.push_back(in.number<std::uint64_t>());
  check(hasInputs(capture), "there is nothing for the reference");
}

Capture takeBody(ByteReader& in, std::uint32_t version) {
  Capture capture;
  for (auto* text : {&capture.stage, &capture.version, &capture.device, &capture.driver, &capture.buildOptions}) {
    *text = in.text();
  }
  capture.step = in.number<std::uint64_t>();
  const auto shape = in.number<std::uint8_t>();
  check(shape <= 1, "the kernels are of no shape");
  capture.cpuShape = shape == 1;
  for (size_t i = in.count(1); i > 0; --i) capture.arrays.push_back(takeArray(in));
  for (size_t i = in.count(1); i > 0; --i) capture.commands.push_back(takeCommand(in, capture));
  if (version == kWithInputs) takeInputs(in, capture);
  check(in.atEnd(), "something is left at its end");
  return capture;
}

// Returns the format's version.
std::uint32_t takeHeader(ByteReader& in, const Bytes& bytes) {
  const Bytes magic = bytes.size() < sizeof kMagic ? Bytes() : in.raw(sizeof kMagic);
  if (!std::equal(magic.begin(), magic.end(), std::begin(kMagic), std::end(kMagic))) {
    throw CaptureError("is no capture of btgpu");
  }
  const auto version = in.number<std::uint32_t>();
  if (version != kPlain && version != kWithInputs) {
    throw CaptureError(
        fmt::format("is of format {}, this btgpu reads formats {} and {}", version, kPlain, kWithInputs));
  }
  check(in.number<std::uint32_t>() == 0, "the header's unused field is used");
  const auto size = in.number<std::uint64_t>();
  if (size != bytes.size()) throw CaptureError(fmt::format("is {} bytes long, not {}", bytes.size(), size));
  const auto checksum = in.number<std::uint64_t>();
  check(checksum == checksumOf(bytes.data() + kHeaderBytes, bytes.size() - kHeaderBytes), "the checksum is another");
  return version;
}

Bytes readFile(const std::string& path) {
  std::error_code error;
  const bool regular = std::filesystem::is_regular_file(path, error);
  const auto size = regular ? std::filesystem::file_size(path, error) : 0;
  std::ifstream file(path, std::ios::binary);
  if (!regular || error || !file) throw CaptureError("can't be read");
  Bytes bytes(size);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size))) {
    throw CaptureError("can't be read");
  }
  return bytes;
}

}  // namespace

Bytes encodeCommands(const Capture& capture) {
  ByteWriter out;
  putCommands(out, capture);
  return out.bytes();
}

Bytes encodeCapture(const Capture& capture) {
  ByteWriter body;
  for (const auto* text : {&capture.stage, &capture.version, &capture.device, &capture.driver, &capture.buildOptions}) {
    body.text(*text);
  }
  body.number<std::uint64_t>(capture.step);
  body.number<std::uint8_t>(capture.cpuShape ? 1 : 0);
  body.number(static_cast<std::uint32_t>(capture.arrays.size()));
  for (const CapturedArray& array : capture.arrays) put(body, array);
  putCommands(body, capture);
  if (hasInputs(capture)) putInputs(body, capture);
  ByteWriter file;
  file.raw({std::begin(kMagic), std::end(kMagic)});
  file.number<std::uint32_t>(hasInputs(capture) ? kWithInputs : kPlain);
  file.number<std::uint32_t>(0);
  file.number<std::uint64_t>(kHeaderBytes + body.bytes().size());
  file.number<std::uint64_t>(checksumOf(body.bytes().data(), body.bytes().size()));
  file.raw(body.bytes());
  return file.bytes();
}

Capture decodeCapture(const Bytes& bytes) {
  ByteReader in(bytes);
  const std::uint32_t version = takeHeader(in, bytes);
  return takeBody(in, version);
}

void writeCapture(const std::string& path, const Capture& capture) {
  const Bytes bytes = encodeCapture(capture);
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) throw CaptureError(fmt::format("{}: can't be written", path));
}

Capture readCapture(const std::string& path) {
  try {
    return decodeCapture(readFile(path));
  } catch (const CaptureError& e) { throw CaptureError(fmt::format("{} {}", path, e.what())); }
}

}  // namespace btgpu
