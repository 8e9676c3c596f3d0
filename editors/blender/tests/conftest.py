"""What tests in Blender need: the add-on registered, an empty file, pictures kept beside the figures."""

import os
import pathlib
import time

import bpy
import numpy as np
import pytest

import addon as addon_

OUT = pathlib.Path(os.environ.get("OUT", "out/blender")).absolute()


@pytest.fixture(scope="session")
def addon():
    return addon_.load()


@pytest.fixture
def empty(addon):
    """A file without objects, that this engine renders."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "LIGHTGRAPH"
    scene.render.resolution_x, scene.render.resolution_y = 128, 128
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    return scene


@pytest.fixture
def followed(addon):
    """A reader that is told of each change, as a viewport's is; `now()` is what there is."""

    class Followed:
        def __init__(self):
            self.sync, self.milliseconds = addon.sync.Sync(), 0.0

        def read(self, scene, depsgraph):
            start = time.perf_counter()
            self.sync.read(depsgraph)
            self.milliseconds += (time.perf_counter() - start) * 1e3

        def now(self):
            bpy.context.view_layer.update()
            return self.sync.content

    made = Followed()
    made.read(None, bpy.context.evaluated_depsgraph_get())
    told = bpy.app.handlers.persistent(lambda *given: made.read(*given))
    bpy.app.handlers.depsgraph_update_post.append(told)
    yield made
    bpy.app.handlers.depsgraph_update_post.remove(told)


@pytest.fixture
def rendered(tmp_path, request):
    """Renders the scene by an engine; its linear pixels, row 0 on top."""
    import lightgraph as lg

    def render(engine=None, name="", **params):
        scene = bpy.context.scene
        scene.render.engine = engine or "LIGHTGRAPH"
        chosen = scene.lightgraph
        for key in [k for k in chosen.keys() if k.startswith("param:")]:
            del chosen[key]
        for key, value in params.items():
            if key in ("graph", "rounds_final", "output", "passes", "file"):
                setattr(chosen, key, value)
            else:
                chosen[f"param:{key}"] = value
        path = tmp_path / f"{engine}.exr"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        image = np.array(lg.read(path))[:, :, :3]
        lg.write(out(f"{request.node.name}-{name or scene.render.engine.lower()}.png"), image)
        return image

    def out(name):
        OUT.mkdir(parents=True, exist_ok=True)
        return OUT / name

    render.out = out
    return render
