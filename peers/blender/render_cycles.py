"""render_cycles.py JOB.json FOLDER: renders the job that stated.py writes, and prints a line of JSON for each setting.

Runs in Blender's module, on the CPU. Direct light and all light are rendered with the same random numbers: their
difference has the noise of the bounces alone.
"""

import json
import sys
import time
from pathlib import Path

import blender_scene as scene
import bpy

# Longer than any path that brings light worth mentioning: Cycles' own limits lose light in bright rooms.
BOUNCES = 64


def main():
    job = json.loads(Path(sys.argv[1]).read_text())
    folder = Path(sys.argv[2])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene.build(job)
    scene.look(job)
    for k, m in enumerate(job["materials"]):
        if not m["double_sided"]:
            blacken_back(bpy.data.materials[f"material {k}"])
    settings()
    for index, setting in enumerate(job["settings"]):
        full, direct = (folder / f"{index}_{name}.exr" for name in ("full", "direct"))
        for _ in range(2):
            start = time.perf_counter()
            render(full, setting["samples"], BOUNCES)
            seconds = time.perf_counter() - start
        render(direct, setting["samples"], 0)
        line = {"index": index, "seconds": seconds, "full": str(full), "direct": str(direct)}
        print(json.dumps(line | {"version": bpy.app.version_string}), flush=True)


def render(path, samples, bounces):
    cycles = bpy.context.scene.cycles
    cycles.samples = samples
    cycles.max_bounces = cycles.diffuse_bounces = bounces
    scene.draw(path)


def settings():
    bpy.context.scene.render.engine = "CYCLES"
    # Scene and hierarchy are ready when the time begins.
    bpy.context.scene.render.use_persistent_data = True
    cycles = bpy.context.scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type, cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = 0


def blacken_back(made):
    """The back of a material neither shines nor reflects."""
    nodes, links = made.node_tree.nodes, made.node_tree.links
    out = next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
    side = nodes.new("ShaderNodeNewGeometry")
    black = nodes.new("ShaderNodeBsdfDiffuse")
    black.inputs["Color"].default_value = (0, 0, 0, 1)
    mix = nodes.new("ShaderNodeMixShader")
    links.new(side.outputs["Backfacing"], mix.inputs["Fac"])
    links.new(nodes["whole"].outputs[0], mix.inputs[1])
    links.new(black.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], out.inputs["Surface"])
    made.cycles.emission_sampling = "FRONT"


if __name__ == "__main__":
    main()
