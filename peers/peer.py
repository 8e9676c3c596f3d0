"""What every peer's command has in common: its arguments, and a JSON line for each result.

    --scene PATH    a scene of scenes/, its ending may be left out
    --camera NAME   the scene's own choice without it
    --size WxH      128x128 without it
    --out FOLDER    where images and working files go
    --setting N     one of the manifest's settings, by its number there from 1; may be repeated; all of them without it

Each result is one line: {"renderer", "version", "scene", "camera", "settings", "seconds", "image", "indirect"}, where
`image` is an EXR of all light and `indirect` one of all light but the first bounce. Exit code 4 with the reason on the
error stream: this peer is not installed, or can't state this scene.
"""

import argparse
import json
import sys
from pathlib import Path

import gltf


def arguments(name):
    """The manifest NAME.json, the arguments, and the settings asked for."""
    manifest = json.loads(Path(__file__).with_name(f"{name}.json").read_text())
    settings = manifest["settings"]
    parser = argparse.ArgumentParser(description=manifest["about"])
    parser.add_argument("--scene", required=True)
    parser.add_argument("--camera")
    parser.add_argument("--size", type=size, default=(128, 128), metavar="WxH")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--setting", action="append", type=int, choices=range(1, len(settings) + 1), metavar="N")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    return args, [settings[n - 1] for n in args.setting or range(1, len(settings) + 1)]


def size(text):
    width, height = text.split("x")
    return int(width), int(height)


def load(args):
    """The scene, looked at through the camera asked for."""
    scene = gltf.load(args.scene)
    if args.camera is not None and args.camera not in scene.cameras:
        absent(f"the scene has no camera `{args.camera}`; cameras: {', '.join(scene.cameras)}")
    scene.camera = args.camera or scene.camera
    return scene


def report(renderer, version, args, scene, settings, seconds, image, indirect):
    line = {
        "renderer": renderer,
        "version": version,
        "scene": args.scene,
        "camera": scene.camera,
        "settings": settings,
        "seconds": round(seconds, 4),
        "image": str(image),
        "indirect": str(indirect),
    }
    print(json.dumps(line), flush=True)


def absent(reason):
    """Ends the command: this peer has nothing to show."""
    print(f"peers: {reason}", file=sys.stderr)
    sys.exit(4)
