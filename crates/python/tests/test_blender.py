"""The parts of the Blender add-on that need no Blender: units, materials, meshes, what is drawn by its thread."""

import importlib
import math
import sys
import threading
import types
from types import SimpleNamespace as Thing

import numpy as np
import pytest

import lightgraph as lg
from conftest import ROOT


def part(name):
    """A module of the add-on, without its `__init__`, which is Blender's."""
    package = sys.modules.setdefault("lightgraph_addon", types.ModuleType("lightgraph_addon"))
    package.__path__ = [str(ROOT / "editors/blender")]
    return importlib.import_module(f"lightgraph_addon.{name}")


units, meshes, materials = part("units"), part("meshes"), part("materials")
content, live, textures = part("content"), part("live"), part("textures")


class Collection(list):
    """What `foreach_get` is asked of."""

    def foreach_get(self, name, out):
        out[:] = np.array([getattr(one, name) for one in self]).ravel()


def quad(normals="FACE", slots=(0, 0), uvs=None):
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    rows = ((0, 1, 2), (0, 2, 3))
    return Thing(
        calc_loop_triangles=lambda: None,
        vertices=Collection(Thing(co=c) for c in corners),
        loops=Collection(Thing(vertex_index=i) for i in range(4)),
        loop_triangles=Collection(Thing(vertices=r, loops=r, material_index=s) for r, s in zip(rows, slots)),
        normals_domain=normals,
        vertex_normals=Collection(Thing(vector=(0, 0, 1)) for _ in corners),
        corner_normals=Collection(Thing(vector=(0, 0, 1)) for _ in corners),
        uv_layers=None if uvs is None else UVs(uvs),
    )


class UVs(list):
    def __init__(self, uvs):
        super().__init__([1])
        self.active = Thing(data=Collection(Thing(uv=uv) for uv in uvs))


def test_a_point_light_s_flux_goes_to_all_sides():
    assert units.intensity(4 * math.pi) == pytest.approx(1)
    # Of a face: π times radiance and area.
    assert units.radiance(units.math.pi * 6, 2) == pytest.approx(3)
    assert units.radiance(1, 0) == 0 and units.radiance(8, 2, (3, 4, 1)) == 1
    assert units.strength(10, -1) == 5


def test_blender_s_up_is_lightgraph_s():
    up = units.node(np.identity(4)) @ np.array([0, 0, 1, 1])
    np.testing.assert_array_equal(up[:3], [0, 1, 0])
    assert np.linalg.det(units.AXES) == 1


@pytest.mark.parametrize("shift", [(0, 0), (0.1, -0.2)])
def test_a_camera_s_numbers_come_back_from_its_matrix(shift):
    near, far, half, aspect = 0.1, 100.0, 0.5, 1.5
    p = np.zeros((4, 4))
    p[0, 0], p[1, 1] = 1 / (half * aspect), 1 / half
    # The centre of an image of height 1 at a distance of 1.
    p[0, 2], p[1, 2] = shift[0] / (half * aspect), shift[1] / half
    p[2, 2], p[2, 3], p[3, 2] = -(far + near) / (far - near), -2 * far * near / (far - near), -1
    seen = units.camera(np.identity(4), p)
    assert seen["fov"] == pytest.approx(2 * math.degrees(math.atan(half)))
    assert (seen["near"], seen["far"]) == pytest.approx((near, far))
    np.testing.assert_allclose(seen["shift"], np.array(shift) / (2 * half), atol=1e-12)
    np.testing.assert_allclose(np.subtract(seen["target"], seen["eye"]), (0, -1, 0), atol=1e-12)


def test_a_flat_view_that_begins_behind_the_eye_begins_farther_back():
    p = np.diag([0.5, 1.0, -2 / 20.0, 1.0])
    seen = units.camera(np.identity(4), p)
    assert seen["height"] == 2 and 0 < seen["near"] < seen["far"]
    # z from −10 to 10: the eye now stands above 10.
    assert seen["eye"][1] - seen["near"] == pytest.approx(10) and seen["far"] - seen["near"] == pytest.approx(20)


