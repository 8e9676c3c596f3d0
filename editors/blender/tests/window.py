"""A window of Blender, driven: viewport set to Rendered, an object moved, a modifier added, undo, a faulty shader.

    xvfb-run blender --factory-startup --python editors/blender/tests/window.py -- OUT MODULE

writes a screenshot of each step to OUT and ends with the code 0 if each step changed what is seen as it should.
MODULE is the folder that holds the Python module.
"""

import os
import pathlib
import shutil
import sys
import traceback

import bpy

OUT, MODULE = (pathlib.Path(a).absolute() for a in sys.argv[sys.argv.index("--") + 1 :][:2])
HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(MODULE)]

import numpy as np  # noqa: E402

import addon as addon_  # noqa: E402
import scenes  # noqa: E402

addon = addon_.load()
import lightgraph as lg  # noqa: E402

ROOT = HERE.parents[2]
# Seconds that a step may take.
PATIENCE = 60
steps = []
pictures = {}
said = {}


def step(function):
    steps.append(function)
    return function


def area():
    areas = bpy.context.window_manager.windows[0].screen.areas
    return max((a for a in areas if a.type == "VIEW_3D"), key=lambda a: a.width)


def show_panel():
    for screen_area in bpy.context.window_manager.windows[0].screen.areas:
        if screen_area.type == "PROPERTIES":
            screen_area.spaces.active.context = "RENDER"


def live():
    views = list(addon.viewport._open)
    return views[-1].live if views else None


@step
def show():
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    scenes.point()
    scene = bpy.context.scene
    scene.render.engine = "LIGHTGRAPH"
    scene.lightgraph.graph = next(g for g in lg.builtin_graphs() if g.endswith("/facing_probes.ron"))
    space = area().spaces.active
    space.region_3d.view_perspective = "CAMERA"
    space.shading.type = "RENDERED"
    space.overlay.show_overlays = False


@step
def move():
    bpy.data.objects["Sphere"].location.z += 1.5


@step
def modify():
    bpy.data.objects["Cube"].modifiers.new("row", "ARRAY").count = 3
    bpy.ops.ed.undo_push(message="array")


@step
def undo():
    bpy.data.objects["Sphere"].location.z -= 1.5
    bpy.ops.ed.undo_push(message="down")
    bpy.ops.ed.undo()


@step
def pathtrace():
    chosen = bpy.context.scene.lightgraph
    chosen.rounds_view = 3
    chosen.graph = next(g for g in lg.builtin_graphs() if g.endswith("/pathtrace.ron"))


GRAPH = """Graph(
    about: "Red",
    resources: {"red": Texture(format: Rgba32Float, size: "screen")},
    passes: [Screen(name: "red", shader: "red.wgsl")],
    outputs: {"color": "red"},
)
"""
SHADER = """struct Out { @location(0) red: vec4f }
@fragment fn red() -> Out { return VALUE; }
"""


def write_shader(value):
    # So long that its end is seen only by a jump to it.
    (OUT / "graph/shaders/red.wgsl").write_text("\n" * 200 + SHADER.replace("VALUE", value))


@step
def break_shader():
    """A graph of its own whose shader doesn't compile."""
    shutil.rmtree(OUT / "graph", ignore_errors=True)
    (OUT / "graph/shaders").mkdir(parents=True)
    (OUT / "graph/own.ron").write_text(GRAPH)
    write_shader("nonsense")
    show_panel()
    # With the text that Blender draws over the view.
    area().spaces.active.overlay.show_overlays = True
    chosen = bpy.context.scene.lightgraph
    chosen.file, chosen.graph = str(OUT / "graph/own.ron"), "FILE"


@step
def mend_shader():
    """Opened at the fault from the panel, and saved as any editor would: nothing in Blender changes."""
    screen = bpy.context.window_manager.windows[0].screen
    min((a for a in screen.areas if a.type == "DOPESHEET_EDITOR"), key=lambda a: a.y).type = "TEXT_EDITOR"
    place = live().picture.faults[0].places[0]
    bpy.ops.lightgraph.open(path=str(place.path), line=place.line)
    write_shader("Out(vec4f(1.0, 0.0, 0.0, 1.0))")


@step
def panel():
    """What docs/blender.md shows."""
    scene = bpy.context.scene
    area().spaces.active.overlay.show_overlays = False
    (editor,) = (a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "TEXT_EDITOR")
    assert "nonsense" in editor.spaces.active.text.current_line.body, "the fault's place is opened"
    editor.ui_type = "TIMELINE"
    scene.lightgraph.graph = next(g for g in lg.builtin_graphs() if g.endswith("/facing_probes.ron"))
    bpy.ops.lightgraph.fill()
    scene.lightgraph["param:grid"] = (6, 6, 6)
    monkey = scenes.added("monkey", bpy.data.materials["grey"], location=(0.2, -2, 0.9), scale=(0.8,) * 3)
    monkey.modifiers.new("fine", "SUBSURF").levels = 2
    for polygon in monkey.data.polygons:
        polygon.use_smooth = True
    monkey.select_set(False)


def check():
    """What each step came to."""
    shown = {name: p.images.get("color") for name, p in pictures.items()}
    for name in ("show", "move", "modify", "undo", "pathtrace"):
        assert not pictures[name].error, (name, pictures[name].error)
    other = lambda a, b: float(np.abs(shown[a] - shown[b]).max())  # noqa: E731
    assert other("show", "move") > 0.1, "a moved object is seen"
    assert other("move", "modify") > 0.1, "a modifier is seen"
    assert other("modify", "undo") < 1e-3, f"undo takes back the last step: {other('modify', 'undo')}"
    broken = pictures["break_shader"]
    assert broken.error and broken.faults and broken.faults[0].places, broken.error
    assert "nonsense" in said["break_shader"][0], "the status bar says why"
    assert said["mend_shader"][:2] == ("", ""), said["mend_shader"]
    assert not pictures["mend_shader"].error, pictures["mend_shader"].error
    assert np.allclose(shown["mend_shader"][..., :3], (1, 0, 0))
    assert not pictures["panel"].error, pictures["panel"].error
    print("window: all steps passed")


state = {"at": 0, "waited": 0.0, "began": None}


def ended():
    found = live()
    picture = found.picture if found else None
    if picture is None or not picture.ended or picture is state["began"]:
        return None
    return picture


def tick():
    try:
        at = state["at"]
        if at == len(steps) * 3:
            check()
            os._exit(0)
        function = steps[at // 3]
        if at % 3 == 0:
            found = live()
            state["began"], state["waited"] = (found.picture if found else None), 0.0
            with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area()):
                function()
            state["at"] += 1
            return 0.5
        if at % 3 == 1:
            picture = ended()
            state["waited"] += 0.5
            if picture is not None:
                pictures[function.__name__] = picture
                # What stands beside the view follows it, and panels take their time to open.
                state["at"] += 1
                return 2.0
            if state["waited"] > PATIENCE:
                raise TimeoutError(f"{function.__name__}: nothing was drawn in {PATIENCE} s")
            return 0.5
        said[function.__name__] = addon.viewport._said
        bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
        OUT.mkdir(parents=True, exist_ok=True)
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area()):
            bpy.ops.screen.screenshot(filepath=str(OUT / f"{at // 3}-{function.__name__}.png"))
        state["at"] += 1
        return 0.5
    except BaseException:
        traceback.print_exc()
        os._exit(1)


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(tick, first_interval=2.0)
