"""The live link: what a window is sent while something is modelled."""

import bpy

import scenes
from note_taker import Window, until


def test_a_window_follows_what_is_modelled(empty, addon):
    scenes.point()
    empty.render.engine = "BLENDER_WORKBENCH"
    window, manager = Window(), bpy.context.window_manager
    # Blender as a module has a 3D view, which would be followed before the scene's camera.
    for area in [area for w in manager.windows for area in w.screen.areas if area.type == "VIEW_3D"]:
        area.type = "TEXT_EDITOR"
    manager.lightgraph_link = "nonsense"
    assert bpy.ops.lightgraph.connect.poll()
    try:
        bpy.ops.lightgraph.connect()
    except RuntimeError as error:
        assert "lightgraph view --link" in str(error)
    assert addon.follow.said()[0] == "closed"
    manager.lightgraph_link = window.link
    bpy.ops.lightgraph.connect()

    def sent(count):
        # In a module there are no timers.
        def look():
            addon.follow._look()
            return len(window.messages) >= count

        until(look)
        return window.messages[count - 1]

    sent(3)
    assert window.words() == ["hello", "camera", "scene"]
    assert window.messages[0][1]["program"] == f"Blender {bpy.app.version_string}"
    bpy.data.objects["Sphere"].location.z += 0.1
    bpy.context.view_layer.update()
    word, header, body = sent(4)
    assert (word, header, len(body)) == ("place", {"nodes": ["Sphere"]}, 64)
    empty.camera.location.x += 1
    bpy.context.view_layer.update()
    assert sent(5)[0] == "camera"
    bpy.data.materials["red"].node_tree.nodes["Diffuse BSDF"].inputs["Color"].default_value = (0.1, 0.2, 0.3, 1)
    bpy.context.view_layer.update()
    assert sent(6)[0] == "scene"
    state, error, notices = addon.follow.said()
    assert (state, error) == ("connected", "") and isinstance(notices, list)

    # Modelling goes on when the window closes.
    window.close()
    until(lambda: addon.follow._look() is None)
    assert addon.follow.said()[0] == "closed" and "closed" in addon.follow.said()[1]
    bpy.data.objects["Sphere"].location.z += 0.1
    bpy.context.view_layer.update()
    assert bpy.ops.lightgraph.disconnect() == {"FINISHED"}
    assert addon.follow.said() == ("closed", "", [])
