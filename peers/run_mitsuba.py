"""The peer `mitsuba`: path tracing with more and more samples. peer.py states arguments and results.

`seconds` is the time of the image of all light, paths of any length, with scene and kernels ready. The first
bounce is subtracted afterwards, untimed: along the same paths, so that `indirect` has the noise of the bounces alone.
"""

import time
from importlib.metadata import version

import image_files
import mitsuba_light as light
import peer
from gltf import Unsupported

SEED = 12_345


def main():
    args, settings = peer.arguments("mitsuba")
    try:
        scene = peer.load(args)
        tracer = light.Tracer(scene, scene.camera, *args.size)
    except Unsupported as why:
        peer.absent(str(why))
    # Compiles the kernels.
    tracer.radiance(light.ALL, 1, SEED)
    for k, setting in enumerate(settings):
        start = time.perf_counter()
        full = tracer.radiance(light.ALL, setting["samples"], SEED + (k << 20))
        seconds = time.perf_counter() - start
        direct = tracer.radiance(2, setting["samples"], SEED + (k << 20))
        stem = f"mitsuba_{setting['samples']}"
        paths = [args.out / f"{stem}_{name}.exr" for name in ("full", "indirect")]
        for path, image in zip(paths, (full, full - direct), strict=True):
            image_files.write(path, image.reshape(tracer.shape))
        peer.report("Mitsuba path", version("mitsuba"), args, scene, setting, seconds, *paths)


if __name__ == "__main__":
    main()
