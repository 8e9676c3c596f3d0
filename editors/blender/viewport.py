"""The viewport: draws the last frame that arrived and asks for the next one. Waits for nothing."""

from __future__ import annotations

import time
import weakref
from typing import Any

import bpy
import gpu
import numpy as np
from gpu_extras.presets import draw_texture_2d

from . import settings, units
from .live import Job, Live, Picture, stamps
from .sync import Sync

# Seconds between two looks at whether a thread has something new to show.
LOOK = 0.01

# Seconds between two looks at whether files were saved.
FILES = 0.5

_open: weakref.WeakSet[Viewport] = weakref.WeakSet()
# What the status bars and the panel say: why there is no image, what is wrong, notices.
_said: tuple[str, str, tuple[str, ...]] = ("", "", ())


class Viewport:
    """One 3D view that shows this engine."""

    def __init__(self, engine: Any) -> None:
        self._engine = weakref.ref(engine)
        self.sync, self.live = Sync(), Live()
        weakref.finalize(self, self.live.stop)
        self._asked: tuple | None = None
        self._drawn: tuple[Picture, Any] | None = None
        self._content = self.sync.content
        self._told: Picture | None = None
        self._wanted: settings.Wanted | None = None
        self._stamp: tuple = ()
        self._next_look = 0.0
        _open.add(self)
        if not bpy.app.timers.is_registered(_look):
            bpy.app.timers.register(_look, first_interval=LOOK)

    def forget(self) -> None:
        """Reads everything again."""
        self.sync.forget()

    def update(self, context: Any, depsgraph: Any) -> None:
        """What the dependency graph says has changed, is read."""
        self._content = self.sync.read(depsgraph, space=context.space_data)

    def draw(self, context: Any, depsgraph: Any) -> None:
        """Shows what there is, and asks for what is to be seen now."""
        region, scene = context.region, depsgraph.scene
        wanted = settings.of(scene)
        size = (max(1, region.width), max(1, region.height))
        view = np.array(context.region_data.view_matrix)
        projection = np.array(context.region_data.window_matrix)
        self._wanted, self._stamp = wanted, stamps(wanted.graph)
        asked = (id(self._content), self._stamp, size, view.tobytes(), projection.tobytes(), wanted.key())
        if asked != self._asked:
            self._asked = asked
            camera = units.camera(np.linalg.inv(view), projection)
            outputs = (wanted.output,)
            rounds = wanted.rounds_view
            self.live.draw(Job(self._content, camera, size, wanted.graph, wanted.params, outputs, rounds))
        picture = self.live.picture
        if picture is None:
            return
        self._tell(picture)
        image = picture.images.get(picture.job.outputs[0])
        if image is not None:
            self._show(scene, picture, image, size)

    def _tell(self, picture: Picture) -> None:
        engine = self._engine()
        if engine is not None:
            notices = self.sync.notices
            more = f" ({len(notices)} notices in the panel)" if notices else ""
            said = picture.error or f"frame {picture.round} of {picture.job.rounds}"
            engine.update_stats("lightgraph", said + more)
        self._told = picture

    def _show(self, scene: Any, picture: Picture, image: np.ndarray, size: tuple[int, int]) -> None:
        if self._drawn is None or self._drawn[0] is not picture:
            height, width = image.shape[:2]
            pixels = np.ones((height, width, 4), dtype=np.float32)
            pixels[:, :, :3] = image[::-1, :, :3]
            buffer = gpu.types.Buffer("FLOAT", width * height * 4, pixels.ravel())
            self._drawn = (picture, gpu.types.GPUTexture((width, height), format="RGBA16F", data=buffer))
        engine = self._engine()
        if engine is None:
            return
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(scene)
        draw_texture_2d(self._drawn[1], (0, 0), *size)
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")

    def look(self) -> None:
        """Has Blender draw again where there is something new."""
        picture = self.live.picture
        if picture is not None and picture is not self._told:
            settings.tell(picture, self.sync.notices)
        if picture is not self._told or self._saved():
            engine = self._engine()
            if engine is not None:
                engine.tag_redraw()

    def _saved(self) -> bool:
        """Whether a file of the graph was written since the last look at them."""
        now = time.monotonic()
        if self._wanted is None or now < self._next_look:
            return False
        self._next_look = now + FILES
        return stamps(self._wanted.graph) != self._stamp


def _look() -> float | None:
    for view in list(_open):
        try:
            view.look()
        except ReferenceError:
            # Blender has freed the engine.
            _open.discard(view)
            view.live.stop()
    _say()
    return LOOK if _open else None


def _say() -> None:
    """Writes to the status bars why a view shows no new image, and redraws the panel, which shows the rest."""
    global _said
    pictures = [view.live.picture for view in _open]
    error = next((p.error for p in pictures if p is not None and p.error), "")
    last, before = settings.last_picture, _said
    _said = (error, last.error if last is not None else "", settings.last_notices)
    if _said == before:
        return
    manager = bpy.context.window_manager
    for window in manager.windows if manager is not None else ():
        if error != before[0]:
            with bpy.context.temp_override(window=window):
                # Without a text, it is Blender's own again.
                window.workspace.status_text_set(f"lightgraph: {error}" if error else None)
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()


def forget(*_: object) -> None:
    """Reads everything again in all views, as after undo."""
    for view in list(_open):
        view.forget()


def close(*_: object) -> None:
    """Ends all threads."""
    for view in list(_open):
        view.live.stop()
    _open.clear()
    _say()
