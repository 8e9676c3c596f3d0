"""render_eevee.py JOB.json FOLDER: renders the job that stated.py writes, and prints a line of JSON for each setting.

Runs in Blender's module. Mesa's software OpenGL says 4.5 and does what Blender asks of 4.6; the environment says so to it
before the module is loaded.
"""

import json
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("MESA_GL_VERSION_OVERRIDE", "4.6")
os.environ.setdefault("MESA_GLSL_VERSION_OVERRIDE", "460")

import bpy  # noqa: E402
import blender_scene as scene  # noqa: E402

# The volume's size by that of the scene's box.
REACH = 2.0

# Probes behind the walls see nothing, which Blender takes for darkness: at its own threshold of a half they darken the walls.
DILATION_THRESHOLD = 0.9
DILATION_RADIUS = 2.0


def main():
    job = json.loads(Path(sys.argv[1]).read_text())
    folder = Path(sys.argv[2])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    low, high = scene.build(job)
    scene.look(job)
    settings()
    emits = any(max(m["emission"]) > 0 for m in job["materials"])
    direct = folder / "direct.exr"
    if not emits:
        scene.draw(direct)
    for index, setting in enumerate(job["settings"]):
        probe = volume(low, high, setting["grid"], setting["samples"])
        for _ in range(2):
            start = time.perf_counter()
            bake()
            full = folder / f"{index}_full.exr"
            scene.draw(full)
            seconds = time.perf_counter() - start
        if emits:
            # Light that the probes bring is direct where nothing has reflected it.
            surfaces("emission")
            bake()
            surfaces("whole")
            direct = folder / f"{index}_direct.exr"
            scene.draw(direct)
        line = {"index": index, "seconds": seconds, "full": str(full), "direct": str(direct)}
        print(json.dumps(line | {"version": bpy.app.version_string}), flush=True)
        bpy.data.objects.remove(probe)


def surfaces(name):
    """Every material shows what the node of this name makes."""
    for made in bpy.data.materials:
        nodes, links = made.node_tree.nodes, made.node_tree.links
        out = next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
        links.new(nodes[name].outputs[0], out.inputs["Surface"])


def settings():
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    eevee = bpy.context.scene.eevee
    eevee.taa_render_samples = 1
    eevee.light_threshold = 1e-6
    eevee.clamp_surface_indirect = 0
    eevee.gi_diffuse_bounces = 3
    eevee.use_raytracing = False


def bake():
    bpy.ops.object.lightprobe_cache_bake(subset="ALL")


def volume(low, high, probes, samples):
    made = bpy.data.lightprobes.new("volume", "VOLUME")
    made.resolution_x = made.resolution_y = made.resolution_z = round(probes * REACH)
    made.bake_samples = samples
    made.clamp_indirect = 0
    made.capture_emission = True
    made.dilation_threshold, made.dilation_radius = DILATION_THRESHOLD, DILATION_RADIUS
    thing = bpy.data.objects.new("volume", made)
    thing.location = (low + high) / 2
    thing.scale = (high - low) / 2 * REACH
    bpy.context.scene.collection.objects.link(thing)
    return thing


if __name__ == "__main__":
    main()
