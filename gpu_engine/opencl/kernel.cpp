// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "kernel.h"

#include <fmt/format.h>

#include <string_view>

#include "error.h"
#include "program_cache.h"

namespace btgpu {
namespace {

// "struct Pair *", "Pair*" and "const Pair*" all become "Pair*".
std::string normalised(std::string text) {
  for (const char* word : {"const ", "volatile ", "restrict ", "struct "}) {
    for (size_t at; (at = text.find(word)) != std::string::npos;) text.erase(at, std::char_traits<char>::length(word));
  }
  std::string packed;
  for (const char c : text) {
    if (c != ' ' && c != '\0') packed += c;
  }
  return packed;
}

// Drivers may leave the information out, all the more for programs loaded from a binary.
std::vector<std::string> argumentTypes(const cl::Kernel& kernel, unsigned count) {
  std::vector<std::string> types;
  try {
    for (unsigned i = 0; i < count; ++i) types.push_back(normalised(kernel.getArgInfo<CL_KERNEL_ARG_TYPE_NAME>(i)));
  } catch (const cl::Error&) { types.clear(); }
  return types;
}

std::vector<std::string> argumentNames(const cl::Kernel& kernel, unsigned first, unsigned count) {
  std::vector<std::string> names;
  try {
    for (unsigned i = first; i < count; ++i) {
      names.push_back(kernel.getArgInfo<CL_KERNEL_ARG_NAME>(i).c_str());  // up to the zero that some drivers count
    }
  } catch (const cl::Error&) { names.clear(); }
  return names;
}

}  // namespace

Kernel::Kernel(ComputeDevice& device, const std::string& file, const std::string& name, const std::string& options)
    : m_file(file), m_name(name), m_options(options) {
  const cl::Program program = device.programs().get(file, options);
  try {
    m_kernel = cl::Kernel(program, name.c_str());
    m_argumentCount = m_kernel.getInfo<CL_KERNEL_NUM_ARGS>();
  } catch (const cl::Error& e) {
    throw makeOpenClError(e.err(), e.what(), fmt::format("kernel {} of kernels/{}", name, file));
  }
  m_argumentTypes = argumentTypes(m_kernel, m_argumentCount);
  if (device.debugKernels()) {
    m_debug = true;
    m_first = !m_argumentTypes.empty() && m_argumentTypes.front() == "DebugRecord*" ? 1 : 0;
    m_parameters = argumentNames(m_kernel, m_first, m_argumentCount);
  }
  m_bound.resize(m_argumentCount);
}

void Kernel::checkCount(size_t given) {
  if (m_debug && m_argumentTypes.empty()) m_first = m_argumentCount == given + 1 ? 1 : 0;
  if (given == m_argumentCount - m_first) return;
  throw OpenClError(OpenClError::Kind::General, fmt::format("kernel {} takes {} arguments, {} were bound", m_name,
                                                            m_argumentCount - m_first, given));
}

void Kernel::checkType(const char* typeName, bool pointer) const {
  if (m_argumentTypes.empty()) return;
  const std::string_view wanted = m_argumentTypes[m_next], given = typeName;
  const std::string_view mark = pointer ? "*" : "";
  if (wanted.size() == given.size() + mark.size() && wanted.substr(0, given.size()) == given &&
      wanted.substr(given.size()) == mark) {
    return;
  }
  throw OpenClError(OpenClError::Kind::General, fmt::format("argument {} of kernel {} is a {}, a {}{} was bound",
                                                            m_next, m_name, wanted, given, mark));
}

void Kernel::launchRecorded(Queue& queue, const Launch& launch) {
  queue.recorder()->beforeLaunch(queue, launch);
  if (m_first) {
    m_next = 0;
    set(sizeof(cl_mem), queue.recorder()->checks(), newGeneration());
  }
  queue.launch(m_kernel, m_name, launch.grid);
  queue.recorder()->afterLaunch(queue);
}

void Kernel::relaunch(Queue& queue, const Launch& launch) {
  checkCount(launch.arguments.size());
  m_next = m_first;
  for (const Argument& argument : launch.arguments) bind(argument);
  queue.launch(m_kernel, m_name, launch.grid);
}

void Kernel::bind(const Argument& argument) {
  const bool pointer = argument.kind == Argument::Kind::Array || argument.kind == Argument::Kind::Null;
  checkType(argument.type.c_str(), pointer);
  if (pointer) {
    const bool null = argument.kind == Argument::Kind::Null;
    set(sizeof(cl_mem), null ? nullptr : static_cast<const void*>(&argument.buffer()), newGeneration());
  } else {
    set(sizeof argument.bits, &argument.bits, newGeneration());
  }
}

void Kernel::set(size_t size, const void* value, unsigned long identity) {
  m_bound[m_next].known = false;
  try {
    m_kernel.setArg(m_next, size, value);
  } catch (const cl::Error& e) {
    throw makeOpenClError(e.err(), e.what(), fmt::format("argument {} of kernel {}", m_next, m_name));
  }
  m_bound[m_next++] = {true, identity};
}

}  // namespace btgpu
