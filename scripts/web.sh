#!/usr/bin/env bash
# Builds the page for browsers into target/web: the engine as WebAssembly, the editor, the scenes.
# Ends with 3, and says why, where this machine can't have the compiler's target or Node.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

missing() {
    echo "web: $1; the page for browsers is NOT built, and nothing else needs it" >&2
    exit 3
}

target=wasm32-unknown-unknown
if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$target" ]; then
    command -v rustup >/dev/null 2>&1 || missing "the compiler has no target $target, and there is no rustup to add it with"
    rustup target add "$target" >/dev/null 2>&1 || missing "\`rustup target add $target\` fails"
fi
if ! command -v npm >/dev/null 2>&1; then
    as_root=()
    [ "$(id -u)" -eq 0 ] || as_root=(sudo)
    ${as_root[@]+"${as_root[@]}"} env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends nodejs npm \
        >/dev/null 2>&1 || missing "there is no npm, and apt-get gives none"
fi

out=target/web
page=crates/web/page
cargo build --package lightgraph-web --lib --target "$target" --profile wasm
cargo build --package lightgraph-web --bin bindgen --features bindgen
npm ci --prefix "$page" --no-audit --no-fund --loglevel=error >/dev/null || missing "npm can't install what $page/package-lock.json names"
rm -rf "$out"
mkdir -p "$out"
target/debug/bindgen "target/$target/wasm/lightgraph_web.wasm" "$out"
(cd "$page" && node build.mjs "../../../$out" ../../../scenes)
cp docs/images/gallery/direct.png "$out/poster.png"
size=$(gzip -9 -c "$out/engine_bg.wasm" | wc -c)
echo "web: the page is in $out; the engine is $((size / 1024)) KiB, compressed"
