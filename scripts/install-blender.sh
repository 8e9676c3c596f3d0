#!/usr/bin/env bash
# Makes target/blender/venv, an environment with Blender as a Python module (400 MB) and what tests the add-on in it. Where
# it is there already with the same list of packages, nothing is done.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

list=editors/blender/tests/requirements.txt
venv=target/blender/venv
stamp=$venv/.installed
[ -f "$stamp" ] && cmp -s "$list" "$stamp" && exit 0

# Blender as a module fits one version of Python.
python=$(command -v python3.11 || true)
if [ -z "$python" ]; then
    echo "blender: Python 3.11 is needed for Blender as a module; install it and run this again" >&2
    exit 1
fi
mkdir -p target/blender
"$python" -m venv --clear "$venv"
"$venv/bin/pip" install --quiet --disable-pip-version-check --requirement "$list"
cp "$list" "$stamp"
