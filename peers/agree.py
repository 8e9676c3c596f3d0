"""Sets Radiance beside the references that Mitsuba made.

    peers/run.sh agree.py SCENE[:CAMERA]… [--bounces N] [--out FOLDER]

Radiance runs without its cache here (-aa 0), so that what remains is noise and no interpolation. Printed per number of
bounces: rmse % and bias % of `direct` or of the indirect light, rmse % of 8 × 8 means, and what rmse % would leave of
itself in such means if it were noise from pixel to pixel: an eighth. Means that differ by much more differ by structure.
"""

import argparse
from pathlib import Path

import gltf
import image_files
import numpy as np
import radiance_scene as radiance
from make_references import FOLDER, ROOT, manifest
from run_radiance import DIRECT

# Rays that gather ambient light at a point.
GATHER = 128


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="+", metavar="SCENE[:CAMERA]")
    parser.add_argument("--bounces", type=int, default=3)
    parser.add_argument("--out", type=Path, default=ROOT / "target/peers/agree")
    args = parser.parse_args()
    print("| scene | light | rmse % | an eighth | of 8 × 8 means | bias % |\n|---|---|---:|---:|---:|---:|")
    for entry in manifest(FOLDER):
        named = (entry["scene"], f"{entry['scene']}:{entry['camera']}")
        if "files" in entry and any(name in named for name in args.names):
            agree(entry, args.bounces, args.out)


def agree(entry, bounces, out):
    scene = gltf.load(ROOT / "scenes" / entry["scene"])
    octree = radiance.build(scene, out / entry["scene"])
    width, height = entry["size"]
    origin, directions = scene.rays(entry["camera"], width, height)
    options = [*DIRECT, "-aa", "0", "-ad", str(GATHER), "-as", "0"]
    direct = radiance.trace(octree, origin, directions, [*options, "-ab", "0"])
    row(entry, "direct", direct)
    for n in range(1, bounces + 1):
        full = radiance.trace(octree, origin, directions, [*options, "-ab", str(n)])
        row(entry, f"b{n}_indirect", full - direct)


def row(entry, name, image):
    width, height = entry["size"]
    reference = image_files.read(FOLDER / entry["files"][name])
    off = image.reshape(reference.shape) - reference
    means = off.reshape(height // 8, 8, width // 8, 8, 3).mean(axis=(1, 3))
    percent = lambda values: 100 * np.sqrt((values**2).mean()) / reference.mean()
    print(
        f"| {entry['scene']}, {entry['camera']} | {name} | {percent(off):.2f} | {percent(off) / 8:.2f} "
        f"| {percent(means):.2f} | {100 * off.mean() / reference.mean():+.2f} |",
        flush=True,
    )


if __name__ == "__main__":
    main()
