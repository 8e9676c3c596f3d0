"""Blender's renderers as peers, `eevee` and `cycles`. The first argument names one; peer.py states the other arguments
and the results.

EEVEE bakes a volume of light probes. A volume that ends at the walls gives them no light, so it reaches half its size
past the scene's box on every side. The setting is the number of probes along each axis of that box. `seconds` is the
time to bake and render, of Cycles to render. The second of two runs is timed, when shaders and scene are ready.
"""

import sys
from pathlib import Path

import image_files
import peer
import stated
from gltf import Unsupported

PYTHON = Path(__file__).parent.parent / "target/peers/blender/bin/python"
NAMES = {"eevee": "Blender EEVEE", "cycles": "Blender Cycles"}


def main():
    engine = sys.argv.pop(1)
    args, settings = peer.arguments(engine)
    if not any(PYTHON.parent.parent.glob("lib/python*/site-packages/bpy")):
        peer.absent("Blender's module is not installed; `make peers` installs it where Python is 3.11")
    try:
        scene = peer.load(args)
    except Unsupported as why:
        peer.absent(str(why))
    script = Path(__file__).parent / f"blender/render_{engine}.py"
    _, results = stated.render([PYTHON, script], engine, scene, args, settings, outdoors=engine == "cycles")
    for result in results:
        full, direct = (image_files.read(result[name]) for name in ("full", "direct"))
        paths = [args.out / f"{engine}_{result['index']}_{name}.exr" for name in ("full", "indirect")]
        for path, image in zip(paths, (full, full - direct), strict=True):
            image_files.write(path, image)
        setting = settings[result["index"]]
        peer.report(NAMES[engine], result["version"], args, scene, setting, result["seconds"], *paths)


if __name__ == "__main__":
    main()
