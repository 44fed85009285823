#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Measures a build on the machine at hand; what it prints is kept in benchmarks/results.
#   benchmarks/measure.sh [--tests] [--large] [BUILD_DIR]     (default build/ci)
# --tests runs the device's tests first: for machines that CI does not have. --large adds sizes that only a GPU steps in
# reasonable time. The device is chosen as ever
# (BTGPU_DEVICE, BTGPU_KERNEL_SHAPE).
set -uo pipefail
cd "$(dirname "$0")/.."

tests=no large=no
if [ "${1:-}" = --tests ]; then tests=yes; shift; fi
if [ "${1:-}" = --large ]; then large=yes; shift; fi
build=${1:-build/ci}
tool=$build/bin/btgpu
[ -x "$tool" ] || { echo "measure: no $tool: build first, or name the build folder" >&2; exit 2; }

echo "$(date +%F), $(lscpu | sed -n 's/^Model name: *//p'), $(nproc) cores"
"$tool" info

if [ $tests = yes ]; then
  echo "== tests"
  for test in "$build"/tests/test_{primitives,opencl,regression,stages,capacity,determinism,physics,compat}_*; do
    case $test in *startup*|*float64) continue ;; esac
    log=$("$test" --gtest_brief=1 2>&1) && result=passed || result=FAILED
    printf '%-45s %s, %s\n' "$(basename "$test")" $result "$(grep -oE '[0-9]+ tests? from' <<<"$log" | tail -1 | cut -d' ' -f1) tests"
    [ $result = passed ] || grep -A6 Failure <<<"$log" | cut -c1-300 | head -20
  done
fi

echo "== start-up: to the end of a world's first step, caches empty and full"
caches=$(mktemp -d)
trap 'rm -rf "$caches"' EXIT
for state in cold warm; do
  echo "$state $(BTGPU_CACHE_DIR=$caches/btgpu POCL_CACHE_DIR=$caches/pocl CUDA_CACHE_PATH=$caches/cuda \
    "$build/tests/startup_app" | sed -n 's/^firstStepSeconds //p') s"
done

# btgpu, stock and Bullet3's OpenCL pipeline in one run each; the machine should do nothing else meanwhile.
worlds=gpu,cpu,bullet3
for size in 8,8,8 16,16,16 24,24,24 32,32,32; do
  echo "== btgpu bench --scene stack --size $size --steps 120 --worlds $worlds"
  "$tool" bench --scene stack --size "$size" --steps 120 --worlds $worlds || echo "exit $?"
done
echo "== the same without contacts and host queries"
"$tool" bench --scene stack --size 16,16,16 --steps 120 --worlds gpu,cpu --contacts off --host-queries off || echo "exit $?"
if [ $large = yes ]; then
  for size in 32,32,32 48,48,48; do
    "$tool" bench --scene stack --size $size --steps 200 --worlds gpu,bullet3 --contacts off --host-queries off || echo "exit $?"
  done
fi

for arguments in "stack --size 8,8,8 --steps 300" "stack --size 16,16,16 --steps 300" "stack --size 32,32,32 --steps 60"; do
  echo "== btgpu compare $arguments --hash --profile"
  # shellcheck disable=SC2086
  "$tool" compare $arguments --hash --profile
  echo "exit $?"
done
