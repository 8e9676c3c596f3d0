"""Holds lightgraph to Mitsuba under panoramas of the world: a matte and a rough metal ball under three of npm's
`@pmndrs/assets` (CC0), in target/peers/environments.

    peers/run.sh environments.py LIGHTGRAPH [--samples N] [--size N]

LIGHTGRAPH is the command to run. `pathtrace` must lie within 3 standard errors of Mitsuba in 8 × 8 blocks, but for as
many as chance explains, and in the whole; `final_gather` within 5 % (rmse of such blocks) where the ball is matte. Ends with
1 where something lies farther.
"""

import argparse
import base64
import json
import struct
import subprocess
import sys
from pathlib import Path

import gltf
import image_files
import mitsuba_light as light
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
HOME = ROOT / "target/peers/environments"
ASSETS = ROOT / "target/peers/three/node_modules/@pmndrs/assets/hdri"
SKIES = ("studio", "forest", "sunset")
METAL = {"baseColorFactor": [0.95, 0.7, 0.35, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.4}
# Independent images of each program.
IMAGES = 8
BLOCK = 8


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("lightgraph", metavar="LIGHTGRAPH")
    parser.add_argument("--samples", type=int, default=64, help="of each of the images; Mitsuba takes four times as many")
    parser.add_argument("--size", type=int, default=64)
    args = parser.parse_args()
    if not ASSETS.is_dir():
        sys.exit("peers: there are no panoramas; `make peers` installs them where npm is present")
    HOME.mkdir(parents=True, exist_ok=True)
    good = [compare(args, sky, ball) for sky in SKIES for ball in ("matte", "metal")]
    sys.exit(0 if all(good) else 1)


def compare(args, sky, ball):
    scene = written(sky, ball)
    loaded = gltf.load(scene)
    tracer = light.Tracer(loaded, loaded.camera, args.size, args.size)
    theirs = [tracer.radiance(light.ALL, 4 * args.samples, 1 + k * 1_000_003).reshape(tracer.shape) for k in range(IMAGES)]
    ours = [rendered(args, scene, "pathtrace", f"samples={args.samples}", f"seed={k}") for k in range(IMAGES)]
    # Without the sky itself, and without the ball's outline: there Mitsuba shows black where an interpolated normal turns
    # away, and rounding decides where the ball ends.
    inside = tracer.surfaces()[2].reshape(tracer.shape)[..., 0] > 0
    edges = outline(inside) | ~inside
    z, whole = deviations([blocks(i, edges) for i in ours], [blocks(i, edges) for i in theirs])
    far = int((np.abs(z) > 3).sum())
    # So many of independent ones lie beyond three standard errors by chance, told from so few images (Student's t).
    most = max(3, int(0.03 * z.size))
    bias = 100 * (np.mean([blocks(i, edges) for i in ours]) / np.mean([blocks(i, edges) for i in theirs]) - 1)
    text = f"{sky}, {ball}: bias {bias:+.3f} %, the whole {whole:+.1f} standard errors, {far} of {z.size} blocks beyond 3"
    good = far <= most and abs(whole) <= 3.5
    if ball == "matte":
        gathered = rendered(args, scene, "final_gather")
        reference = np.mean([blocks(i, edges) for i in theirs], axis=0)
        off = blocks(gathered, edges) - reference
        rmse = 100 * np.sqrt((off**2).mean()) / reference.mean()
        text += f"; final_gather {rmse:.2f} %"
        good = good and rmse <= 5
    print(f"{text}: {'agrees' if good else 'DIFFERS'}", flush=True)
    return bool(good)


def written(sky, ball):
    """The scene file of a ball under a panorama."""
    text = (ASSETS / f"{sky}.exr.js").read_text()
    panorama = HOME / f"{sky}.exr"
    raw = HOME / f"{sky}.packed.exr"
    raw.write_bytes(base64.b64decode(text.split("base64,", 1)[1].split("'")[0]))
    # As it was made smaller, lamps have got rims of less than no light.
    image_files.write(panorama, np.maximum(image_files.read(raw), 0))
    model = HOME / f"{ball}.glb"
    j, data = gltf.document(ROOT / "scenes/sky_ball.glb")
    if ball == "metal":
        j["materials"][0]["pbrMetallicRoughness"] = METAL
    text = json.dumps(j).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<5I", 0x46546C67, 2, 28 + len(text) + len(data), len(text), 0x4E4F534A)
    model.write_bytes(head + text + struct.pack("<2I", len(data), 0x004E4942) + data)
    scene = HOME / f"{sky}_{ball}.ron"
    box = "grid: ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))"
    scene.write_text(f'Scene(gltf: "{model.name}", {box}, environment: File(file: "{panorama.name}"))\n')
    return scene


def rendered(args, scene, graph, *settings):
    out = HOME / "ours.exr"
    command = [args.lightgraph, "render", f"graphs/gi/{graph}.ron", "--scene", scene, "--size", f"{args.size}x{args.size}"]
    for setting in settings:
        command += ["--set", setting]
    command += ["--output", f"color={out}"]
    subprocess.run([str(c) for c in command], cwd=ROOT, check=True, capture_output=True)
    return image_files.read(out)


def outline(inside):
    """Pixels beside the border between what is inside and what is not."""
    padded = np.pad(inside, 1, mode="edge")
    around = [padded[y : y + inside.shape[0], x : x + inside.shape[1]] for y in range(3) for x in range(3)]
    return np.any([a != inside for a in around], axis=0)


def blocks(image, left_out):
    """Sums over the channels and pixels of each block that is not left out as a whole."""
    height, width = left_out.shape
    parts = lambda values: values.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK).sum(axis=(1, 3))
    return parts(np.where(left_out, 0.0, image.sum(axis=2)))[parts(~left_out) > 0]


def deviations(ours, theirs):
    """How far means lie apart, in standard errors: by block, and in the whole. Panoramas are kept by other texels, which
    may be a thousandth of the light."""

    def of(a, b):
        spread = np.sqrt(np.var(a, axis=0, ddof=1) / len(a) + np.var(b, axis=0, ddof=1) / len(b))
        mean = np.mean(b, axis=0)
        return (np.mean(a, axis=0) - mean) / np.hypot(spread, 1e-3 * mean)

    return of(ours, theirs), float(of([a.mean() for a in ours], [b.mean() for b in theirs]))


if __name__ == "__main__":
    main()
