#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Installs the Debian packages that are missing (as root, or with sudo). Extra packages may be named as arguments.
# A second call does nothing.
set -euo pipefail
cd "$(dirname "$0")/.."

mapfile -t wanted < <(grep -v '^#' scripts/packages.txt; printf '%s\n' "$@")
missing=()
for package in "${wanted[@]}"; do
  [ -n "$package" ] || continue
  status=$(dpkg-query -W -f='${Status}' "$package" 2>/dev/null || true)
  [ "$status" = "install ok installed" ] || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

echo "installing ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "setup: run this as root, or install sudo, to get: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
log=$(mktemp)
install() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}" >"$log" 2>&1
}
# The package lists may be missing or old.
install || { "${as_root[@]}" apt-get update >>"$log" 2>&1 && install; } || {
  tail -n 20 "$log" >&2
  echo "setup: apt-get could not install: ${missing[*]}" >&2
  exit 1
}
rm -f "$log"
