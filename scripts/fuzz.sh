#!/usr/bin/env bash
# Coverage-guided fuzzing of all targets of fuzz/, MINUTES in all, one after the other: fuzz.sh MINUTES [TARGET…]
# Needs `cargo install cargo-fuzz`, a nightly toolchain and a C++ compiler. What was found before is kept in fuzz/corpus, which git ignores;
# inputs that fail lie in fuzz/artifacts.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
minutes=${1:-10}
shift || true
targets=("$@")
if ((${#targets[@]} == 0)); then
    targets=(graph variant scene test wgsl gltf image results cache plan)
fi
for tool in "cargo fuzz --version" "cargo +nightly --version"; do
    if ! $tool >/dev/null 2>&1; then
        echo "fuzz: \`$tool\` fails; \`cargo install cargo-fuzz\` and \`rustup toolchain install nightly\` install what is needed" >&2
        exit 1
    fi
done

# Sound files to begin with, called by their hash as libFuzzer does: two folders may hold files of one name, and a second
# run adds nothing.
seed() {
    local folder=fuzz/corpus/$1 file
    shift
    mkdir -p "$folder"
    while read -r file; do
        cp "$file" "$folder/$(sha1sum <"$file" | cut -d' ' -f1)"
    done < <(find "$@" -maxdepth 1 -type f -size -64k)
}
seed graph graphs/gi/*.ron tests/bad/*.ron
seed plan graphs/gi/*.ron
seed variant graphs/gi/*.ron
seed scene scenes/*.ron
seed test tests/graphs/*.ron
seed wgsl shaders/*.wgsl shaders/lib/*.wgsl
seed gltf scenes/*.gltf scenes/*.glb
seed image fuzz/seeds/*.exr
seed results fuzz/seeds/*.json fuzz/seeds/*.gz
seed cache fuzz/seeds/*.module

seconds=$((minutes * 60 / ${#targets[@]}))
verdict=0
for target in "${targets[@]}"; do
    echo "== $target, $seconds s"
    # On a busy machine a unit may take seconds: what counts is the time limit.
    cargo +nightly fuzz run --sanitizer none "$target" -- -max_total_time="$seconds" -timeout=30 -report_slow_units=30 \
        -rss_limit_mb=4096 -max_len=65536 -print_final_stats=1 2>&1 | grep -E "stat::number_of_executed_units|stat::peak_rss|SUMMARY|panicked|Test unit written|^ERROR" || true
    if [[ -n $(ls "fuzz/artifacts/$target" 2>/dev/null) ]]; then
        verdict=1
    fi
done
exit "$verdict"
