#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Installs what is missing, builds, and runs the tests.
#   scripts/test.sh               the tests that every change must pass
#   scripts/test.sh --with-slice  and one item of the long list, another one each day (what CI does)
#   scripts/test.sh --long [ITEM...]
#                                 the whole long list, or some of it; resumable: items that passed for this commit are
#                                 not run again
set -euo pipefail
cd "$(dirname "$0")/.."

mode=${1:-}
case "$mode" in
  ""|--with-slice|--long) ;;
  *) echo "test: unknown option $mode; see the head of scripts/test.sh" >&2; exit 2 ;;
esac

build() {  # PRESET [TARGET...]
  local preset=$1
  shift
  [ -f "build/$preset/build.ninja" ] || cmake --preset "$preset" || return 1
  cmake --build "build/$preset" ${1:+--target} "$@"
}

# clang for lint/kernels.
run_short() {
  scripts/setup.sh chromium clang
  build ci
  ctest --test-dir build/ci --output-on-failure --label-exclude long -j 2
}

# ---- the long list: name, then a function item_<name> -----------------------------------------------------------
slices=(long_tests long_capacity threads install clang tidy_engine tidy_facade sanitize_engine sanitize_stages
        sanitize_translation sanitize_compat)
# The long walks are no slices yet: they are to find what is still open (docs/compatibility.md, "Random walk").
long_items=("${slices[@]}" sanitize_walk walk_{0..9} short)

item_short() { run_short; }
item_long_tests() {
  build ci
  ctest --test-dir build/ci --output-on-failure --label-regex long --exclude-regex '^(capacity|walk)/'
}
item_long_capacity() {
  build ci
  ctest --test-dir build/ci --output-on-failure --label-regex long --tests-regex '^capacity/'
}
# Everything of the libraries and the tool, and the tests that are about code rather than behaviour.
item_clang() {
  local folders=(lib primitives opencl regression stages translation)
  scripts/setup.sh clang
  scripts/check_kernels.sh
  build ci-clang btgpu btgpu-float64 btgpu_engine btgpu_tool "${folders[@]/#/tests_}"
  ctest --test-dir build/ci-clang --output-on-failure --tests-regex "^($(IFS='|'; echo "${folders[*]}"))/" \
    --label-exclude 'long|oclgrind' -j 2
}
sanitize() {  # FOLDER...
  scripts/setup.sh chromium
  build asan-ubsan btgpu_engine "${@/#/tests_}"
  local folders
  folders=$(IFS='|'; echo "$*")
  # Leaks of the OpenCL driver are not ours, and its LLVM takes the signal stacks away that the sanitizer made; everything
  # else fails the test. Instrumented tests take longer.
  ASAN_OPTIONS=detect_leaks=0:use_sigaltstack=0 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 \
    ctest --test-dir build/asan-ubsan --output-on-failure --tests-regex "^($folders)/" --label-regex 'unit|stage' \
    --label-exclude 'long|oclgrind' --timeout 900 -j 2
}
item_sanitize_engine() { sanitize lib primitives opencl regression capacity; }
item_sanitize_stages() { sanitize stages debug fuzz; }
item_sanitize_translation() { sanitize translation tools; }
item_sanitize_compat() { sanitize compat; }
item_sanitize_walk() { sanitize walk; }
# A tenth of the long random walks, in both kernel shapes.
walk() {  # PIECE
  build ci btgpu_engine test_walk_random
  ctest --test-dir build/ci --output-on-failure --tests-regex "^walk/long_$1\\."
}
for piece in {0..9}; do eval "item_walk_$piece() { walk $piece; }"; done
item_threads() {
  build tsan btgpu_engine test_compat_worlds_on_threads test_compat_worlds_on_threads.float64
  # The driver and its threads are not instrumented: what is called from there does not count.
  TSAN_OPTIONS="halt_on_error=1 ignore_noninstrumented_modules=1" \
    ctest --test-dir build/tsan --output-on-failure --label-regex threads
}
tidy() {  # FOLDER...
  scripts/setup.sh clang-tidy
  build ci
  git ls-files "${@/%//*.cpp}" | xargs -P 2 -n 4 clang-tidy -p build/ci --quiet
}
item_tidy_engine() { tidy gpu_engine; }
item_tidy_facade() { tidy translation compat tools samples; }
item_install() { tests/install/run.sh; }

run_item() {  # NAME
  echo "== long: $1"
  local start=$SECONDS
  "item_$1"
  echo "== long: $1 passed in $((SECONDS - start)) s"
}

# The log keeps one line an item: the commit that it last passed at.
run_long() {  # [ITEM...]
  scripts/setup.sh
  local commit state log="benchmarks/results/test-long.log" item
  commit=$(git rev-parse --short HEAD) state="build/long-$commit"
  mkdir -p "$state" benchmarks/results
  touch "$log"
  for item in "$@"; do
    [ -e "$state/$item" ] && continue
    run_item "$item" 2>&1 | tee "$state/$item.log"
    local counted
    counted=$(grep -E '[0-9]% tests passed' "$state/$item.log" || true)
    sed -i "/^$item at /d" "$log"
    echo "$item at $commit, $(nproc) cores: $(tail -n 1 "$state/$item.log" | sed 's/^== long: [a-z_]* //')${counted:+; $counted}" >>"$log"
    touch "$state/$item"
  done
}

case "$mode" in
  --long)
    shift
    run_long "${@:-${long_items[@]}}"
    ;;
  --with-slice)
    run_short
    run_item "${slices[$(($(date +%s) / 86400 % ${#slices[@]}))]}"
    ;;
  *) run_short ;;
esac
echo "all tests passed"
