# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Writes a C++ file that holds the text of every kernel source. Run with
#   cmake -DROOT=<repository> -DFILES=<list, ;-separated, relative to ROOT> -DOUTPUT=<file> -P embed_kernels.cmake
set(text "// Generated from kernels/ by cmake/embed_kernels.cmake.\n#include \"gpu_engine/opencl/kernel_sources.h\"\n\n")
string(APPEND text "namespace btgpu {\n\nconst std::map<std::string, const char*>& embeddedKernels() {\n")
string(APPEND text "  static const std::map<std::string, const char*> files = {\n")
foreach(file IN LISTS FILES)
  file(READ "${ROOT}/${file}" content)
  string(APPEND text "{\"${file}\", R\"BTGPU(${content})BTGPU\"},\n")
endforeach()
string(APPEND text "  };\n  return files;\n}\n\n}  // namespace btgpu\n")
file(WRITE "${OUTPUT}" "${text}")
