"""A job of stated.py as a scene of Blender. Y is up in the job, Z in Blender."""

import base64

import bpy
import numpy as np
from mathutils import Matrix, Vector


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


def picture(p, albedo, k):
    texels = array(p["texels"], np.float16).astype(np.float32).reshape(p["height"], p["width"], 4)
    texels[..., :3] *= albedo
    image = bpy.data.images.new(f"picture {k}", p["width"], p["height"], float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.ascontiguousarray(texels[::-1]).ravel())
    image.update()
    return image


def light(item):
    strength = max(*item["intensity"], 1e-20)
    is_sun = item["kind"] == "directional"
    made = bpy.data.lights.new("light", "SUN" if is_sun else item["kind"].upper())
    # Of a sun the irradiance; else the flux of a lamp that shines all around as this one does ahead.
    made.energy = strength if is_sun else 4 * np.pi * strength
    made.color = [x / strength for x in item["intensity"]]
    if is_sun:
        made.angle = 0
    else:
        made.shadow_soft_size = 0
    if item["kind"] == "spot":
        made.spot_size = 2 * item["outer"]
        # Blender's rim is a smooth step of the cosine, glTF's a square: this one takes as much from the light.
        edge = np.cos(item["outer"])
        made.spot_blend = min(4 / 3 * (np.cos(item["inner"]) - edge) / (1 - edge), 1)
    thing = bpy.data.objects.new("light", made)
    thing.location = turned(item["position"])
    thing.rotation_mode = "QUATERNION"
    thing.rotation_quaternion = Vector(turned(item["direction"])).to_track_quat("-Z", "Y")
    bpy.context.scene.collection.objects.link(thing)


def look(job):
    """The camera, the world and the settings of the image: samples through each pixel's centre, as linear light."""
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
    background = world.node_tree.nodes["Background"]
    background.inputs["Strength"].default_value = 0
    if job["panorama"] is not None:
        surround(world.node_tree, background, job["panorama"])
    scene.world = world
    scene.render.resolution_x, scene.render.resolution_y = job["size"]
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.view_settings.view_transform = "Raw"
    scene.render.filter_size = 0.01


def surround(tree, background, file):
    """Light from a panorama, whose middle is seen towards +Y here, and towards +X by Blender itself."""
    places = tree.nodes.new("ShaderNodeTexCoord")
    turn = tree.nodes.new("ShaderNodeMapping")
    turn.inputs["Rotation"].default_value = (0, 0, -np.pi / 2)
    texels = tree.nodes.new("ShaderNodeTexEnvironment")
    texels.image = bpy.data.images.load(file)
    tree.links.new(places.outputs["Generated"], turn.inputs["Vector"])
    tree.links.new(turn.outputs["Vector"], texels.inputs["Vector"])
    tree.links.new(texels.outputs["Color"], background.inputs["Color"])
    background.inputs["Strength"].default_value = 1


def draw(path):
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def array(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


def turned(v):
    """From Y up to Z up."""
    v = np.asarray(v, float)
    return np.stack([v[..., 0], -v[..., 2], v[..., 1]], -1)
