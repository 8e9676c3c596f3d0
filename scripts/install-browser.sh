#!/usr/bin/env bash
# Makes sure that a browser is there: a test opens the page of `lightgraph test --report` in one, without a display.
# Where one is present it says nothing and changes nothing; otherwise it installs Chromium through apt.
set -euo pipefail

# Those that tests/it/report_page.rs knows.
for browser in chromium chromium-browser google-chrome google-chrome-stable; do
    if command -v "$browser" >/dev/null 2>&1; then
        exit 0
    fi
done

if ! command -v apt-get >/dev/null 2>&1; then
    echo "browser: no Chromium or Chrome was found, and there is no apt-get to install one with; install Chromium" >&2
    exit 1
fi
as_root=()
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null 2>&1; then
        echo "browser: no Chromium or Chrome was found; as root, run: apt-get update && apt-get install chromium" >&2
        exit 1
    fi
    as_root=(sudo)
fi

echo "browser: no Chromium or Chrome was found; installing chromium through apt" >&2
log=$(mktemp)
trap 'rm -f "$log"' EXIT
for action in "update" "install --yes --no-install-recommends chromium"; do
    # The ${…+…} keeps bash before 4.4 from calling an empty array unset; the action is several words.
    # shellcheck disable=SC2086
    if ! ${as_root[@]+"${as_root[@]}"} env DEBIAN_FRONTEND=noninteractive apt-get $action >"$log" 2>&1; then
        cat "$log" >&2
        echo "browser: apt-get $action failed; what it said stands above" >&2
        exit 1
    fi
done
echo "browser: installed" >&2
