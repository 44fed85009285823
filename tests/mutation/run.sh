#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Plants each fault of tests/mutation/faults in a copy of the sources and sees which check finds it:
#   - the cross-check with stock, turned on from outside in an application that knows nothing of it (yard.cpp);
#   - the check of the stages against their references, which must name the stage that the fault is in;
#   - the stage's own test, where the fault's file names one.
# A fault's file may name a setting `with` which it is looked for, VARIABLE=VALUE.
# Every fault must be found, 12 of them by the cross-check alone; without a fault nothing must be.
#   tests/mutation/run.sh [FAULT...]     e.g. 07_damping_twice
# Faults in kernels need no build (BTGPU_KERNEL_DIR); those in host code are built in build/mutation.
set -euo pipefail
cd "$(dirname "$0")/../.."
root=$PWD build=${BTGPU_BUILD:-$PWD/build/ci} steps=${BTGPU_MUTATION_STEPS:-90}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# The kernels of a GPU: one body each, where those of a CPU have a second one for whole blocks.
export BTGPU_KERNEL_SHAPE=gpu BTGPU_DEVICE=cpu
export BTGPU_CACHE_DIR=${BTGPU_CACHE_DIR:-$build/test-cache/btgpu} POCL_CACHE_DIR=${POCL_CACHE_DIR:-$build/test-cache/pocl}

field() { sed -n "s/^$2: *//p" "tests/mutation/faults/$1.patch"; }

# Runs the application of a build, with the kernels in $work/kernels if there are some. Sets crosscheck and stage.
check() {  # BUILD [VARIABLE=VALUE]
  local lines="$work/lines" log="$work/log" environment=(BTGPU_ENGINE="$1/lib/libbtgpu_engine.so" ${2:-})
  rm -f "$lines"
  [ ! -d "$work/kernels" ] || environment+=(BTGPU_KERNEL_DIR="$work")
  env "${environment[@]}" BTGPU_CROSSCHECK=1 BTGPU_CROSSCHECK_FILE="$lines" "$1/tests/mutation_yard" "$steps" \
    >"$work/out" 2>"$log"
  grep -qx "deviceSteps $steps" "$work/out" || { cat "$work/out" "$log" >&2; return 1; }
  crosscheck=$(sed -n 's/.*"step":\([0-9]*\),"failed":true.*/step \1/p' "$lines" | head -n 1)
  [ -n "$crosscheck" ] || ! grep -q '"agreed":false' "$lines" || crosscheck="whole run"
  env "${environment[@]}" BTGPU_CHECK_STAGES=1 "$1/tests/mutation_yard" "$steps" >"$work/out" 2>"$log"
  found=$(sed -n 's/^btgpu: \(step [0-9]*, .*\)/\1/p' "$log" | head -n 1)
  stage=$(sed -n 's/^step [0-9]*, \([0-9a-z_]*\):.*/\1/p' <<<"$found")
}

# A build of the sources with the fault in host code.
host_build() {  # FAULT [TEST]
  local tree="$root/build/mutation/tree"
  mkdir -p "$tree"
  git ls-files --cached --others --exclude-standard -z | xargs -0 cp --parents -t "$tree" --update
  patch -d "$tree" -p1 -s <"tests/mutation/faults/$1.patch"
  local result=0
  { [ -f "$tree/../build.ninja" ] || cmake -S "$tree" -B "$tree/.." --preset ci; } >"$work/build.log" 2>&1 &&
    cmake --build "$tree/.." --target mutation_yard btgpu_engine ${2:+"test_${2/\//_}"} >>"$work/build.log" 2>&1 ||
    result=1
  # The next fault starts from the unchanged files.
  patch -d "$tree" -p1 -s -R <"tests/mutation/faults/$1.patch"
  [ $result = 0 ] || tail -n 20 "$work/build.log" >&2
  return $result
}

failed=0 by_crosscheck=0
row() { printf '%-26s %-14s %-30s %s\n' "$@"; }

try() {  # FAULT
  local fault=$1 wanted test verdict="" in=$build
  wanted=$(field "$fault" stage) test=$(field "$fault" test)
  rm -rf "$work/kernels"
  if [ -n "$wanted" ]; then
    cp -r kernels "$work/kernels"
    patch -d "$work" -p1 -s <"tests/mutation/faults/$fault.patch"
  else
    host_build "$fault" "$test" || { failed=1; row "$fault" "" "" "does not build"; return; }
    in="$root/build/mutation"
  fi
  check "$in" "$(field "$fault" with)" || { failed=1; row "$fault" "" "" "did not run"; return; }
  [ -z "$crosscheck" ] || by_crosscheck=$((by_crosscheck + 1))
  if [ -n "$test" ] && ! env ${wanted:+BTGPU_KERNEL_DIR="$work"} BTGPU_ENGINE="$in/lib/libbtgpu_engine.so" \
    "$in/tests/test_${test/\//_}" >"$work/test.log" 2>&1; then
    verdict="found by the test $test"
  fi
  if [ -z "$crosscheck$stage$verdict" ]; then failed=1 verdict="NOT FOUND"; fi
  if [ -n "$wanted" ] && [ "$stage" != "$wanted" ] && [ -z "$test" ]; then failed=1 verdict="WRONG STAGE, not $wanted"; fi
  row "$fault" "${crosscheck:--}" "${stage:--}" "$verdict"
  [ -z "$found" ] || echo "    $found"
}

faults=("$@")
if [ $# = 0 ]; then
  for file in tests/mutation/faults/*.patch; do faults+=("$(basename "$file" .patch)"); done
fi
row fault cross-check "stage check"
# Without a fault, with each setting that one is looked for with.
mapfile -t settings < <(for fault in "${faults[@]}"; do field "$fault" with; done | sort -u)
for setting in "" "${settings[@]}"; do
  check "$build" "$setting"
  if [ -n "$crosscheck$found" ]; then
    row "(none) $setting" "${crosscheck:--}" "${stage:--}" "FOUND WHERE THERE IS NONE"
    echo "    $found"
    failed=1
  else
    row "(none) $setting" - - ""
  fi
done
for fault in "${faults[@]}"; do try "$fault"; done
echo "$by_crosscheck of ${#faults[@]} found by the cross-check"
if [ $# = 0 ] && [ "$by_crosscheck" -lt 12 ]; then failed=1; fi
exit $failed
