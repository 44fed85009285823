#!/usr/bin/env bash
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
# Packs what was built, and the Debian libraries that it needs, for a machine with a GPU but without packages:
#   scripts/pack.sh BUILD_DIR OUT_DIR [BINARY...]     binaries of BUILD_DIR/bin or BUILD_DIR/tests; left out: btgpu
# There: OUT_DIR/with COMMAND... runs a command with these libraries on the GPU alone.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '4,6s/^# //p' "$0" >&2; exit 2; }
build=$(realpath "$1") out=$2
shift 2
packages=(libbullet3.24 libbullet-extras3.24 libtbb12 libpng16-16 libxxhash0 zlib1g)

rm -rf "$out"
mkdir -p "$out/bin" "$out/lib"
cp "$build"/lib/*.so* "$out/lib"
for name in "${@:-btgpu}"; do
  cp "$(find "$build" -type f -name "$name" -perm -u+x | head -1)" "$out/bin"
done
debs=$(mktemp -d)
trap 'rm -rf "$debs"' EXIT
for package in "${packages[@]}"; do
  (cd "$debs" && apt-get -qq download "$package" 2>/dev/null) || echo "pack: no package $package" >&2
done
for deb in "$debs"/*.deb; do dpkg -x "$deb" "$debs/root"; done
find "$debs/root" -name '*.so*' ! -type d -exec cp -a {} "$out/lib" \;
strip --strip-debug "$out"/bin/* "$out"/lib/*.so* 2>/dev/null || true

cat >"$out/with" <<'END'
#!/usr/bin/env bash
here=$(cd "$(dirname "$0")" && pwd)
export LD_LIBRARY_PATH=$here/lib:${LD_LIBRARY_PATH-} BTGPU_ENGINE=$here/lib/libbtgpu_engine.so PATH=$here/bin:$PATH
export OCL_ICD_FILENAMES=libnvidia-opencl.so.1 OCL_ICD_VENDORS=/nonexistent
exec "$@"
END
chmod +x "$out/with"
du -sh "$out"
