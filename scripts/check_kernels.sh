#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Clang's static checks of every kernel, in both shapes, in the normal and in the debug build. Exits with 77 (skipped)
# where there is no clang: scripts/setup.sh clang installs it.
set -euo pipefail
cd "${1:-$(dirname "$0")/..}"

clang=${CLANG:-clang}
command -v "$clang" >/dev/null || { echo "check_kernels: skipped, no $clang"; exit 77; }

# For a device of 32 bits, so that work item ids are no longer than the indices made of them. Not every kernel uses all
# that the host binds to its siblings.
flags=(--target=spir-unknown-unknown -x cl -cl-std=CL1.2 -Xclang -finclude-default-header -fsyntax-only -Werror
       -Wall -Wextra -Wno-unused-parameter -Wshadow -Wundef -Wconversion -Wno-sign-conversion -Wdouble-promotion
       -Wcast-qual -Wcomma -Wstrict-prototypes)

# The options that the engine builds a file with, one line a program.
variants() {  # FILE
  case "$1" in
    */42_collide_primitives.cl) grep -o 'BTGPU_BUCKET == BUCKET_[A-Z_]*' "$1" | sed 's/\(.*\) == /-D\1=/' | sort -u ;;
    */radix_sort.cl) printf '%s\n' -DBTGPU_KEY32 -DBTGPU_KEY64 ;;
    *) echo -DBTGPU_PRINTF ;;
  esac
}

failed=0
for file in kernels/stages/*.cl kernels/queries/*.cl kernels/primitives/*.cl; do
  for variant in $(variants "$file"); do
    for shape in CPU GPU; do
      for debug in -UBTGPU_DEBUG -DBTGPU_DEBUG; do
        "$clang" "${flags[@]}" -DBTGPU_SHAPE_$shape $debug "$variant" "$file" ||
          { failed=1; echo "check_kernels: $file, shape $shape, $debug $variant" >&2; }
      done
    done
  done
done
exit $failed
