#!/usr/bin/env bash
# Drives a window of an installed Blender whose Python is 3.10 or later, on a virtual display: out/blender/window has a
# screenshot of each step. Debian's package `blender` (3.4) serves.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

for tool in blender xvfb-run; do
    if ! command -v "$tool" >/dev/null; then
        echo "blender: the window is NOT tested: $tool is not installed; \`apt-get install blender python3-numpy xvfb xauth\`" >&2
        exit 0
    fi
done
LIBGL_ALWAYS_SOFTWARE=1 xvfb-run --auto-servernum --server-args="-screen 0 1400x900x24" \
    blender --factory-startup --window-geometry 0 0 1400 900 --python-exit-code 1 \
    --python editors/blender/tests/window.py -- out/blender/window crates/python/python
