"""Scenes built by script, alike in 3.4 and 5.x."""

import math

import bpy
from mathutils import Matrix


def matte(name, color, emission=None):
    """A Lambert material, or one that only shines."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    if emission is None:
        node = nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = (*color, 1)
    else:
        node = nodes.new("ShaderNodeEmission")
        node.inputs["Color"].default_value = (*color, 1)
        node.inputs["Strength"].default_value = emission
    links.new(node.outputs[0], output.inputs["Surface"])
    return material


def textured(name, image):
    """A Lambert material of an image."""
    material = matte(name, (1, 1, 1))
    nodes, links = material.node_tree.nodes, material.node_tree.links
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    texture.interpolation = "Closest"
    diffuse = next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfDiffuse")
    links.new(texture.outputs["Color"], diffuse.inputs["Color"])
    return material


def put(obj, material=None, location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1)):
    obj.location, obj.rotation_euler, obj.scale = location, rotation, scale
    if material is not None:
        obj.data.materials.append(material)
    return obj


def added(kind, material=None, **place):
    """A primitive of Blender's."""
    make = {
        "plane": lambda: bpy.ops.mesh.primitive_plane_add(size=2),
        "cube": lambda: bpy.ops.mesh.primitive_cube_add(size=2),
        "ball": lambda: bpy.ops.mesh.primitive_uv_sphere_add(radius=1, segments=48, ring_count=24),
        "monkey": lambda: bpy.ops.mesh.primitive_monkey_add(),
        "torus": lambda: bpy.ops.mesh.primitive_torus_add(),
    }[kind]
    make()
    return put(bpy.context.object, material, **place)


def light(kind, energy, location=(0, 0, 0), rotation=(0, 0, 0), color=(1, 1, 1), **more):
    data = bpy.data.lights.new(kind.lower(), kind)
    data.energy, data.color = energy, color
    if kind in ("POINT", "SPOT"):
        data.shadow_soft_size = 0
    if kind == "SUN":
        data.angle = 0
    for key, value in more.items():
        setattr(data, key, value)
    obj = bpy.data.objects.new(kind.lower(), data)
    obj.location, obj.rotation_euler = location, rotation
    # What has an extent is drawn, and is seen.
    obj.visible_camera = kind == "AREA" or more.get("shadow_soft_size", 0) > 0
    bpy.context.collection.objects.link(obj)
    return obj


def camera(location, rotation, **more):
    data = bpy.data.cameras.new("camera")
    for key, value in more.items():
        setattr(data, key, value)
    obj = bpy.data.objects.new("camera", data)
    obj.location, obj.rotation_euler = location, rotation
    bpy.context.collection.objects.link(obj)
    bpy.context.scene.camera = obj
    return obj


