"""lightgraph as a render engine of Blender, 3.4 to 5.x."""

import warnings

import bpy

from . import module

module.find()

import lightgraph  # noqa: E402

from . import engine, panel, settings, viewport  # noqa: E402

bl_info = {
    "name": "lightgraph",
    "description": "Render graphs of global illumination in the viewport",
    "author": "The lightgraph authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "category": "Render",
}

_classes = (settings.Settings, *panel.CLASSES, engine.LightgraphEngine)


@bpy.app.handlers.persistent
def _undone(*_: object) -> None:
    viewport.forget()


@bpy.app.handlers.persistent
def _loaded(*_: object) -> None:
    engine.forget()
    viewport.forget()


def register() -> None:
    # What they say is of triangles without area and the like: nothing for Blender's console.
    warnings.filterwarnings("ignore", category=lightgraph.GraphWarning)
    for one in _classes:
        bpy.utils.register_class(one)
    bpy.types.Scene.lightgraph = bpy.props.PointerProperty(type=settings.Settings)
    bpy.app.handlers.undo_post.append(_undone)
    bpy.app.handlers.redo_post.append(_undone)
    bpy.app.handlers.load_post.append(_loaded)
    panel.join()


def unregister() -> None:
    panel.leave()
    for handlers, one in (
        (bpy.app.handlers.undo_post, _undone),
        (bpy.app.handlers.redo_post, _undone),
        (bpy.app.handlers.load_post, _loaded),
    ):
        if one in handlers:
            handlers.remove(one)
    engine.forget()
    viewport.close()
    del bpy.types.Scene.lightgraph
    for one in reversed(_classes):
        bpy.utils.unregister_class(one)
