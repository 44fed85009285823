#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Runs every built-in scene ten times (those of other engines at the size of btgpu compare), each run a process of its own,
# and compares all bits of all poses and velocities after each step (as one hash). Prints a line a scene; fails if two runs differ or a step left the device.
#   tests/determinism/ten_runs.sh [RUNS [STEPS]]     STEPS: instead of the scene's own number
# BTGPU_JOBS runs at a time, 2 if it is not set. The device is BTGPU_DEVICE's; programs are found in BTGPU_BUILD, or build/ci.
set -euo pipefail
build=${BTGPU_BUILD:-$(cd "$(dirname "$0")/../.." && pwd)/build/ci}
runs=${1:-10} failed=0
export BTGPU_ENGINE=${BTGPU_ENGINE:-$build/lib/libbtgpu_engine.so} BTGPU_SMALL_WORLD=0
scene_line='^([a-z_]+) .*(size|for compare) ([0-9]+),([0-9]+),([0-9]+)[;,] ([0-9]+) steps\)$'
while IFS= read -r line; do
  [[ $line == *\(size* ]] || continue  # a heading
  [[ $line =~ $scene_line ]] || { echo "not understood: $line" >&2; exit 1; }
  scene=${BASH_REMATCH[1]} size=("${BASH_REMATCH[@]:3:3}") steps=${2:-${BASH_REMATCH[6]}}
  # hash, steps on the device, steps on the stock path
  results=$(seq "$runs" | xargs -P "${BTGPU_JOBS:-2}" -I{} \
    "$build/tests/determinism_hash_run" "$scene" "${size[@]}" "$steps" 2>/dev/null | cut -d ' ' -f 1-3 | sort | uniq -c)
  verdict=identical
  [[ $(wc -l <<<"$results") = 1 && $results =~ ^\ *$runs\ [0-9a-f]+\ $steps\ 0$ ]] || verdict=DIFFERENT failed=1
  printf '%-14s %4d steps, %d runs: %s %s\n' "$scene" "$steps" "$runs" "$verdict" "$(awk '{print $2}' <<<"$results" | paste -sd ' ')"
done < <("$build/bin/btgpu" scenes)
exit $failed
