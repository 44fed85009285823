#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Installs what is missing, builds the command line tool, and runs btgpu side by side with stock Bullet on two scenes:
# the shipped .bullet file and the paper's stack of boxes. Leaves the results in report/: figures, and a page with plots
# and pictures of each. A second call does only what is left.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh
[ -f build/ci/build.ninja ] || {
  mkdir -p build/ci
  cmake --preset ci >build/ci/demo.log 2>&1 || { tail -n 20 build/ci/demo.log >&2; exit 1; }
}
echo "building"
if [ -t 1 ]; then
  cmake --build build/ci --target btgpu_tool btgpu_engine
else
  cmake --build build/ci --target btgpu_tool btgpu_engine >build/ci/demo.log || { tail -n 20 build/ci/demo.log >&2; exit 1; }
fi

mkdir -p report
build/ci/bin/btgpu info | tee report/device.txt
status=0
compare() {  # NAME ARGUMENTS...
  local name=$1
  shift
  echo
  build/ci/bin/btgpu compare "$@" --json "report/$name.json" --report "report/$name.html" |
    tee "report/$name.txt" || status=1
}
compare mixed-file samples/scenes/mixed.bullet --steps 300
compare stack stack --size 10,10,10 --steps 200
echo
if [ $status -eq 0 ]; then
  echo "btgpu agrees with stock Bullet. The figures are in report/, and to look at:"
else
  echo "btgpu does NOT agree with stock Bullet; see report/:" >&2
fi
printf '  %s\n' "$PWD"/report/*.html
exit $status
