#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Measures a machine and makes the tables and plots of docs/performance.md of it.
#   benchmarks/run_all.sh [--full] [--most BODIES] [--name NAME] [BUILD_DIR]          (default build/ci)
# Without --full: what two cores do in under five minutes. --full: all scenes at 100 to 1,000,000 bodies and those of
# other engines at their own sizes; --most leaves the larger runs out (default 1000000, or 100000 where no GPU is).
# Results go to benchmarks/results/<date>-NAME (default: the device's name), nothing of an earlier run is overwritten:
#   tables.md, *.svg   for docs/performance.md
#   *.json, *.csv      the figures; *.txt what the programs printed; log.txt the commands with their exit status
# The device is chosen as ever (BTGPU_DEVICE, BTGPU_KERNEL_SHAPE). The machine should do nothing else meanwhile.
# Exit status: 0 if all ran, 1 if a command failed; the others' results are there all the same.
set -uo pipefail
cd "$(dirname "$0")/.."

full=no most="" name="" build=build/ci
while [ $# -gt 0 ]; do
  case $1 in
    --full) full=yes ;;
    --most) most=${2:?--most needs a number}; shift ;;
    --name) name=${2:?--name needs a name}; shift ;;
    -*) echo "run_all: no option $1; see the head of this file" >&2; exit 2 ;;
    *) build=$1 ;;
  esac
  shift
done
tool=$build/bin/btgpu
[ -x "$tool" ] || { echo "run_all: no $tool: build first, or name the build folder" >&2; exit 2; }
info=$("$tool" info) || { echo "run_all: $info" >&2; exit 1; }
[ -n "$name" ] || name=$(sed -n '/^[0-9]/{s/^[0-9]*[: ]*//p;q}' <<<"$info" | tr -cs 'A-Za-z0-9\n' - | cut -c1-40 | sed 's/-*$//')
[ -n "$name" ] || name=device
if [ -z "$most" ]; then most=100000; grep -qi 'gpu' <<<"$info" && most=1000000; fi

folder=benchmarks/results/$(date +%F)-$name
for ((i = 2; ; i++)); do mkdir -p benchmarks/results; mkdir "$folder" 2>/dev/null && break
  folder=benchmarks/results/$(date +%F)-$name-$i; done
{
  date -u '+%F %T UTC'
  echo "btgpu $("$tool" --version), commit $(git describe --always --dirty 2>/dev/null || echo unknown)"
  echo "$(lscpu | sed -n 's/^Model name: *//p'), $(nproc) cores, load $(cut -d' ' -f1-3 /proc/loadavg)"
  echo "$info"
} >"$folder/machine.txt"

failed=0
# log NAME COMMAND...: what it prints goes to NAME.txt
log() {
  local what=$1 start=$SECONDS status; shift
  echo "$*"
  "$@" >"$folder/$what.txt" 2>&1; status=$?
  echo "$what: exit $status, $((SECONDS - start)) s: $*" >>"$folder/log.txt"
  [ $status -eq 0 ] || { failed=1; echo "  exit $status: $folder/$what.txt" >&2; }
}
# steps NAME OPTION...: btgpu bench
steps() { local what=$1; shift; log "$what" "$tool" bench "$@" --json "$folder/$what.json" --csv "$folder/$what.csv"; }
# micro NAME PROGRAM OPTION...: a program of Google Benchmark's
micro() {
  local what=$1 program=$build/bin/$2; shift 2
  [ -x "$program" ] || { echo "$what: left out, no $program (libbenchmark-dev)" >>"$folder/log.txt"; return; }
  log "$what" "$program" "$@" --benchmark_out="$folder/$what.json" --benchmark_out_format=json
}
# upTo N...: those that --most allows, with commas
upTo() { local list="" n; for n in "$@"; do [ "$n" -le "$most" ] && list+=,$n; done; echo "${list#,}"; }

if [ $full = no ]; then
  steps 1-sizes --scene stack,mixed,convex_pile --bodies 100,1000,4000 --steps 60 --worlds gpu,cpu
  steps 2-scenes --scene all --bodies 1000 --steps 60 --worlds gpu,cpu --stages off
  steps 3-peers --scene large_pyramid,many_pyramids --worlds gpu,cpu
  steps 4-bullet3 --scene stack --size 12,12,12 --steps 80 --worlds gpu,cpu,bullet3
  steps 5-bare --scene stack --bodies 4000 --steps 60 --worlds gpu,cpu --contacts off --host-queries off
  micro 6-primitives btgpu_primitives --benchmark_min_time=0.05
  micro 7-stages btgpu_stages --bodies=1000,4000
else
  # Stock takes seconds a step beyond some size; all else is measured against it up to there.
  steps 1-sizes --scene all --bodies "$(upTo 100 1000 10000 100000 1000000)" --steps 60 --worlds gpu,cpu:30000
  steps 2-bare --scene stack,mixed,city --bodies "$(upTo 1000 10000 100000 1000000)" --steps 60 --worlds gpu,cpu:30000 \
    --contacts off --host-queries off
  steps 3-peers --scene large_pyramid,many_pyramids,convex_pile,rocks,junkyard,washer --worlds gpu,cpu
  # A process of its own: on errors of OpenCL Bullet3's pipeline ends it.
  steps 4-bullet3 --scene stack --bodies "$(upTo 1000 4000 13824 32768)" --worlds gpu,cpu:5000,bullet3
  for scene in ring columns pour; do
    [ "$most" -ge 100000 ] && steps "5-$scene" --scene $scene --worlds gpu --contacts off --host-queries off
  done
  [ "$most" -ge 1000000 ] && steps 6-city --scene city --worlds gpu --contacts off --host-queries off
  micro 7-primitives btgpu_primitives
  micro 8-stages btgpu_stages --bodies="$(upTo 1000 10000 100000)"
fi

"$build/bin/btgpu_bench_tables" "$folder" || failed=1
echo "$folder/tables.md"
exit $failed
