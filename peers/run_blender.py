"""The peers `eevee` and `cycles`: Blender's renderers. The first argument names one; peer.py states the others and results.

EEVEE has a baked volume of light probes that reaches half its size past the scene's box on every side: one that ends at the
walls gives them no light. The probes are as many in the scene's box along each axis as the setting says. `seconds` is the
time to bake and to render; that of Cycles is the time to render. Both are the second of two runs, so that all is ready.
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
