#!/usr/bin/env bash
# `watch` and the window under random edits, resizes and changes of variant: memory and descriptors must stay flat.
# soak.sh MINUTES: each runs for so long, one after the other. Figures go to out/soak, and a verdict to the terminal.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
minutes=${1:-60}
program=$PWD/target/release/lightgraph
out=$PWD/out/soak
rm -rf "$out"
mkdir -p "$out"

# Samples a process until it ends or its time is over: seconds, KiB in memory, open descriptors, threads.
sample() {
    local pid=$1 file=$2 end=$((SECONDS + minutes * 60)) start=$SECONDS
    while kill -0 "$pid" 2>/dev/null && ((SECONDS < end)); do
        local memory threads open
        memory=$(awk '/^VmRSS/ {print $2}' "/proc/$pid/status" 2>/dev/null || true)
        threads=$(awk '/^Threads/ {print $2}' "/proc/$pid/status" 2>/dev/null || true)
        open=$(ls "/proc/$pid/fd" 2>/dev/null | wc -l)
        [[ -n $memory ]] && echo "$((SECONDS - start)) $memory $open $threads" >>"$file"
        sleep 2
    done
}

# The last quarter against the second: what grows with time shows, what is filled once does not.
judge() {
    awk -v what="$1" '
        { time[NR] = $1; memory[NR] = $2; open[NR] = $3; threads[NR] = $4 }
        END {
            if (NR < 16) { print what ": too few samples, " NR; exit 1 }
            for (i = int(NR / 4) + 1; i <= int(NR / 2); i++) { m0 += memory[i]; o0 += open[i]; t0 += threads[i]; a++ }
            for (i = int(NR * 3 / 4) + 1; i <= NR; i++) { m1 += memory[i]; o1 += open[i]; t1 += threads[i]; b++ }
            m0 /= a; o0 /= a; t0 /= a; m1 /= b; o1 /= b; t1 /= b
            printf "%s: %d s, memory %.0f -> %.0f MiB, descriptors %.1f -> %.1f, threads %.1f -> %.1f\n", what, time[NR], m0 / 1024, m1 / 1024, o0, o1, t0, t1
            flat = m1 < m0 * 1.1 + 16 * 1024 && o1 < o0 + 4 && t1 < t0 + 4
            if (!flat) print what ": not flat"
            exit !flat
        }' "$2"
}

# A project of two graphs and a shader that is edited.
project() {
    mkdir -p "$1/shaders"
    cat >"$1/graph.ron" <<'GRAPH'
Graph(
    about: "One colour",
    params: {"red": Float(default: 0.25, min: 0.0, max: 1.0, about: "how red")},
    resources: {"color": Texture(format: Rgba32Float, size: "screen")},
    passes: [Screen(name: "paint", shader: "paint.wgsl", color: "color")],
    outputs: {"color": "color"},
)
GRAPH
    echo 'Variant(base: "graph.ron", about: "redder", params: {"red": (default: 1.0)})' >"$1/other.ron"
    echo 'var<uniform> red: f32; @fragment fn paint() -> @location(0) vec4f { return vec4f(red, 0.5 + 0.0, 0.0, 1.0); }' >"$1/shaders/paint.wgsl"
    cp scenes/lambert_plane.glb "$1/scene.glb"
}

verdict=0

project "$out/watch"
"$program" watch "$out/watch/graph.ron" --scene "$out/watch/scene.glb" --size 64x48 --out "$out/watch/image.png" >"$out/watch.log" 2>&1 &
watch=$!
trap 'kill "$watch" 2>/dev/null || true' EXIT
(
    good=$(cat "$out/watch/shaders/paint.wgsl")
    graph=$(cat "$out/watch/graph.ron")
    while kill -0 "$watch" 2>/dev/null; do
        case $((RANDOM % 8)) in
            0) echo "${good/0.5/0.$RANDOM}" >"$out/watch/shaders/paint.wgsl" ;;
            1) echo "${good/return/retrun}" >"$out/watch/shaders/paint.wgsl" ;;
            2) echo "$good" >"$out/watch/shaders/new" && mv "$out/watch/shaders/new" "$out/watch/shaders/paint.wgsl" ;;
            3) echo "${graph/0.25/0.$RANDOM}" >"$out/watch/graph.ron" ;;
            4) head -c $((RANDOM % ${#graph})) <<<"$graph" >"$out/watch/graph.ron" ;;
            5) mkfifo "$out/watch/shaders/pipe.wgsl" 2>/dev/null || rm -f "$out/watch/shaders/pipe.wgsl" ;;
            6) rm -f "$out/watch/shaders/pipe.wgsl"; echo "$graph" >"$out/watch/graph.ron" ;;
            7) touch "$out/watch/scene.glb" ;;
        esac
        sleep 0.2
    done
) &
sample "$watch" "$out/watch.txt"
kill -0 "$watch" 2>/dev/null || { echo "watch: it ended by itself"; verdict=1; }
kill "$watch" 2>/dev/null || true
wait "$watch" 2>/dev/null || true
echo "watch: $(grep -c 'graph .* ms' "$out/watch.log" || true) images, $(grep -c 'the last good image stays' "$out/watch.log" || true) faults"
judge watch "$out/watch.txt" || verdict=1

project "$out/view"
{
    echo '[ Rest,'
    for ((i = 0; i < minutes * 120; i++)); do
        case $((RANDOM % 5)) in
            0) echo "Size($((200 + RANDOM % 1000)), $((200 + RANDOM % 600))), Rest," ;;
            1) echo 'Click("variant other"), Rest, Click("variant graph"), Rest,' ;;
            2) echo 'Replace(file: "shaders/paint.wgsl", text: "0.5 +", by: "0.25 +"), Rest, Replace(file: "shaders/paint.wgsl", text: "0.25 +", by: "0.5 +"), Rest,' ;;
            3) echo 'Replace(file: "shaders/paint.wgsl", text: "0.5 +", by: "green +"), Faults("paint.wgsl"), Replace(file: "shaders/paint.wgsl", text: "green +", by: "0.5 +"), Mended, Rest,' ;;
            4) echo 'Drag(on: "image", from: (0.5, 0.5), to: (0.6, 0.45)), Rest,' ;;
        esac
    done
    echo 'Close ]'
} >"$out/view/script.ron"
cd "$out/view"
xvfb-run -a -s '-screen 0 1280x800x24' "$program" view graph.ron --scene scene.glb --size 900x600 --script script.ron >"$out/view.log" 2>&1 &
runner=$!
sleep 3
view=$(pgrep -P "$runner" -f 'lightgraph view' | head -1 || true)
sample "${view:-$runner}" "$out/view.txt"
if kill -0 "$runner" 2>/dev/null; then
    kill "${view:-$runner}" 2>/dev/null || true
fi
wait "$runner" 2>/dev/null || true
grep -q panicked "$out/view.log" && { echo "view: it panicked"; verdict=1; }
judge view "$out/view.txt" || verdict=1
exit "$verdict"
