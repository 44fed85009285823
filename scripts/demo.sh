#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Installs what is missing, builds the command line tool, and runs btgpu side by side with stock Bullet on two scenes:
# the shipped .bullet file and the paper's stack of boxes. Leaves the results in report/. A second call does only what
# is left.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh
[ -f build/ci/build.ninja ] || cmake --preset ci >build-demo.log 2>&1 || { tail -n 20 build-demo.log >&2; exit 1; }
rm -f build-demo.log
echo "building"
cmake --build build/ci --target btgpu_tool btgpu_engine | grep -v '^\[' || true
[ -x build/ci/bin/btgpu ] || { echo "demo: the build failed" >&2; exit 1; }

mkdir -p report
build/ci/bin/btgpu info | tee report/device.txt
status=0
compare() {  # NAME ARGUMENTS...
  local name=$1
  shift
  echo
  build/ci/bin/btgpu compare "$@" --json "report/$name.json" | tee "report/$name.txt" || status=1
}
compare mixed-file samples/scenes/mixed.bullet --steps 300
compare stack stack --size 10,10,10 --steps 200
echo
if [ $status -eq 0 ]; then
  echo "btgpu agrees with stock Bullet. The figures are in report/."
else
  echo "btgpu does NOT agree with stock Bullet; see report/." >&2
fi
exit $status
