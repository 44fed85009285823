#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Runs a program under Oclgrind, which interprets its kernels and finds data races and bad memory accesses. Fails if
# the program fails or Oclgrind finds anything, or if it ran no kernel at all (a test that can't fail).
set -u
command -v oclgrind >/dev/null || { echo "oclgrind is not installed: apt-get install oclgrind" >&2; exit 1; }
log=$(mktemp) && output=$(mktemp) || exit 1
trap 'rm -f "$log" "$output"' EXIT
# Kernels are not optimised, since Oclgrind's old LLVM lacks some of its own optimiser's intrinsics, and never come
# from a cache; small scenes are spread over several work items. Loads of words that others change meanwhile are atomic.
# Oclgrind's own --inst-counts would tell what ran, but writes past its counts and can crash.
BTGPU_BUILD_OPTIONS="-cl-opt-disable -DBTGPU_ATOMIC_LOADS" BTGPU_CACHE_DIR=$(mktemp -d) BTGPU_GRAIN=8 \
  BTGPU_COUNT_LAUNCHES=1 oclgrind --data-races --num-threads 1 --log "$log" "$@" >"$output" 2>&1
status=$?
tail -n 40 "$output"
if [ $status -ne 0 ]; then exit $status; fi
if ! grep -q '^launches of kernels: [1-9]' "$output"; then
  echo "under_oclgrind: no kernel was run" >&2
  exit 1
fi
if [ -s "$log" ]; then
  echo "under_oclgrind: Oclgrind found errors:" >&2
  head -n 40 "$log" >&2
  exit 1
fi
