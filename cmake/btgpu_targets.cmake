# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Compiler flags that every target of the project gets.
add_library(btgpu_flags INTERFACE)
target_compile_options(btgpu_flags INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor
                                             -ffp-contract=off)
target_include_directories(btgpu_flags INTERFACE ${PROJECT_SOURCE_DIR})
if(BTGPU_WERROR)
  target_compile_options(btgpu_flags INTERFACE -Werror)
endif()
if(BTGPU_SANITIZE)
  # -O1 -g1 compile in half the time of -O2 -g, and stacks keep their lines.
  target_compile_options(btgpu_flags INTERFACE -fsanitize=${BTGPU_SANITIZE} -fno-omit-frame-pointer -O1 -g1)
  target_link_options(btgpu_flags INTERFACE -fsanitize=${BTGPU_SANITIZE})
  if(BTGPU_SANITIZE MATCHES thread)
    target_compile_definitions(btgpu_flags INTERFACE BTGPU_STD_THREADS)  # Debian's oneTBB is not instrumented
  endif()
endif()
