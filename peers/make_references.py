"""Makes the reference images of tests/references with Mitsuba, and their manifest references.json.

    peers/run.sh make_references.py [SCENE[:CAMERA]…] [--check | --errors] [--out FOLDER]

Without names: every reference of the table below. `--check` writes nothing: it renders the named references anew with
few samples and another seed, and exits with 1 where the files differ by more than the noise of both explains.
`--errors` makes the images of standard errors alone, of all that the manifest lists.
"""

import argparse
import json
import sys
import time
from importlib.metadata import version
from pathlib import Path

import gltf
import image_files
import mitsuba_light as light
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "tests/references"
SIZE = 128
SEED = 1
# Pixels along a side of the blocks whose means have a standard error in a file.
BLOCK = 8
# Samples that such an error is told from, at most.
ERROR_SAMPLES = 256
# Images with fewer bounces get this share of the samples, and no more than so many.
SHARE_OF_BOUNCE_IMAGES = 4
MOST_OF_BOUNCE_IMAGES = 4096
BOUNCES = (1, 2, 3)

# Scene, camera, samples a pixel of `indirect`, and which numbers of bounces have images of their own.
REFERENCES = [
    ("hall", "nave", 32768, BOUNCES),
    ("art_gallery", "main", 32768, BOUNCES),
    ("cornell", "front", 49152, BOUNCES),
    ("corridor", "along", 32768, BOUNCES),
    ("empty_room", "inside", 16384, BOUNCES),
    ("two_rooms", "lit", 32768, BOUNCES),
    ("two_rooms", "dark", 64, BOUNCES),
    ("lambert_plane", "above", 64, BOUNCES),
    ("metal_balls", "front", 1024, BOUNCES),
    ("apartment", "living", 49152, ()),
    ("atrium", "court", 32768, ()),
    ("street", "along", 49152, ()),
    ("workshop", "corner", 16384, ()),
    ("materials", "front", 1024, ()),
]
# Closed boxes whose walls all emit radiance 1 and have this albedo: no image is needed.
FURNACES = [("furnace", 0.5), ("furnace_80", 0.8), ("furnace_95", 0.95)]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*", metavar="SCENE[:CAMERA]")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--errors", action="store_true")
    parser.add_argument("--out", type=Path, default=FOLDER)
    args = parser.parse_args()
    if args.check:
        chosen = [e for e in manifest(args.out) if asked(args.names, e["scene"], e["camera"])]
        sys.exit(0 if all([check(e, args.out) for e in chosen]) else 1)
    if args.errors:
        for e in manifest(args.out):
            if "files" in e and asked(args.names, e["scene"], e["camera"]):
                enter(args.out, e | {"errors": block_errors(e, args.out)})
        return
    args.out.mkdir(parents=True, exist_ok=True)
    for scene, camera, samples, bounces in REFERENCES:
        if asked(args.names, scene, camera):
            enter(args.out, make(scene, camera, samples, bounces, args.out))
    for scene, albedo in FURNACES:
        if asked(args.names, scene, "inside"):
            enter(args.out, furnace(scene, albedo))


def asked(names, scene, camera):
    return not names or scene in names or f"{scene}:{camera}" in names


def manifest(folder):
    path = folder / "references.json"
    return json.loads(path.read_text()) if path.exists() else []


def enter(folder, entry):
    """Puts an entry into the manifest, in the place of the one for the same scene and camera."""
    key = lambda e: (e["scene"], e["camera"])
    entries = [e for e in manifest(folder) if key(e) != key(entry)] + [entry]
    (folder / "references.json").write_text(json.dumps(sorted(entries, key=key), indent=2) + "\n")