def test_a_spot_s_soft_rim_takes_as_much_light():
    outer, inner = units.spot_angles(math.radians(80), 0.5)
    assert outer == pytest.approx(80) and 0 < inner < 80
    # As narrow as glTF's rim can be.
    assert units.spot_angles(1.0, 0.0) == pytest.approx((math.degrees(1.0), math.degrees(1.0)), abs=0.2)
    cosines = np.linspace(math.cos(math.radians(40)), 1, 200_001)
    t = np.clip((cosines - cosines[0]) / ((1 - cosines[0]) * 0.5), 0, 1)
    blender = (3 * t**2 - 2 * t**3).mean()
    gltf = np.clip((cosines - cosines[0]) / (math.cos(math.radians(inner / 2)) - cosines[0]), 0, 1) ** 2
    assert gltf.mean() == pytest.approx(blender, rel=1e-3)


def test_flat_and_smooth_meshes_keep_their_vertices():
    (flat,) = meshes.parts(quad("FACE"), textured=False)
    assert flat.normals is None and flat.positions.shape == (4, 3) and flat.indices.tolist() == [[0, 1, 2], [0, 2, 3]]
    (smooth,) = meshes.parts(quad("POINT"), textured=False)
    assert smooth.normals.shape == (4, 3)
    assert meshes.parts(Thing(calc_loop_triangles=lambda: None, loop_triangles=[]), False) == []


def test_texture_coordinates_begin_at_the_top():
    (found,) = meshes.parts(quad(uvs=[(0, 0), (1, 0), (1, 1), (0, 1)]), textured=True)
    assert found.uvs.tolist() == [[0, 1], [1, 1], [1, 0], [0, 0]]


def test_a_panorama_turns_round(monkeypatch):
    monkeypatch.setattr(textures, "FINE", 1)
    picture = np.arange(8, dtype=np.float32).reshape(1, 8, 1)
    assert textures.turned(picture, 0.25).ravel().tolist() == [6, 7, 0, 1, 2, 3, 4, 5]
    assert textures.turned(picture, 1.0).ravel().tolist() == picture.ravel().tolist()
    np.testing.assert_allclose(textures.turned(picture, 0.0625).ravel()[1:], np.arange(7) + 0.5)


def test_a_small_panorama_is_finer_and_the_same_between_its_pixels(monkeypatch):
    monkeypatch.setattr(textures, "FINE", 4)
    picture = np.array([[0, 4, 8, 4], [8, 12, 16, 12]], dtype=np.float32)[:, :, None]
    fine = textures.turned(picture, 0.0)[:, :, 0]
    assert fine[0].tolist() == [1, 1, 3, 5, 7, 7, 5, 3], "its two ends are one"
    assert fine[:, 0].tolist() == [1, 3, 7, 9], "its poles are as they were"
    # By an eighth of a turn, half a pixel: whole pixels of the finer one.
    np.testing.assert_array_equal(textures.turned(picture, 0.125)[:, :, 0], np.roll(fine, 1, axis=1))


def test_materials_part_a_mesh():
    one, two = meshes.parts(quad("CORNER", slots=(0, 3)), textured=False)
    assert (one.slot, two.slot) == (0, 3)
    for found in (one, two):
        assert found.indices.tolist() == [[0, 1, 2]] and found.positions.shape == found.normals.shape == (3, 3)
    np.testing.assert_array_equal(two.positions, [(0, 0, 0), (1, 1, 0), (0, 1, 0)])
    assert one.same(meshes.parts(quad("CORNER", slots=(0, 3)), False)[0]) and not one.same(two)


def test_an_open_mesh_shines_from_both_sides():
    (sheet,) = meshes.parts(quad("POINT"), False)
    assert not meshes.is_closed(sheet.indices)
    both = meshes.both_sides(sheet)
    assert meshes.is_closed(np.array([[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]]))
    assert len(both.indices) == 4 and both.normals[4:].tolist() == [[0, 0, -1]] * 4


