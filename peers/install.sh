#!/usr/bin/env bash
# Makes the environment of the other renderers in target/peers: Python packages in the versions of requirements.txt,
# the LLVM library that Mitsuba compiles its kernels with, three.js where npm is present, Blender's module where Python is
# the version it is built for. Needs Python 3.11 or newer; changes nothing elsewhere.
set -euo pipefail
cd "$(dirname "$0")/.."
home=target/peers

# LLVM 14 to 16 end the process with "Cannot select" on Mitsuba's kernels; 19 and 22 are known to work.
llvm_package=libllvm19
llvm_file=libLLVM.so.19.1

python3 -m venv "$home"
"$home/bin/pip" install --quiet --disable-pip-version-check -r peers/requirements.txt

found=$(ldconfig -p | awk -v file="$llvm_file" '$1 == file { print $NF; exit }')
if [ -z "$found" ] && command -v apt-get >/dev/null; then
    mkdir -p "$home/llvm"
    (cd "$home/llvm" && apt-get download --quiet "$llvm_package" && dpkg -x "$llvm_package"_*.deb .)
    found=$(find "$PWD/$home/llvm" -name "$llvm_file" -print -quit)
fi
if [ -z "$found" ]; then
    echo "peers: no $llvm_file here, and no apt-get to fetch Debian's $llvm_package with" >&2
    exit 1
fi
echo "$found" >"$home/libllvm.path"

# The two below may be missing; a bench then names them as absent.
if command -v npm >/dev/null; then
    mkdir -p "$home/three"
    cp peers/three/package.json "$home/three"
    npm install --prefix "$home/three" --ignore-scripts --no-audit --no-fund --loglevel=error ||
        echo "peers: three.js could not be installed" >&2
else
    echo "peers: no npm here; three.js is left out" >&2
fi
# In a home of its own: it holds its own numpy.
python3 -m venv "$home/blender"
"$home/blender/bin/pip" install --quiet --disable-pip-version-check -r peers/blender/requirements.txt ||
    echo "peers: Blender's module could not be installed; it wants the Python it is built for, 3.11" >&2
echo "peers: installed in $home"
