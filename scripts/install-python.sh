#!/usr/bin/env bash
# Makes target/python/venv, an environment with what builds and tests the Python module. Where it is there already with
# the same list of packages, nothing is done.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

list=crates/python/requirements.txt
venv=target/python/venv
stamp=$venv/.installed
[ -f "$stamp" ] && cmp -s "$list" "$stamp" && exit 0

python=$(command -v python3 || true)
# Debian keeps venv apart from Python itself.
if [ -z "$python" ] || ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    if ! command -v apt-get >/dev/null; then
        echo "python: Python 3.10 or later with its module venv is needed; install it and run this again" >&2
        exit 1
    fi
    sudo=
    [ "$(id -u)" = 0 ] || sudo=sudo
    $sudo apt-get update -qq
    DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends python3 python3-venv
    python=$(command -v python3)
fi
mkdir -p target/python
# From nothing: an environment of another Python may be there.
"$python" -m venv --clear "$venv"
"$venv/bin/pip" install --quiet --disable-pip-version-check --requirement "$list"
cp "$list" "$stamp"