def world(color, strength=1.0):
    made = bpy.data.worlds.new("world")
    made.use_nodes = True
    background = next(n for n in made.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (*color, 1)
    background.inputs["Strength"].default_value = strength
    bpy.context.scene.world = made
    return made


def room():
    """Two walls and a floor, a ball, a cube turned askew."""
    grey, red, blue = matte("grey", (0.7, 0.7, 0.7)), matte("red", (0.7, 0.1, 0.1)), matte("blue", (0.1, 0.2, 0.7))
    added("plane", grey, scale=(4, 4, 1))
    added("plane", grey, location=(0, 4, 3), rotation=(math.pi / 2, 0, 0), scale=(4, 3, 1))
    added("plane", red, location=(-4, 0, 3), rotation=(0, math.pi / 2, 0), scale=(3, 4, 1))
    ball = added("ball", blue, location=(1.2, 0.5, 1))
    for polygon in ball.data.polygons:
        polygon.use_smooth = True
    added("cube", grey, location=(-1.5, 0.8, 0.8), rotation=(0, 0, 0.6), scale=(0.8, 0.8, 0.8))


def point():
    """A point light; the lens is shifted."""
    room()
    light("POINT", 500, (0.5, -1.5, 4.5), color=(1, 0.8, 0.6))
    camera((0, -9, 3), (math.radians(85), 0, 0), lens=40, shift_x=0.1, shift_y=-0.07)


def spot_and_sun():
    """A spot with a hard rim and a sun; a bevel, an array, a mirrored object; the camera is taller than wide."""
    room()
    light("SPOT", 800, (2, -2, 5), (math.radians(30), 0, math.radians(35)), spot_size=math.radians(70), spot_blend=0)
    light("SUN", 0.8, rotation=(math.radians(50), math.radians(-20), 0), color=(0.6, 0.8, 1))
    green = matte("green", (0.2, 0.6, 0.2))
    monkey = added("monkey", green, location=(0, -1.2, 0.6), scale=(-0.5, 0.5, 0.5))
    monkey.modifiers.new("fine", "SUBSURF").render_levels = 1
    small = added("cube", green, location=(-3, -2, 0.25), scale=(0.25, 0.25, 0.25))
    small.modifiers.new("row", "ARRAY").count = 5
    small.modifiers.new("soft", "BEVEL").segments = 2
    camera((3, -9, 4), (math.radians(72), 0, math.radians(17)), lens=30, sensor_fit="VERTICAL")
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 96, 128


def area():
    """Area lights of two shapes, scaled; an emissive plane that is seen from both sides."""
    room()
    light("AREA", 120, (0, 0, 5.5), size=1.5)
    light("AREA", 60, (3.6, -1, 2), (0, math.radians(90), 0), (0.5, 0.7, 1), shape="ELLIPSE", size=1, size_y=2)
    glow = matte("glow", (1, 0.5, 0.2), 6)
    added("plane", glow, location=(-0.2, -2, 1.2), rotation=(math.radians(70), 0, 0.3), scale=(0.4, 0.4, 1))
    camera((0, -9, 3), (math.radians(85), 0, 0), lens=40)


def soft():
    """Points with a radius: soft shadows. One moves with an object that is scaled and mirrored."""
    room()
    ball = light("POINT", 700, (1, -2, 7.5), color=(1, 0.9, 0.7), shadow_soft_size=0.6)
    small = light("POINT", 200, shadow_soft_size=0.15)
    small.parent = put(bpy.data.objects.new("holder", None), location=(-3, -7, 4), scale=(-3, 1, 1))
    bpy.context.collection.objects.link(small.parent)
    for one in (ball, small):
        if hasattr(one.data, "use_soft_falloff"):
            # Balls, in place of discs that face what they shine on.
            one.data.use_soft_falloff = False
    camera((0, -9, 3), (math.radians(80), 0, 0), lens=40)


def instances():
    """Faces that carry instances, a collection at empties, a text; two materials in one mesh; the light of a sky."""
    room()
    yellow, green = matte("yellow", (0.8, 0.7, 0.1)), matte("green", (0.2, 0.6, 0.2))
    small = added("cube", yellow, scale=(0.1, 0.1, 0.1))
    ring = added("torus", green, location=(1.2, 0.5, 2.4), scale=(0.7, 0.7, 0.7))
    ring.data.materials.append(yellow)
    for polygon in ring.data.polygons[: len(ring.data.polygons) // 2]:
        polygon.material_index = 1
    grid = added("plane", location=(-2, -2, 0.2))
    grid.modifiers.new("fine", "SUBSURF").subdivision_type = "SIMPLE"
    grid.modifiers["fine"].render_levels = grid.modifiers["fine"].levels = 2
    grid.instance_type = "FACES"
    grid.show_instancer_for_render = False
    small.parent = grid
    text = bpy.data.curves.new("text", "FONT")
    text.body, text.extrude = "lg", 0.1
    written = bpy.data.objects.new("text", text)
    bpy.context.collection.objects.link(written)
    put(written, green, (2, -2, 0), (math.radians(90), 0, 0), (1.5, 1.5, 1.5))
    collection = bpy.data.collections.new("pair")
    for x in (0, 0.5):
        cone = bpy.data.objects.new("part", small.data)
        cone.location, cone.scale = (x, 0, 0.2), (0.2, 0.2, 0.2)
        collection.objects.link(cone)
    for x in (-1, 1):
        holder = bpy.data.objects.new("holder", None)
        holder.instance_type, holder.instance_collection = "COLLECTION", collection
        holder.location = (x, -3, 0)
        bpy.context.collection.objects.link(holder)
    world((0.5, 0.7, 1.0), 0.5)
    light("SUN", 2, rotation=(math.radians(40), math.radians(10), 0))
    camera((0, -9, 3), (math.radians(85), 0, 0), lens=40)


def textures():
    """An image on a floor and on a ball, by texture coordinates; a flat camera."""
    import numpy as np

    size = 64
    image = bpy.data.images.new("checks", size, size)
    y, x = np.mgrid[0:size, 0:size]
    pixels = np.ones((size, size, 4), np.float32)
    pixels[:, :, 0], pixels[:, :, 1] = (x // 8 % 2) * 0.6 + 0.2, y / size
    pixels[:, :, 2] = (y // 16 % 2) * 0.5 + 0.2
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    checks = textured("checks", image)
    room()
    added("plane", checks, location=(0, -1.5, 0.02), rotation=(0, 0, 0.3), scale=(2, 1.5, 1))
    added("ball", checks, location=(-1, -1.5, 0.9), rotation=(0.4, 0.2, 0.1), scale=(0.9, 0.9, 0.9))
    light("POINT", 600, (2, -3, 5))
    camera((0, -9, 4), (math.radians(75), 0, 0), type="ORTHO", ortho_scale=9)


def bumps():
    """A normal map on a floor that is turned, under a plain ball."""
    import numpy as np

    size = 64
    image = bpy.data.images.new("bumps", size, size, float_buffer=True, is_data=True)
    y, x = np.mgrid[0:size, 0:size] / size * 2 * np.pi
    normals = np.stack([0.5 * np.sin(2 * x), 0.4 * np.cos(3 * y), np.ones_like(x)], axis=2)
    pixels = np.ones((size, size, 4), np.float32)
    pixels[:, :, :3] = normals / np.linalg.norm(normals, axis=2, keepdims=True) / 2 + 0.5
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    material = matte("bumps", (0.6, 0.6, 0.6))
    nodes, links = material.node_tree.nodes, material.node_tree.links
    texture, bent = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeNormalMap")
    texture.image = image
    links.new(texture.outputs["Color"], bent.inputs["Color"])
    diffuse = next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfDiffuse")
    links.new(bent.outputs["Normal"], diffuse.inputs["Normal"])
    # Cycles bends the normals of an object less where it is stretched; glTF doesn't.
    added("plane", material, rotation=(0, 0, 0.4)).data.transform(Matrix.Diagonal((4, 4, 1, 1)))
    ball = added("ball", matte("grey", (0.7, 0.7, 0.7)), location=(0.5, -1, 1.2), scale=(1.2, 1.2, 1.2))
    for polygon in ball.data.polygons:
        polygon.use_smooth = True
    light("POINT", 900, (3, -3, 5))
    camera((0, -8, 4), (math.radians(70), 0, 0), lens=40)


def panorama():
    """Light of an image from all around, turned, no two sides alike; it is seen, too."""
    import numpy as np

    high = 32
    y, x = np.mgrid[0:high, 0 : 2 * high]
    turn, up = (x + 0.5) / (2 * high) * 2 * np.pi, (y + 0.5) / high
    pixels = np.ones((high, 2 * high, 4), np.float32)
    pixels[:, :, 0] = 0.6 + 0.5 * np.sin(turn)
    pixels[:, :, 1] = 0.6 + 0.5 * np.cos(turn)
    pixels[:, :, 2] = 0.2 + up
    image = bpy.data.images.new("sky", 2 * high, high, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.pack()
    room()
    tree = world((1, 1, 1), 0.8).node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    mapping.inputs["Rotation"].default_value[2] = 0.7
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    background = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground")
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    camera((0, -9, 3), (math.radians(85), 0, 0), lens=24)


ALL = [point, spot_and_sun, area, soft, instances, textures, panorama]

# Cycles corrects normals that are bent away from the viewer, so that paths go on otherwise.
DIRECT = [*ALL, bumps]