def make(scene, camera, samples, bounces, folder):
    start = time.time()
    loaded = gltf.load(ROOT / "scenes" / scene)
    tracer = light.Tracer(loaded, camera, SIZE, SIZE)
    stem = scene if camera == loaded.camera else f"{scene}_{camera}"
    mean, error, direct = light.mean_and_error(tracer, light.ALL, samples, SEED)
    fewer = min(max(samples // SHARE_OF_BOUNCE_IMAGES, 16), MOST_OF_BOUNCE_IMAGES)
    images = {"direct": direct, "indirect": mean, "full": direct + mean}
    counts = {"direct": 1 if tracer.direct_is_exact else samples, "indirect": samples, "full": samples}
    errors = {"direct": 0.0, "indirect": percent(error, mean), "full": percent(error, direct + mean)}
    if tracer.under_panorama:
        # Its direct light has noise, too; what the blocks' errors are is in images.
        errors = {"indirect": errors["indirect"]}
    for n in bounces:
        mean, error, _ = light.mean_and_error(tracer, n + 2, fewer, SEED + n)
        name = f"b{n}_indirect"
        images[name], counts[name], errors[name] = mean, fewer, percent(error, mean)
    for name, image in zip(("albedo", "normal", "depth"), tracer.surfaces(), strict=True):
        images[name], counts[name] = image, 1
    files = {}
    for name, image in images.items():
        files[name] = f"{stem}_{name}.exr"
        about = f"{scene}, camera {camera}: {name}, Mitsuba {version('mitsuba')}, {counts[name]} samples, seed {SEED}"
        image_files.write(folder / files[name], image.reshape(tracer.shape), about, image_files.HALF)
    entry = {
        "scene": scene,
        "camera": camera,
        "size": [SIZE, SIZE],
        "renderer": "Mitsuba path",
        "version": version("mitsuba"),
        "seed": SEED,
        "files": files,
        "samples": counts,
        "stderr_percent": errors,
    }
    entry["errors"] = block_errors(entry, folder)
    print(f"{stem}: indirect ± {errors['indirect']:.2f} %, {time.time() - start:.0f} s", flush=True)
    return entry


def block_errors(entry, folder):
    """Standard errors of an entry's indirect light and, under a panorama, of all light, in an image a quantity: a pixel is a block of BLOCK × BLOCK, its
    value that of the mean over the block and the three channels. Told from fewer samples of another seed, so that what
    chance does to an image does not show in its error; files by quantity."""
    height, width = entry["size"]
    tracer = light.Tracer(gltf.load(ROOT / "scenes" / entry["scene"]), entry["camera"], width, height)
    files = {}
    everything = [("full", light.ALL)] if tracer.under_panorama else []
    for name, depth in everything + [("indirect", light.ALL)] + [(f"b{n}_indirect", n + 2) for n in BOUNCES]:
        if name not in entry["files"]:
            continue
        samples = min(entry["samples"][name], ERROR_SAMPLES)
        parts, directs = light.passes(tracer, depth, samples, SEED + 55_555 + depth)
        if name == "full":
            parts = [part + direct for part, direct in zip(parts, directs, strict=True)]
        if not np.any(parts):
            continue
        pixels = light.standard_error([part.mean(axis=1) for part in parts])
        pixels *= np.sqrt(samples / entry["samples"][name])
        # Pixels are independent of each other.
        blocks = (pixels**2).reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK).sum(axis=(1, 3))
        image = np.repeat(np.sqrt(blocks)[:, :, None] / BLOCK**2, 3, axis=2)
        files[name] = entry["files"][name].replace(".exr", "_error.exr")
        about = f"standard errors of the means over {BLOCK} × {BLOCK} pixels of {entry['files'][name]}, from {samples} samples"
        image_files.write(folder / files[name], image, about)
    return files


def percent(error, mean):
    """Standard errors of all pixels and channels as rmse % is taken: root of the mean square, by the mean."""
    return round(100 * float(np.sqrt((error**2).mean()) / mean.mean()), 3) if mean.any() else 0.0


def furnace(scene, albedo):
    """Direct light is emission and what the walls reflect of it at once."""
    exact = {"direct": 1 + albedo, "indirect": albedo**2 / (1 - albedo), "full": 1 / (1 - albedo)}
    for n in BOUNCES:
        exact[f"b{n}_indirect"] = sum(albedo**k for k in range(2, n + 2))
    exact = {name: round(value, 9) for name, value in exact.items()}
    return {"scene": scene, "camera": "inside", "size": [SIZE, SIZE], "renderer": "closed form", "exact": exact}


def check(entry, folder, samples=256):
    """Renders an entry's scene anew and compares: `indirect` with its file, and `full` with a constant."""
    tracer = light.Tracer(gltf.load(ROOT / "scenes" / entry["scene"]), entry["camera"], *entry["size"])
    found, error, direct = light.mean_and_error(tracer, light.ALL, samples, SEED + 77_777)
    known = 0.0
    if "exact" in entry:
        quantity = "full"
        reference = np.full_like(found, entry["exact"]["full"])
        found = found + direct
    else:
        quantity = "indirect"
        reference = image_files.read(folder / entry["files"]["indirect"]).reshape(found.shape)
        known = entry["stderr_percent"].get("indirect", 0.0)
    level = max(float(reference.mean()), 1e-9)
    noise = np.hypot(percent(error, reference), known)
    off = 100 * np.sqrt(((found - reference) ** 2).mean()) / level
    bias = 100 * (found.mean() / level - 1) if reference.any() else found.mean()
    # Sixteen passes know the noise of an image to about a tenth; half floats hold 0.05 %.
    good = bool(off <= 1.2 * noise + 0.05 and abs(bias) < 1)
    print(
        f"{entry['scene']}, {entry['camera']}: {quantity} differs by {off:.2f} %, of which noise explains {noise:.2f} %; "
        f"bias {bias:+.2f} %: {'agrees' if good else 'DIFFERS'}",
        flush=True,
    )
    return good


if __name__ == "__main__":
    main()
