"""States where three.js puts vertices that nodes, joints and morph targets move.

    peers/run.sh make_poses.py [MODEL.glb…] [--out FILE]

Without models: scenes/moves.glb, into tests/references/poses.json, which a test holds lightgraph to. Others go to
target/peers/poses.json; `cargo test --test it poses -- --ignored` then compares these.
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
HOME = ROOT / "target/peers/three"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("models", nargs="*", metavar="MODEL.glb")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    deno = next(HOME.glob("node_modules/@deno/*/deno"), None)
    if deno is None:
        sys.exit("peers: three.js is not installed; `make peers` installs it where npm is present")
    out = args.out or ROOT / ("target/peers/poses.json" if args.models else "tests/references/poses.json")
    # Packages are found from the folder of the script.
    script = HOME / "poses.mjs"
    shutil.copyfile(ROOT / "peers/three/poses.mjs", script)
    models = args.models or ["scenes/moves.glb"]
    command = [deno, "run", "--allow-read", "--allow-env", script, *models]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    out.write_text(done.stdout)


if __name__ == "__main__":
    main()
