#!/usr/bin/env bash
# The page in Chromium without a display, on a software adapter. Where this machine can't have the compiler's target, Node
# or Chromium, it says so and ends well: nothing else needs them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if ! scripts/install-browser.sh; then
    echo "test-web: there is no browser; the page for browsers is NOT tested here" >&2
    exit 0
fi
code=0
scripts/web.sh || code=$?
if [ "$code" = 3 ]; then
    echo "test-web: the page for browsers is NOT tested here" >&2
    exit 0
fi
[ "$code" = 0 ] || exit "$code"
cargo build
exec node crates/web/page/test/run.mjs target/debug/lightgraph target/web out/web