@pytest.mark.parametrize(
    "shape, area", [("SQUARE", 4), ("RECTANGLE", 6), ("DISK", math.pi), ("ELLIPSE", 1.5 * math.pi)]
)
def test_an_area_light_s_face_is_as_large_as_it_says(shape, area):
    corners, triangles, said = meshes.face(shape, 2, 3)
    a, b, c = (corners[triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a) / 2
    assert (normals[:, 2] < 0).all(), "it shines down"
    assert said == pytest.approx(area) and -normals[:, 2].sum() == pytest.approx(area, rel=1e-5)


def test_the_ball_of_a_light_shines_to_all_sides_alike():
    corners, triangles, area = meshes.ball(0.5)
    assert area == pytest.approx(math.pi)
    a, b, c = (corners.astype(np.float64)[triangles[:, i]] for i in range(3))
    across = np.cross(b - a, c - a) / 2
    assert ((a + b + c) * across).sum(axis=1).min() > 0, "it shines outwards"
    assert np.linalg.norm(across, axis=1).sum() == pytest.approx(area, rel=1e-6)
    to = np.random.default_rng(1).normal(size=(500, 3))
    to /= np.linalg.norm(to, axis=1, keepdims=True)
    # What is seen of a ball from anywhere is a quarter of its area.
    seen = np.maximum(to @ across.T, 0).sum(axis=1)
    np.testing.assert_allclose(seen, area / 4, rtol=3e-3)
    assert seen.std() < 1.1e-3 * area / 4


def socket(name, value, source=None):
    links = [Thing(from_node=source)] if source else []
    return Thing(name=name, identifier=name, default_value=value, is_linked=bool(links), links=links)


def node(kind, **inputs):
    sockets = [s if hasattr(s, "name") else socket(n.replace("_", " "), s) for n, s in inputs.items()]
    return Thing(bl_idname=kind, name=kind, inputs=sockets, outputs=[Thing(default_value=0.25)], image=None)


def material(shader):
    inputs = [socket("Surface", None, shader)]
    output = Thing(bl_idname="ShaderNodeOutputMaterial", is_active_output=True, inputs=inputs)
    return Thing(use_nodes=True, node_tree=Thing(nodes=[output]))


def test_a_principled_surface_is_gltf_s():
    picture = object()
    image = node("ShaderNodeTexImage")
    image.image = picture
    shader = node(
        "ShaderNodeBsdfPrincipled",
        base=socket("Base Color", (0.1, 0.2, 0.3, 1), image),
        Metallic=0.5,
        rough=socket("Roughness", 0.1, node("ShaderNodeValue")),
        emission=socket("Emission Color", (1, 0.5, 0, 1)),
        strength=socket("Emission Strength", 4.0),
        coat=socket("Coat Weight", 1.0),
    )
    found = materials.surface(material(shader))
    assert found.color == (1, 1, 1) and found.color_image is picture
    assert (found.metallic, found.roughness) == (0.5, 0.25)
    assert found.emission == (4, 2, 0) and found.coat == 1 and not found.notices


class Picture(Thing):
    """An image of Blender's, its lowest row first."""

    def __init__(self, pixels, space="sRGB"):
        found = np.array(pixels, dtype=np.float32)
        values = found[::-1].ravel()
        super().__init__(
            name="picture",
            name_full="picture",
            size=(found.shape[1], found.shape[0]),
            channels=found.shape[2],
            is_float=False,
            colorspace_settings=Thing(name=space),
            pixels=Thing(foreach_get=lambda out: out.__setitem__(slice(None), values)),
        )


def test_images_become_textures():
    two = [[[0.5, 0.25, 1.0, 0.5]], [[0.0, 0.0, 0.0, 1.0]]]
    assert textures.color(Picture(two), holes=True)[0, 0].tolist() == [128, 64, 255, 128]
    assert textures.color(Picture(two), holes=False).shape == (2, 1, 3)
    # 0.5 in linear light is 188 in sRGB.
    assert textures.color(Picture(two, "Non-Color"), holes=False)[0, 0, 0] == 188
    assert textures.linear(Picture(two))[0, 0, 0] == pytest.approx(0.2140, abs=1e-4)
    rough, metal = Picture(two, "Non-Color"), Picture([[[0.0, 0.0, 1.0, 1.0]] * 4] * 4, "Non-Color")
    finish = textures.finish(materials.Channel(rough, "G"), materials.Channel(metal, "B"))
    assert finish.shape == (4, 4, 3) and finish[0, 0].tolist() == [255, 64, 255] and finish[3, 0, 1] == 0
    assert textures.finish(None, materials.Channel(rough))[0, 0, 1] == 255
    assert textures.finish(None, None) is None and textures.color(Picture(np.ones((0, 0, 4))), False) is None


def test_maps_of_normals_and_roughness_are_read():
    image, packed = node("ShaderNodeTexImage"), node("ShaderNodeTexImage")
    image.image, packed.image = Thing(name="normals"), Thing(name="packed")
    bumps = node("ShaderNodeNormalMap", Color=socket("Color", None, image), Strength=0.5)
    apart = node("ShaderNodeSeparateColor", Color=socket("Color", None, packed))
    rough = socket("Roughness", 0.1, apart)
    rough.links[0].from_socket = Thing(name="Green")
    shader = node("ShaderNodeBsdfPrincipled", n=socket("Normal", None, bumps), r=rough, Alpha=0.5)
    found = materials.surface(material(shader))
    assert (found.normal_image, found.normal_scale, found.alpha) == (image.image, 0.5, 0.5)
    assert found.roughness == 1 and found.roughness_image == materials.Channel(packed.image, "G")
    assert found.coat_normal_image is None and not found.notices


def test_a_coat_has_normals_of_its_own():
    image = node("ShaderNodeTexImage")
    image.image = Thing(name="normals")
    bumps = node("ShaderNodeNormalMap", Color=socket("Color", None, image), Strength=0.25)
    coat = [socket("Coat Weight", 1.0), socket("Coat Normal", None, bumps)]
    shader = node("ShaderNodeBsdfPrincipled", **{one.name: one for one in coat})
    found = materials.surface(material(shader))
    assert (found.coat_normal_image, found.coat_normal_scale) == (image.image, 0.25)
    assert found.normal_image is None and not found.notices


def test_materials_with_all_that_gltf_knows_make_a_scene():
    picture = np.full((2, 2, 4), 128, np.uint8)
    rich = lg.Material(
        color_texture=picture,
        finish_texture=picture[:, :, :3],
        normal_texture=picture[:, :, :3],
        transmission=0.5,
        ior=1.3,
        coat=0.5,
        coat_normal_texture=picture[:, :, :3],
        coat_normal_scale=0.5,
        alpha=0.9,
    )
    (plain,) = floor()
    uvs = np.array([[0, 0], [0, 1], [1, 1], [1, 0]], np.float32)
    facts = lg.Scene.from_arrays(lg.Mesh(plain.positions, plain.indices, uvs=uvs, material=rich)).facts
    for fact in ("finish_textures", "normal_textures", "clear_materials", "coated_materials", "faced_materials"):
        assert facts[fact] == 1, fact


def test_coordinates_that_are_turned_are_a_notice():
    image = node("ShaderNodeTexImage", Vector=socket("Vector", None, node("ShaderNodeMapping")))
    image.image = object()
    shader = node("ShaderNodeBsdfDiffuse", c=socket("Color", (0, 0, 0, 1), image))
    (notice,) = materials.surface(material(shader)).notices
    assert "coordinates" in notice
    image.inputs[0] = socket("Vector", None, node("ShaderNodeUVMap"))
    assert not materials.surface(material(shader)).notices


def test_reroutes_are_followed_and_rings_end():
    shader = node("ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5, 1))
    reroute = Thing(bl_idname="NodeReroute", inputs=[socket("in", None, shader)])
    assert materials.surface(material(reroute)).color == (0.5, 0.5, 0.5)
    ring = Thing(bl_idname="NodeReroute", inputs=[])
    ring.inputs.append(socket("in", None, ring))
    assert materials.surface(material(ring)).color == (0, 0, 0)


def test_what_cannot_be_said_is_a_notice():
    glass = node("ShaderNodeBsdfGlass", Color=(1, 1, 1, 1))
    assert "none of Principled" in materials.surface(material(glass)).notices[0]
    noise = node("ShaderNodeTexNoise")
    found = materials.surface(material(node("ShaderNodeBsdfDiffuse", c=socket("Color", (0.3, 0.3, 0.3, 1), noise))))
    assert found.color == (0.3, 0.3, 0.3) and "not read" in found.notices[0]
    assert materials.surface(None).color == (0.8, 0.8, 0.8)
    both = node(
        "ShaderNodeAddShader",
        a=socket("Shader", None, node("ShaderNodeEmission", Color=(1, 1, 1, 1), Strength=2.0)),
        b=socket("Shader", None, node("ShaderNodeBsdfDiffuse", Color=(0.1, 0.1, 0.1, 1))),
    )
    found = materials.surface(material(both))
    assert found.emission == (2, 2, 2) and found.color == (0.1, 0.1, 0.1) and not found.notices


def floor(color=0.5):
    corners = np.array([[-2, 0, -2], [-2, 0, 2], [2, 0, 2], [2, 0, -2]], dtype=np.float32)
    return (lg.Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), material=lg.Material((color,) * 3)),)


