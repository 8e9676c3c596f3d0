"""Final renders: passes, animation, what can't be drawn; parameters and their ranges."""

import bpy
import numpy as np
import pytest

import lightgraph as lg
import scenes
from test_cycles import graph


def test_outputs_are_render_passes(empty, tmp_path):
    scenes.point()
    chosen = empty.lightgraph
    chosen.graph, chosen.passes = graph("facing_probes"), "direct indirect nonsense"
    assert [o for o in lg.outputs(chosen.graph)][:1] == ["color"]
    if hasattr(empty.render.image_settings, "media_type"):
        empty.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    empty.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    empty.render.filepath = str(tmp_path / "passes.exr")
    bpy.ops.render.render(write_still=True)
    named = (tmp_path / "passes.exr").read_bytes()
    for name in (b"ViewLayer.Combined.R", b"ViewLayer.Direct.R", b"ViewLayer.Indirect.R"):
        assert name in named, name
    assert b"Nonsense" not in named


def test_an_animation_draws_each_frame_by_the_same_session(empty, addon, tmp_path):
    scenes.point()
    empty.lightgraph.graph = graph("direct")
    ball = bpy.data.objects["Sphere"]
    ball.keyframe_insert("location", frame=1)
    ball.location.z += 2
    ball.keyframe_insert("location", frame=3)
    empty.frame_start, empty.frame_end = 1, 3
    empty.render.filepath = str(tmp_path / "film_")
    bpy.ops.render.render(animation=True)
    (_, live), frames = addon.engine._final[empty.name_full], []
    for i in (1, 2, 3):
        frames.append(np.array(lg.read(tmp_path / f"film_{i:04}.exr"))[:, :, :3])
    assert np.abs(frames[0] - frames[1]).max() > 0.05 and np.abs(frames[1] - frames[2]).max() > 0.05
    # A frame alone, by a session of its own.
    addon.engine.forget()
    empty.frame_set(2)
    empty.render.filepath = str(tmp_path / "alone.exr")
    bpy.ops.render.render(write_still=True)
    np.testing.assert_allclose(frames[1], np.array(lg.read(tmp_path / "alone.exr"))[:, :, :3], atol=1e-4)


def test_a_cropped_image_is_part_of_the_whole(empty, rendered):
    scenes.point()
    whole = rendered(graph=graph("direct"))
    render = empty.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.5, 1.0
    part = rendered(graph=graph("direct"))
    np.testing.assert_allclose(part, whole[:64, 32:96], atol=1e-5)


def test_what_cannot_be_drawn_says_why(empty, addon, tmp_path):
    with pytest.raises(RuntimeError, match="no camera"):
        bpy.ops.render.render()
    scenes.camera((0, -5, 1), (1.5, 0, 0))
    with pytest.raises(RuntimeError, match="nothing to draw"):
        bpy.ops.render.render()
    scenes.room()
    (tmp_path / "own.ron").write_text("Graph(about: 7)")
    chosen = empty.lightgraph
    chosen.file, chosen.graph = str(tmp_path / "own.ron"), "FILE"
    with pytest.raises(RuntimeError):
        bpy.ops.render.render()
    picture = addon.settings.last_picture
    assert picture.error and picture.faults[0].places[0].line == 1
    chosen.graph = graph("direct")
    assert bpy.ops.render.render() == {"FINISHED"}


def test_parameters_have_the_graph_s_ranges(empty, addon):
    chosen = empty.lightgraph
    chosen.graph = graph("direct")
    bpy.ops.lightgraph.fill()
    shown = chosen.id_properties_ui("param:shadow_size").as_dict()
    assert (shown["min"], shown["max"]) == (16, 8192) and "shadow map" in shown["description"]
    assert addon.settings.of(empty).params["shadow_size"] == 1024
    chosen["param:shadow_size"] = 64
    assert addon.settings.of(empty).params["shadow_size"] == 64
    bpy.ops.lightgraph.reset()
    assert chosen["param:shadow_size"] == 1024
    for name in addon.settings.shipped():
        chosen.graph = name
        bpy.ops.lightgraph.fill()
        assert set(addon.settings.of(empty).params) == set(lg.parameters(name))


