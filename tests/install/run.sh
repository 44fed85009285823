#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Installs btgpu into an empty folder and builds an application against it, once with find_package and once with
# pkg-config, for both Bullet ABIs. The applications must find the engine by themselves.
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

[ -f build/ci/build.ninja ] || cmake --preset ci
cmake --build build/ci
cmake --install build/ci --prefix "$work/prefix" >/dev/null
cmake -S tests/install/consumer -B "$work/consumer" -G Ninja -DCMAKE_PREFIX_PATH="$work/prefix" >/dev/null
cmake --build "$work/consumer" >/dev/null

export PKG_CONFIG_PATH=$(dirname "$(find "$work/prefix" -name btgpu.pc)")
libdir=$(dirname "$PKG_CONFIG_PATH")
for suffix in "" "-float64"; do
  g++ -std=c++17 tests/install/consumer/main.cpp -o "$work/pc$suffix" \
    $(pkg-config --cflags --libs "btgpu$suffix") -Wl,-rpath,"$libdir"
  for application in "$work/consumer/consumer$suffix" "$work/pc$suffix"; do
    # One ball is a small world, which would not step on the device.
    env -u BTGPU_ENGINE BTGPU_SMALL_WORLD=0 BTGPU_CACHE_DIR="$work/cache" "$application"
  done
done
"$work/prefix/bin/btgpu" info
echo "install: ok"