def lit(shape, height=1.0):
    lamp = np.identity(4)
    lamp[1, 3] = height
    shapes, lamps = {"floor": shape}, {"lamp": content.Lamp("POINT", 10.0, (1, 1, 1))}
    return content.Content(shapes, lamps, np.array([np.identity(4), lamp]))


def job(scene, **more):
    camera = {"eye": (0, 3, 0.01), "target": (0, 0, 0), "fov": 20, "near": 0.01, "far": 10.0}
    given = {"graph": "lightgraph:graphs/gi/direct.ron", "rounds": 4, **more}
    return live.Job(scene, camera, (17, 17), **given)


def test_a_thread_draws_what_it_is_given_and_only_what_changed():
    drawn = threading.Event()
    follower = live.Live(drawn.set)
    shape = floor()
    expected = 10.0 * 0.5 / math.pi
    first = lit(shape)
    picture = follower.wait(job(first), lambda: False, lambda share: None)
    assert drawn.is_set() and picture.ended and picture.round < 4, "a still image ends before its frames"
    assert picture.images["color"][8, 8, 0] == pytest.approx(expected, rel=1e-2)
    second = lit(shape, height=2.0)
    assert second.fits(first) and list(second.moved(first)) == ["lamp"]
    picture = follower.wait(job(second), lambda: False, lambda share: None)
    assert picture.images["color"][8, 8, 0] == pytest.approx(expected / 4, rel=1e-2)
    third = lit(floor(0.25), height=2.0)
    assert not third.fits(second)
    picture = follower.wait(job(third), lambda: False, lambda share: None)
    assert picture.images["color"][8, 8, 0] == pytest.approx(expected / 8, rel=1e-2)
    other = follower.wait(job(third, params={"bias": 16.0}), lambda: False, lambda share: None)
    assert not other.error
    again = follower.wait(job(third), lambda: False, lambda share: None)
    np.testing.assert_array_equal(again.images["color"], picture.images["color"])
    # A fault leaves the last image; what comes after it is drawn.
    picture = follower.wait(job(third, params={"emitter_samples": -1}), lambda: False, lambda share: None)
    assert picture.error and picture.faults and "color" in picture.images
    picture = follower.wait(job(content.Content()), lambda: False, lambda share: None)
    assert "nothing to draw" in picture.error
    picture = follower.wait(job(first), lambda: False, lambda share: None)
    assert not picture.error and picture.images["color"][8, 8, 0] == pytest.approx(expected, rel=1e-2)
    assert follower.wait(job(lit(shape)), lambda: True, lambda share: None) is None
    follower.stop()