def test_what_a_scene_holds_beyond_is_a_notice(empty, addon):
    scenes.room()
    light = scenes.light("POINT", 10)
    light.data.shadow_soft_size = 0.5
    scenes.light("SPOT", 10, shadow_soft_size=0.5)
    scenes.light("SUN", 1, angle=0.1)
    velvet = bpy.data.materials.new("velvet")
    velvet.use_nodes = True
    principled = next(n for n in velvet.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    principled.inputs["Sheen Weight"].default_value = 1.0
    scenes.added("ball", velvet)
    sync = addon.sync.Sync()
    sync.read(bpy.context.evaluated_depsgraph_get())
    for name, notice in (("point", "radius is left out"), ("spot", "radius is left out"), ("sun", "angle is left out")):
        assert any(n.startswith(f"{name}: its {notice}") for n in sync.notices), sync.notices
    assert "velvet: Sheen Weight is left out" in sync.notices


def test_a_point_with_a_radius_is_a_ball_that_is_seen(empty, followed, rendered):
    scenes.added("plane", scenes.matte("grey", (0.5,) * 3))
    light = scenes.light("POINT", 400, (0, 0, 2), shadow_soft_size=0.5)
    light.scale = (3, -1, 1)
    scenes.camera((0, -9, 2), (np.pi / 2, 0, 0), lens=50)
    image = rendered(graph=graph("direct"))
    # By the flux of a ball, 4 π² r² times its radiance.
    np.testing.assert_allclose(image[64, 64], 400 / (4 * np.pi**2 * 0.25), rtol=1e-3)
    read = followed.now
    first = read()
    assert "point" in first.shapes and not first.lamps and not followed.sync.notices
    light.location.z = 3
    assert list(read().moved(first)) == ["point"], "it moves by a matrix"
    light.visible_camera = False
    assert "point" in read().lamps and "point" not in read().shapes
    light.data.normalize, light.data.shadow_soft_size = False, 0.2
    candela = read().lamps["point"].strength
    light.visible_camera = True
    radiance = read().shapes["point"][0].material.emission[0]
    assert (radiance, candela) == pytest.approx((400 / np.pi, 400 * 0.2**2)), "its power is that of each m² then"


def test_a_material_with_everything_is_drawn(empty, addon, rendered):
    """Images of roughness, metalness and normals, holes, a coat; and what is transparent lets light through."""
    picture = bpy.data.images.new("picture", 8, 8, alpha=True)
    pixels = np.ones((8, 8, 4), np.float32)
    pixels[:, :4, 3] = 0
    picture.pixels.foreach_set(pixels.ravel())
    picture.update()
    material = bpy.data.materials.new("all")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    principled = next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    texture, bent, apart = (nodes.new(f"ShaderNode{kind}") for kind in ("TexImage", "NormalMap", "SeparateColor"))
    texture.image, texture.interpolation = picture, "Closest"
    for source, to in (
        (texture.outputs["Color"], principled.inputs["Base Color"]),
        (texture.outputs["Alpha"], principled.inputs["Alpha"]),
        (texture.outputs["Color"], bent.inputs["Color"]),
        (bent.outputs["Normal"], principled.inputs["Normal"]),
        (texture.outputs["Color"], apart.inputs[0]),
        (apart.outputs[1], principled.inputs["Roughness"]),
        (apart.outputs[2], principled.inputs["Metallic"]),
    ):
        links.new(source, to)
    principled.inputs["Coat Weight"].default_value = 0.5
    scenes.added("plane", material, location=(0, 0, 1))
    scenes.light("POINT", 300, (0, 0, 3))
    scenes.world((0, 0.4, 0))
    scenes.camera((0, 0, 5), (0, 0, 0), lens=50)
    sync = addon.sync.Sync()
    content = sync.read(bpy.context.evaluated_depsgraph_get())
    assert not [n for n in sync.notices if n.startswith("all:")]
    (mesh,) = content.shapes["Plane"]
    found = mesh.material
    assert found.finish_texture.shape == (8, 8, 3) and found.normal_texture.shape == (8, 8, 3)
    assert found.color_texture.shape == (8, 8, 4) and found.coat == 0.5
    image = rendered(graph=graph("pathtrace"), rounds_final=8)
    # The left half of the plane isn't there: the world is seen through it.
    np.testing.assert_allclose(image[64, 40], (0, 0.4, 0), atol=1e-3)
    assert image[64, 80, 0] > 0.01


def test_only_what_changed_is_another_object(empty, followed):
    scenes.point()
    read = followed.now
    first = read()
    assert read().fits(first)
    bpy.data.objects["Sphere"].location.z += 1
    moved = read()
    assert moved.fits(first) and list(moved.moved(first)) == ["Sphere"]
    bpy.data.objects["Cube"].data.vertices[0].co.z += 0.5
    bpy.data.objects["Cube"].data.update()
    edited = read()
    other = [name for name, shape in edited.shapes.items() if shape is not moved.shapes[name]]
    assert other == ["Cube"]
    bpy.data.materials["red"].node_tree.nodes["Diffuse BSDF"].inputs["Color"].default_value = (0.1, 0.2, 0.3, 1)
    painted = read()
    other = [name for name, shape in painted.shapes.items() if shape is not edited.shapes[name]]
    assert other == ["Plane.002"]
    bpy.data.objects["point"].data.energy *= 2
    lit = read()
    assert lit.lamps != painted.lamps and all(lit.shapes[n] is painted.shapes[n] for n in lit.shapes)
    # Read anew, all of it comes out the same.
    followed.sync.forget()
    bpy.data.objects["point"].location.z += 0.1
    assert read().fits(lit) and list(read().moved(lit)) == ["point"]
