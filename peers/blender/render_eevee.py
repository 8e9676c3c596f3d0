"""render_eevee.py JOB.json FOLDER: renders the job that stated.py writes, and prints a line of JSON for each setting.

Runs in Blender's module. Mesa's software OpenGL says 4.5 and does what Blender asks of 4.6; the environment says so to it
before the module is loaded. Y is up in the job, Z in Blender.
"""

import base64
import json
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("MESA_GL_VERSION_OVERRIDE", "4.6")
os.environ.setdefault("MESA_GLSL_VERSION_OVERRIDE", "460")

import bpy  # noqa: E402
import numpy as np  # noqa: E402
from mathutils import Matrix, Vector  # noqa: E402

# The volume's size by that of the scene's box.
REACH = 2.0

# Probes behind the walls see nothing, which Blender takes for darkness: at its own threshold of a half they darken the walls.
DILATION_THRESHOLD = 0.9
DILATION_RADIUS = 2.0


def main():
    job = json.loads(Path(sys.argv[1]).read_text())
    folder = Path(sys.argv[2])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    low, high = build(job)
    look(job)
    emits = any(max(m["emission"]) > 0 for m in job["materials"])
    direct = folder / "direct.exr"
    if not emits:
        draw(direct)
    for index, setting in enumerate(job["settings"]):
        probe = volume(low, high, setting["grid"], setting["samples"])
        for _ in range(2):
            start = time.perf_counter()
            bake()
            full = folder / f"{index}_full.exr"
            draw(full)
            seconds = time.perf_counter() - start
        if emits:
            # Light that the probes bring is direct where nothing has reflected it.
            surfaces("emission")
            bake()
            surfaces("whole")
            direct = folder / f"{index}_direct.exr"
            draw(direct)
        line = {"index": index, "seconds": seconds, "full": str(full), "direct": str(direct)}
        print(json.dumps(line | {"version": bpy.app.version_string}), flush=True)
        bpy.data.objects.remove(probe)


def build(job):
    """The scene's objects and lights; its bounds."""
    materials = [material(m, k) for k, m in enumerate(job["materials"])]
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for m in job["meshes"]:
        positions = turned(array(m["positions"], np.float32).reshape(-1, 3))
        faces = array(m["faces"], np.uint32).reshape(-1, 3)
        low, high = np.minimum(low, positions.min(0)), np.maximum(high, positions.max(0))
        mesh = bpy.data.meshes.new("mesh")
        mesh.from_pydata(positions.tolist(), [], faces.tolist())
        mesh.materials.append(materials[m["material"]])
        if m["uv"] is not None:
            uv = array(m["uv"], np.float32).reshape(-1, 2)
            layer = mesh.uv_layers.new()
            # The job's v points down.
            layer.data.foreach_set("uv", np.column_stack([uv[:, 0], 1 - uv[:, 1]])[faces.ravel()].ravel())
        mesh.update()
        if m["normals"] is not None:
            mesh.shade_smooth()
            mesh.normals_split_custom_set_from_vertices(turned(array(m["normals"], np.float32).reshape(-1, 3)).tolist())
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("mesh", mesh))
    for item in job["lights"]:
        light(item)
    return low, high


def material(m, k):
    made = bpy.data.materials.new(f"material {k}")
    made.use_nodes = True
    made.use_backface_culling = made.use_backface_culling_lightprobe_volume = not m["double_sided"]
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    out = nodes.new("ShaderNodeOutputMaterial")
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*m["albedo"], 1)
    if m["picture"] is not None:
        texture = nodes.new("ShaderNodeTexImage")
        texture.image = picture(m["picture"], m["albedo"], k)
        links.new(texture.outputs["Color"], diffuse.inputs["Color"])
    add = nodes.new("ShaderNodeAddShader")
    emission = nodes.new("ShaderNodeEmission")
    strength = max(m["emission"])
    emission.inputs["Color"].default_value = (*(e / max(strength, 1e-20) for e in m["emission"]), 1)
    emission.inputs["Strength"].default_value = strength
    links.new(diffuse.outputs[0], add.inputs[0])
    links.new(emission.outputs[0], add.inputs[1])
    whole = add if strength > 0 else diffuse
    emission.name, whole.name = "emission", "whole"
    links.new(whole.outputs[0], out.inputs["Surface"])
    return made


def surfaces(name):
    """Every material shows what the node of this name makes."""
    for made in bpy.data.materials:
        nodes, links = made.node_tree.nodes, made.node_tree.links
        out = next(n for n in nodes if n.type == "OUTPUT_MATERIAL")
        links.new(nodes[name].outputs[0], out.inputs["Surface"])


def picture(p, albedo, k):
    texels = array(p["texels"], np.float16).astype(np.float32).reshape(p["height"], p["width"], 4)
    texels[..., :3] *= albedo
    image = bpy.data.images.new(f"picture {k}", p["width"], p["height"], float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.ascontiguousarray(texels[::-1]).ravel())
    image.update()
    return image


def light(item):
    strength = max(*item["intensity"], 1e-20)
    made = bpy.data.lights.new("light", item["kind"].upper())
    # The flux of a lamp that shines all around as this one does ahead.
    made.energy = 4 * np.pi * strength
    made.color = [x / strength for x in item["intensity"]]
    made.shadow_soft_size = 0
    if item["kind"] == "spot":
        made.spot_size = 2 * item["outer"]
        made.spot_blend = 1 - item["inner"] / item["outer"]
    thing = bpy.data.objects.new("light", made)
    thing.location = turned(item["position"])
    thing.rotation_mode = "QUATERNION"
    thing.rotation_quaternion = Vector(turned(item["direction"])).to_track_quat("-Z", "Y")
    bpy.context.scene.collection.objects.link(thing)


def look(job):
    """The camera and the settings of the image: one sample through each pixel's centre, as linear light."""
    scene = bpy.context.scene
    view = job["camera"]
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle = view["yfov"]
    camera.clip_start, camera.clip_end = 1e-2, 1e3
    thing = bpy.data.objects.new("camera", camera)
    back = [-x for x in view["forward"]]
    axes = Matrix([turned(view["right"]), turned(view["up"]), turned(back)]).transposed().to_4x4()
    axes.translation = Vector(turned(view["position"]))
    thing.matrix_world = axes
    scene.collection.objects.link(thing)
    scene.camera = thing
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    scene.world = world
    scene.render.engine = "BLENDER_EEVEE"
    scene.render.resolution_x, scene.render.resolution_y = job["size"]
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.view_settings.view_transform = "Raw"
    scene.render.filter_size = 0.01
    eevee = scene.eevee
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


def draw(path):
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def array(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


def turned(v):
    """From Y up to Z up."""
    v = np.asarray(v, float)
    return np.stack([v[..., 0], -v[..., 2], v[..., 1]], -1)


if __name__ == "__main__":
    main()
