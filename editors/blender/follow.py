"""Shows what is modelled in a window of `lightgraph view --link`, whatever engine draws in Blender."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import units
from .link import Link, address
from .sync import Sync

# Seconds between two looks at the view.
LOOK = 1 / 30

_following: Following | None = None
# Why there is none any more.
_error = ""


class Following:
    """A window, and what it has been given."""

    def __init__(self, link: str) -> None:
        self.sync = Sync()
        self.link = Link(link, f"Blender {bpy.app.version_string}")
        self.error = ""
        self._stale = True
        self._told: tuple = ()
        self._shown: tuple = (None, None)

    def forget(self) -> None:
        """Reads everything again, as after undo or another file."""
        self.sync.forget()
        self._stale = True

    def read(self, depsgraph: Any) -> None:
        """What the dependency graph says has changed, is read."""
        try:
            self.sync.read(depsgraph, space=_view()[1])
            self._stale, self.error = False, ""
        except Exception as error:
            # Blender goes on, and its console is not ours.
            self._stale, self.error = False, f"the scene can't be read: {error}"

    def look(self, context: Any) -> None:
        """Has the window follow the view, and the panel what became of the link."""
        if self._stale:
            self.read(context.evaluated_depsgraph_get())
        content, camera = shown = (self.sync.content, _camera(context))
        if content is not self._shown[0] or camera != self._shown[1]:
            self._shown = shown
            self.link.show(content, camera)
        told = (self.link.state, self.link.error, self.error)
        if told != self._told:
            self._told = told
            redraw(context)


def connect(link: str) -> None:
    """Follows a link in place of the one before.

    Raises `ValueError` for what is none.
    """
    global _following, _error
    address(link)
    disconnect()
    _following, _error = Following(link), ""
    if not bpy.app.timers.is_registered(_look):
        bpy.app.timers.register(_look, first_interval=0.0, persistent=True)


def disconnect() -> None:
    global _following, _error
    if _following is not None:
        _following.link.stop()
    _following, _error = None, ""


def said() -> tuple[str, str, list[str]]:
    """For the panel: the state of the link, what is wrong, what of the scene can't be shown."""
    if _following is None:
        return "closed", _error, []
    link = _following.link
    error = "\n".join(filter(None, (_following.error, link.error)))
    return link.state, error, _following.sync.notices


def forget() -> None:
    """Reads everything again."""
    if _following is not None:
        _following.forget()


def redraw(context: Any) -> None:
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


@bpy.app.handlers.persistent
def changed(scene: Any, depsgraph: Any = None) -> None:
    """After each change of the scene, and each frame of an animation."""
    if _following is None or depsgraph is None or depsgraph.mode == "RENDER" or scene != bpy.context.scene:
        return
    _following.read(depsgraph)


def _look() -> float | None:
    global _following, _error
    if _following is None:
        return None
    try:
        _following.look(bpy.context)
    except (AttributeError, ReferenceError, RuntimeError):
        # Blender is between two files.
        return LOOK
    if _following.link.state == "closed":
        _error, _following = _following.link.error, None
        redraw(bpy.context)
        return None
    return LOOK


def _view() -> tuple[Any, Any]:
    """The largest 3D view: its region's data and its space; None where there is no window."""
    windows = bpy.context.window_manager.windows if bpy.context.window_manager else ()
    areas = [area for window in windows for area in window.screen.areas if area.type == "VIEW_3D"]
    if not areas:
        return None, None
    space = max(areas, key=lambda area: area.width * area.height).spaces.active
    return space.region_3d, space


def _camera(context: Any) -> dict | None:
    """What the largest 3D view sees; without a window, the scene's camera."""
    region = _view()[0]
    if region is not None:
        return units.camera(np.linalg.inv(np.array(region.view_matrix)), np.array(region.window_matrix))
    scene = context.scene
    if scene.camera is None:
        return None
    return units.render_camera(scene, context.evaluated_depsgraph_get())
