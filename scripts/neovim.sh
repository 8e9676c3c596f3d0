#!/usr/bin/env bash
# A session in Neovim, without a screen: in a project of `lightgraph new` a fault is seen, its remedy applied, a parameter renamed across
# a graph, a variant and a shader; `lightgraph check` agrees. Installs Neovim through apt where there is none.
set -euo pipefail

here=$(cd "$(dirname "$0")/.." && pwd)
export PATH="$here/target/debug:$PATH"
if ! command -v nvim >/dev/null 2>&1; then
    as_root=()
    [ "$(id -u)" -eq 0 ] || as_root=(sudo)
    ${as_root[@]+"${as_root[@]}"} env DEBIAN_FRONTEND=noninteractive sh -c 'apt-get update -qq && apt-get install --yes -qq neovim' >/dev/null
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
lightgraph new "$folder/project" >/dev/null
cd "$folder/project"
cat > graphs/mine.ron <<'RON'
Graph(
    about: "A picture, brighter",
    params: {"brightness": Float(default: 2.0, about: "how much brighter")},
    resources: {"color": Texture(format: Rgba32Float, size: "screen")},
    passes: [Screen(name: "make", shader: "mine.wgsl", color: "colour")],
    outputs: {"color": "color"},
)
RON
cat > graphs/darker.ron <<'RON'
Variant(base: "mine.ron", about: "Darker", params: {"brightness": (default: 0.5)})
RON
cat > shaders/mine.wgsl <<'WGSL'
var<uniform> brightness: f32;
@fragment fn main() -> @location(0) vec4f { return vec4f(brightness); }
WGSL
if lightgraph check graphs/mine.ron >/dev/null 2>&1; then
    echo "neovim: the fault isn't one" >&2
    exit 1
fi
timeout 300 nvim --headless -u NONE -i NONE -c "luafile $here/scripts/neovim.lua" graphs/mine.ron
lightgraph check --strict graphs/mine.ron graphs/darker.ron
for file in graphs/mine.ron graphs/darker.ron shaders/mine.wgsl; do
    if grep -q brightness "$file" || ! grep -q strength "$file"; then
        echo "neovim: $file was not renamed" >&2
        exit 1
    fi
done
echo "neovim: a fault, its remedy and a rename across three files"
