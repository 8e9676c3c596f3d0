"""The peer `radiance`: its ambient cache with more and more bounces. peer.py states arguments and results.

`seconds` counts `rtrace` alone, both passes of it: one over every fourth pixel of every fourth row that fills the
cache evenly, one over the whole image. The first bounce (-ab 0) is traced afterwards, untimed.
"""

import tempfile
import time
from pathlib import Path

import image_files
import peer
import radiance_scene as radiance
from gltf import Unsupported

# Direct light in full: no lamp is guessed, none jittered. Surfaces as flat as their triangles. No weight ends a path
# before -ab does.
DIRECT = "-dt 0 -dc 1 -dj 0 -ds 0.1 -st 0 -lr 0 -lw 1e-6 -av 0 0 0".split()
AMBIENT = "-aa 0.15 -ad 512 -as 128 -ar 64".split()


def main():
    args, settings = peer.arguments("radiance")
    try:
        scene = peer.load(args)
        octree = radiance.build(scene, args.out / "radiance")
    except Unsupported as why:
        peer.absent(str(why))
    width, height = args.size
    origin, directions = scene.rays(scene.camera, width, height)
    coarse = directions.reshape(height, width, 3)[::4, ::4].reshape(-1, 3)
    direct = radiance.trace(octree, origin, directions, [*DIRECT, "-ab", "0"])
    for setting in settings:
        with tempfile.TemporaryDirectory() as folder:
            cache = ["-ab", str(setting["bounces"]), "-af", str(Path(folder) / "ambient")]
            start = time.perf_counter()
            radiance.trace(octree, origin, coarse, [*DIRECT, *AMBIENT, *cache])
            full = radiance.trace(octree, origin, directions, [*DIRECT, *AMBIENT, *cache])
            seconds = time.perf_counter() - start
        paths = [args.out / f"radiance_{setting['bounces']}_{name}.exr" for name in ("full", "indirect")]
        for path, image in zip(paths, (full, full - direct), strict=True):
            image_files.write(path, image.reshape(height, width, 3))
        peer.report("Radiance rtrace", radiance.version(), args, scene, setting, seconds, *paths)


if __name__ == "__main__":
    main()
