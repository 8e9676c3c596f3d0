#!/usr/bin/env bash
# peers/run.sh SCRIPT ARGUMENTS…: runs a script of this folder in the environment that install.sh makes.
# Exit code 4 with a reason on the error stream: the renderer is not installed.
set -euo pipefail
folder=$(cd "$(dirname "$0")" && pwd)
home=$folder/../target/peers
if [ ! -s "$home/libllvm.path" ]; then
    echo "peers: not installed; \`make peers\` installs the renderers" >&2
    exit 4
fi
DRJIT_LIBLLVM_PATH=$(cat "$home/libllvm.path")
export DRJIT_LIBLLVM_PATH PYTHONDONTWRITEBYTECODE=1
script=$1
shift
exec "$home/bin/python" "$folder/$script" "$@"
