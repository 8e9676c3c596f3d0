"""The peer `three`: three.js, its LightProbeGrid on WebGPU. peer.py states arguments and results.

three.js runs in Deno, whose WebGPU is wgpu on the system's Vulkan driver. The grid's box is that of the scene. `seconds` is
the time to bake the grid and to render the image, until the device is done, with all pipelines ready: the least of
up to five runs after a first one.
"""

import shutil
from pathlib import Path

import image_files
import numpy as np
import peer
import stated
from gltf import Unsupported

HOME = Path(__file__).parent.parent / "target/peers/three"


def main():
    args, settings = peer.arguments("three")
    deno = next(HOME.glob("node_modules/@deno/*/deno"), None)
    if deno is None or not (HOME / "node_modules/three").is_dir():
        peer.absent("three.js is not installed; `make peers` installs it where npm is present")
    try:
        scene = peer.load(args)
    except Unsupported as why:
        peer.absent(str(why))
    # Packages are found from the folder of the script.
    script = HOME / "run_three.mjs"
    shutil.copyfile(Path(__file__).parent / "three/run_three.mjs", script)
    command = [deno, "run", "--allow-all", "--unstable-webgpu", script]
    folder, results = stated.render(command, "three", scene, args, settings)
    for result in results:
        full, direct = (raw(folder / result[name], args.size) for name in ("full", "direct"))
        paths = [args.out / f"three_{result['index']}_{name}.exr" for name in ("full", "indirect")]
        for path, image in zip(paths, (full, full - direct), strict=True):
            image_files.write(path, image)
        setting = settings[result["index"]]
        peer.report("three.js LightProbeGrid", result["version"], args, scene, setting, result["seconds"], *paths)


def raw(path, size):
    """An image of f32 RGBA, row 0 on top."""
    width, height = size
    return np.fromfile(path, np.float32).reshape(height, width, 4)[..., :3].astype(float)


if __name__ == "__main__":
    main()