def test_what_moves_out_of_the_bounds_ends_in_the_image_of_a_fresh_start():
    shape, ball = floor(), floor(0.2)
    grid = {"graph": "lightgraph:graphs/gi/fast_grid.ron", "params": {"grid": (2, 2, 2)}, "rounds": 1}

    def both(height):
        first = lit(shape)
        up = np.identity(4)
        up[1, 3] = height
        return content.Content({**first.shapes, "ball": ball}, first.lamps, np.insert(first.matrices, 1, up, axis=0))

    def drawn(follower, scene):
        return follower.wait(job(scene, **grid), lambda: False, lambda share: None).images["color"]

    follower, fresh = live.Live(), live.Live()
    drawn(follower, both(2.0))
    np.testing.assert_array_equal(drawn(follower, both(5.0)), drawn(fresh, both(5.0)))
    follower.stop(), fresh.stop()


def test_mirroring_is_no_move():
    first = lit(floor())
    second = content.Content(first.shapes, first.lamps, first.matrices.copy())
    second.matrices[0, 0, 0] = -1
    assert not second.fits(first)
    turned = content.upright(np.diag([-2.0, 3.0, 4.0, 1.0]))
    np.testing.assert_allclose(turned[:3, :3] @ turned[:3, :3].T, np.identity(3), atol=1e-12)
    assert np.linalg.det(turned) > 0
