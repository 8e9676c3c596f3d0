"""lightgraph as a render engine of Blender, 3.4 to 5.x."""

import warnings

import bpy

from . import module

module.find()

import lightgraph  # noqa: E402

from . import engine, follow, panel, settings, viewport  # noqa: E402

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
    follow.forget()


@bpy.app.handlers.persistent
def _loaded(*_: object) -> None:
    engine.forget()
    viewport.forget()
    follow.forget()


def _handlers() -> tuple:
    """What is called after what."""
    after = bpy.app.handlers
    return (
        (after.undo_post, _undone),
        (after.redo_post, _undone),
        (after.load_post, _loaded),
        (after.depsgraph_update_post, follow.changed),
        (after.frame_change_post, follow.changed),
    )


def register() -> None:
    # What they say is of triangles without area and the like: nothing for Blender's console.
    warnings.filterwarnings("ignore", category=lightgraph.GraphWarning)
    for one in _classes:
        bpy.utils.register_class(one)
    bpy.types.Scene.lightgraph = bpy.props.PointerProperty(type=settings.Settings)
    # With the token in it, it is not kept in files.
    bpy.types.WindowManager.lightgraph_link = bpy.props.StringProperty(
        name="Link", description="What `lightgraph view --link` prints", options={"SKIP_SAVE"}
    )
    for handlers, one in _handlers():
        handlers.append(one)
    panel.join()


def unregister() -> None:
    panel.leave()
    for handlers, one in _handlers():
        if one in handlers:
            handlers.remove(one)
    engine.forget()
    viewport.close()
    follow.disconnect()
    del bpy.types.WindowManager.lightgraph_link
    del bpy.types.Scene.lightgraph
    for one in reversed(_classes):
        bpy.utils.unregister_class(one)
