#!/usr/bin/env bash
# `watch` and the window under random edits, resizes and changes of variant: memory, descriptors and threads must stay flat.
# soak.sh MINUTES [PROGRAM]: both run for so long, side by side. Figures go to out/soak, and a verdict to the terminal.
# Objects of the device are counted where the program can count them: by the flights of `lightgraph stress`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
minutes=${1:-60}
program=$(realpath "${2:-target/release/lightgraph}")
out=$PWD/out/soak
if ! command -v Xvfb >/dev/null; then
    echo "soak: the window needs Xvfb, a virtual display: on Debian and Ubuntu \`apt install xvfb\`" >&2
    exit 1
fi
rm -rf "$out"
mkdir -p "$out"
children=()
trap 'kill "${children[@]}" 2>/dev/null || true' EXIT

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

# Edits, breaks and mends what a process watches until it ends.
edit() {
    local pid=$1 folder=$2 good graph
    good=$(<"$folder/shaders/paint.wgsl")
    graph=$(<"$folder/graph.ron")
    while kill -0 "$pid" 2>/dev/null; do
        case $((RANDOM % 8)) in
            0) echo "${good/0.5/0.$RANDOM}" >"$folder/shaders/paint.wgsl" ;;
            1) echo "${good/return/retrun}" >"$folder/shaders/paint.wgsl" ;;
            2) echo "$good" >"$folder/shaders/new" && mv "$folder/shaders/new" "$folder/shaders/paint.wgsl" ;;
            3) echo "${graph/0.25/0.$RANDOM}" >"$folder/graph.ron" ;;
            4) head -c $((RANDOM % ${#graph})) <<<"$graph" >"$folder/graph.ron" ;;
            5) mkfifo "$folder/shaders/pipe.wgsl" 2>/dev/null || rm -f "$folder/shaders/pipe.wgsl" ;;
            6) touch "$folder/scene.glb" ;;
            7) rm "$folder/graph.ron" && echo "$graph" >"$folder/graph.ron" ;;
        esac
        # Some changes come together, others are seen one by one.
        sleep "0.$((RANDOM % 8 + 1))"
        if ((RANDOM % 2)); then
            rm -f "$folder/shaders/pipe.wgsl"
            echo "$good" >"$folder/shaders/paint.wgsl"
            echo "$graph" >"$folder/graph.ron"
            sleep "0.$((RANDOM % 8 + 1))"
        fi
    done
}

# What is done to the window. Every tenth step leaves a file that tells how far it has come.
script() {
    local i
    echo '[ Rest,'
    for ((i = 1; i <= minutes * 240; i++)); do
        case $((RANDOM % 5)) in
            # In a small window not all parts are there to be clicked at.
            0) echo "Size($((200 + RANDOM % 1000)), $((200 + RANDOM % 600))), Rest, Size(900, 600), Rest," ;;
            1) echo 'Click("variant other"), Rest, Click("variant graph"), Rest,' ;;
            2) echo 'Replace(file: "shaders/paint.wgsl", text: "0.5 +", by: "0.25 +"), Rest, Replace(file: "shaders/paint.wgsl", text: "0.25 +", by: "0.5 +"), Rest,' ;;
            3) echo 'Replace(file: "shaders/paint.wgsl", text: "0.5 +", by: "green +"), Faults("paint.wgsl"), Replace(file: "shaders/paint.wgsl", text: "green +", by: "0.5 +"), Mended, Rest,' ;;
            4) echo 'Drag(on: "image", from: (0.5, 0.5), to: (0.6, 0.45)), Rest,' ;;
        esac
        ((i % 10)) || echo "Save(\"came to $i.ron\"),"
    done
    echo 'Close ]'
}

project "$out/watch"
"$program" watch "$out/watch/graph.ron" --scene "$out/watch/scene.glb" --size 64x48 --out "$out/watch/image.png" >"$out/watch.log" 2>&1 &
watch=$!
edit "$watch" "$out/watch" &
children+=("$watch" $!)

Xvfb -displayfd 1 -screen 0 1280x1024x24 -nolisten tcp >"$out/display" 2>/dev/null &
children+=($!)
until [[ -s $out/display ]]; do
    kill -0 "${children[-1]}" 2>/dev/null || { echo "soak: Xvfb does not start" >&2; exit 1; }
    sleep 0.1
done
project "$out/view"
script >"$out/view/script.ron"
(cd "$out/view" && exec env -u WAYLAND_DISPLAY DISPLAY=":$(<"$out/display")" \
    "$program" view graph.ron --scene scene.glb --size 900x600 --script script.ron) >"$out/view.log" 2>&1 &
view=$!
children+=("$view")

sample "$watch" "$out/watch.txt" &
sampler=$!
sample "$view" "$out/view.txt"
wait "$sampler"

verdict=0
kill -0 "$watch" 2>/dev/null || { echo "watch: it ended by itself"; verdict=1; }
if ! kill -0 "$view" 2>/dev/null && ! wait "$view"; then
    echo "view: it ended by itself"
    verdict=1
fi
kill "$watch" "$view" 2>/dev/null || true
wait "$watch" "$view" 2>/dev/null || true
if grep -H panicked "$out"/*.log; then
    verdict=1
fi
echo "watch: $(grep -c 'graph .* ms' "$out/watch.log" || true) images, $(grep -c 'the last good image stays' "$out/watch.log" || true) faults"
judge watch "$out/watch.txt" || verdict=1
echo "view: $(find "$out/view" -name 'came to *' | wc -l)0 steps"
judge view "$out/view.txt" || verdict=1
exit "$verdict"
