"""The render engine: final renders here, the viewport in `viewport`."""

from __future__ import annotations

import bpy
import numpy as np

from . import settings, units
from .live import Job, Live, Picture
from .sync import Sync
from .viewport import Viewport

# By scene: what its final renders have read and drawn, for the next frame of an animation.
_final: dict[str, tuple[Sync, Live]] = {}


class LightgraphEngine(bpy.types.RenderEngine):
    bl_idname = "LIGHTGRAPH"
    bl_label = "lightgraph"
    bl_use_preview = False
    bl_use_shading_nodes_custom = False

    viewport: Viewport | None = None

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        scene = depsgraph.scene
        if self.is_preview:
            return
        if scene.camera is None:
            self._refuse("the scene has no camera")
            return
        wanted = settings.of(scene)
        size = units.render_size(scene.render)
        name = scene.name_full
        if name not in _final:
            _final[name] = (Sync(), Live())
        sync, live = _final[name]
        self.update_stats("", "lightgraph: reading the scene")
        content = sync.read(depsgraph, everything=True)
        view = units.render_camera(scene, depsgraph)
        passes = {"Combined": wanted.output, **{settings.pass_name(o): o for o in wanted.passes}}
        outputs = tuple(dict.fromkeys(passes.values()))
        frame = scene.frame_current + scene.frame_subframe - scene.frame_start
        time = frame * scene.render.fps_base / scene.render.fps
        job = Job(content, view, size, wanted.graph, wanted.params, outputs, wanted.rounds_final, time, final=True)
        for notice in sync.notices:
            self.report({"INFO"}, notice)
        self.update_stats("", "lightgraph: rendering")
        picture = live.wait(job, self.test_break, self.update_progress)
        if picture is None:
            return
        settings.tell(picture, sync.notices)
        if picture.error:
            self._refuse(picture.error)
            return
        left, low, right, high = _border(scene.render, size)
        images = {
            name: picture.images[output][size[1] - high : size[1] - low, left:right] for name, output in passes.items()
        }
        self._put(images, (right - left, high - low))

    def _refuse(self, why: str) -> None:
        self.update_stats("", f"lightgraph: {why}")
        self.report({"ERROR"}, why)

    def _put(self, images: dict[str, np.ndarray], size: tuple[int, int]) -> None:
        result = self.begin_result(0, 0, *size)
        try:
            for one in result.layers[0].passes:
                if one.name not in images:
                    continue
                rows = _rows(images[one.name], one.channels)
                if bpy.app.version >= (4, 0, 0):
                    one.rect.foreach_set(rows.ravel())
                else:
                    one.rect = rows.reshape(-1, one.channels)
        finally:
            self.end_result(result)

    def update_render_passes(self, scene: bpy.types.Scene = None, renderlayer: bpy.types.ViewLayer = None) -> None:
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        for output in settings.of(scene).passes:
            self.register_pass(scene, renderlayer, settings.pass_name(output), 4, "RGBA", "COLOR")

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        if self.viewport is None:
            self.viewport = Viewport(self)
        self.viewport.update(context, depsgraph)

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        if self.viewport is None:
            self.view_update(context, depsgraph)
        self.viewport.draw(context, depsgraph)


def _border(render: bpy.types.RenderSettings, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """The part of the image that is asked for, in pixels from the lower left: left, low, right, high."""
    if not (render.use_border and render.use_crop_to_border):
        return 0, 0, *size
    shares = (render.border_min_x, render.border_min_y, render.border_max_x, render.border_max_y)
    return tuple(int(share * n) for share, n in zip(shares, (*size, *size)))


def _rows(image: np.ndarray, channels: int) -> np.ndarray:
    """An image from the lowest row up, with so many channels and nothing transparent."""
    height, width, given = image.shape
    made = np.ones((height, width, channels), dtype=np.float32)
    made[:, :, : min(given, channels, 3)] = image[::-1, :, : min(given, channels, 3)]
    return made


def forget(*_: object) -> None:
    """Ends what final renders keep, as when another file is loaded."""
    for _, live in _final.values():
        live.stop()
    _final.clear()
