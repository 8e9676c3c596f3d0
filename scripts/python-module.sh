#!/usr/bin/env bash
# Puts the Python module that `cargo build` made into an environment, without a second build: python-module.sh [VENV]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

venv=${1:-target/python/venv}
module=crates/python/python/lightgraph/_native.abi3.so
built=target/debug/liblightgraph_python.so
[ -f "$built" ] || built=target/debug/liblightgraph_python.dylib
# A process that runs with the old file keeps it.
cp "$built" "$module.new"
mv -f "$module.new" "$module"
"$venv/bin/python" - "$PWD/crates/python/python" <<'PYTHON'
import pathlib, sys, sysconfig

pathlib.Path(sysconfig.get_path("purelib"), "lightgraph.pth").write_text(sys.argv[1] + "\n")
PYTHON
