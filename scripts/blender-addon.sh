#!/usr/bin/env bash
# Packs the add-on for Blender with a wheel of the Python module: out/lightgraph_blender.zip, which installs as an extension
# (Blender 4.2 and later) and as an add-on (3.4 to 4.1).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

build=target/blender/build
rm -rf "$build"
mkdir -p "$build/lightgraph_blender/wheels" out
# DEBUG=1 packs a build that takes less time to make and more to run.
if [ -n "${DEBUG:-}" ]; then profile=(--profile dev); else profile=(--release); fi
VIRTUAL_ENV="$PWD/target/python/venv" target/python/venv/bin/maturin build --quiet "${profile[@]}" \
    --manifest-path crates/python/Cargo.toml --out "$build/lightgraph_blender/wheels"
cp editors/blender/*.py LICENSE-APACHE LICENSE-MIT "$build/lightgraph_blender"
wheel=$(basename "$build"/lightgraph_blender/wheels/*.whl)
{ cat editors/blender/blender_manifest.toml; echo "wheels = [\"./wheels/$wheel\"]"; } \
    >"$build/lightgraph_blender/blender_manifest.toml"
# Add-ons are packed with their folder, extensions may be.
(cd "$build" && python3 -c 'import shutil; shutil.make_archive("../../../out/lightgraph_blender", "zip", ".", "lightgraph_blender")')
echo "out/lightgraph_blender.zip is there; docs/blender.md says how to install it"
