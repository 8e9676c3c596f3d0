"""The panel in the render properties: graph, parameters, passes, and what is wrong."""

from __future__ import annotations

from typing import Any

import bpy

from . import follow, settings

ENGINE = "LIGHTGRAPH"


class LIGHTGRAPH_OT_reset(bpy.types.Operator):
    """Sets all parameters to what the graph says"""

    bl_idname = "lightgraph.reset"
    bl_label = "Reset Parameters"

    def execute(self, context: Any) -> set[str]:
        chosen = context.scene.lightgraph
        for name in [k for k in chosen.keys() if k.startswith("param:")]:
            del chosen[name]
        fill(chosen)
        return {"FINISHED"}


class LIGHTGRAPH_OT_fill(bpy.types.Operator):
    """Shows the parameters of the graph as sliders"""

    bl_idname = "lightgraph.fill"
    bl_label = "Show Parameters"

    def execute(self, context: Any) -> set[str]:
        fill(context.scene.lightgraph)
        return {"FINISHED"}


class LIGHTGRAPH_OT_open(bpy.types.Operator):
    """Opens the place of a fault in the text editor"""

    bl_idname = "lightgraph.open"
    bl_label = "Open"

    path: bpy.props.StringProperty()
    line: bpy.props.IntProperty()

    def execute(self, context: Any) -> set[str]:
        text = next((t for t in bpy.data.texts if bpy.path.abspath(t.filepath) == self.path), None)
        try:
            text = text or bpy.data.texts.load(self.path)
        except RuntimeError as error:
            self.report({"ERROR"}, str(error).strip())
            return {"CANCELLED"}
        text.cursor_set(max(0, self.line - 1))
        for area in context.screen.areas if context.screen else ():
            if area.type == "TEXT_EDITOR":
                area.spaces.active.text = text
                region = next(r for r in area.regions if r.type == "WINDOW")
                with context.temp_override(area=area, region=region):
                    bpy.ops.text.jump(line=max(1, self.line))
                break
        else:
            self.report({"INFO"}, f"{text.name}, line {self.line}: open a text editor to see it")
        return {"FINISHED"}


def fill(chosen: Any) -> None:
    """Gives every parameter of the graph a property, within its range."""
    for name, said in settings.declared(settings.path_of(chosen)).params.items():
        key = settings.prefix(name)
        if chosen.get(key) is None:
            default = said["default"]
            chosen[key] = list(default) if isinstance(default, (tuple, list)) else default
        whole = said["type"] in ("u32", "i32")
        limits = {}
        for limit in ("min", "max"):
            value = said[limit]
            if value is None or isinstance(said["default"], bool):
                continue
            value = value[0] if isinstance(value, (tuple, list)) else value
            limits[limit] = int(min(max(value, -(2**31)), 2**31 - 1)) if whole else float(value)
        try:
            chosen.id_properties_ui(key).update(description=said["about"] or "", **limits)
        except TypeError:
            # A property of a kind that has no range.
            continue


class LIGHTGRAPH_PT_main(bpy.types.Panel):
    bl_label = "lightgraph"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {ENGINE}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine == ENGINE

    def draw(self, context: Any) -> None:
        layout, chosen = self.layout, context.scene.lightgraph
        layout.use_property_split = True
        layout.prop(chosen, "graph")
        if chosen.graph == settings.FILE:
            layout.prop(chosen, "file")
        known = settings.declared(settings.path_of(chosen))
        column = layout.column(align=True)
        column.prop(chosen, "rounds_view")
        column.prop(chosen, "rounds_final")
        layout.prop(chosen, "output")
        layout.prop(chosen, "passes")
        if known.outputs:
            layout.label(text="Outputs: " + " ".join(known.outputs))
        _faults(layout, known.faults)


class LIGHTGRAPH_PT_params(bpy.types.Panel):
    bl_label = "Parameters"
    bl_parent_id = "LIGHTGRAPH_PT_main"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    def draw(self, context: Any) -> None:
        layout, chosen = self.layout, context.scene.lightgraph
        layout.use_property_split = True
        shown = settings.declared(settings.path_of(chosen)).params
        column = layout.column(align=True)
        missing = False
        for name in shown:
            key = settings.prefix(name)
            if chosen.get(key) is None:
                missing = True
            else:
                column.prop(chosen, f'["{key}"]', text=name, slider=True)
        row = layout.row()
        if missing:
            row.operator("lightgraph.fill")
        row.operator("lightgraph.reset")


class LIGHTGRAPH_PT_said(bpy.types.Panel):
    bl_label = "Faults and Notices"
    bl_parent_id = "LIGHTGRAPH_PT_main"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    def draw(self, context: Any) -> None:
        picture = settings.last_picture
        if picture is not None and picture.error:
            self.layout.label(text=picture.error, icon="ERROR")
            _faults(self.layout, picture.faults)
        for notice in settings.last_notices:
            self.layout.label(text=notice, icon="INFO")


def _faults(layout: Any, faults: Any) -> None:
    for fault in faults:
        box = layout.box()
        box.label(text=fault.message, icon="ERROR")
        for line in fault.help:
            box.label(text=line)
        if fault.places:
            place = fault.places[0]
            text = f"{place.path}:{place.line}"
            opened = box.operator("lightgraph.open", text=text, icon="TEXT")
            opened.path, opened.line = bpy.path.abspath(place.path), place.line


class LIGHTGRAPH_PT_light(bpy.types.Panel):
    """Shows the object's visibility to the camera, which Cycles has in a panel of its own."""

    bl_label = "lightgraph"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"
    COMPAT_ENGINES = {ENGINE}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine == ENGINE and getattr(context.light, "type", "") == "POINT"

    def draw(self, context: Any) -> None:
        self.layout.use_property_split = True
        self.layout.prop(context.object, "visible_camera", text="Ball seen by the camera, soft shadows")


class LIGHTGRAPH_OT_connect(bpy.types.Operator):
    """Shows this scene in a window of `lightgraph view --link`, which prints the link"""

    bl_idname = "lightgraph.connect"
    bl_label = "Connect"

    def execute(self, context: Any) -> set[str]:
        try:
            follow.connect(context.window_manager.lightgraph_link)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class LIGHTGRAPH_OT_disconnect(bpy.types.Operator):
    """Ends the link; the window keeps what it shows"""

    bl_idname = "lightgraph.disconnect"
    bl_label = "Disconnect"

    def execute(self, context: Any) -> set[str]:
        follow.disconnect()
        return {"FINISHED"}


class LIGHTGRAPH_PT_link(bpy.types.Panel):
    """In the sidebar of the 3D view, for any engine."""

    bl_label = "Live Link"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "lightgraph"

    def draw(self, context: Any) -> None:
        layout = self.layout
        state, error, notices = follow.said()
        row = layout.row()
        row.enabled = state == "closed"
        row.prop(context.window_manager, "lightgraph_link", text="")
        layout.operator("lightgraph.connect" if state == "closed" else "lightgraph.disconnect")
        if state != "closed":
            layout.label(text=state.capitalize(), icon="LINKED")
        for line in filter(str.strip, error.splitlines()):
            layout.label(text=line, icon="ERROR")
        for notice in notices:
            layout.label(text=notice, icon="INFO")


CLASSES = (
    LIGHTGRAPH_OT_reset,
    LIGHTGRAPH_OT_fill,
    LIGHTGRAPH_OT_open,
    LIGHTGRAPH_PT_main,
    LIGHTGRAPH_PT_params,
    LIGHTGRAPH_PT_said,
    LIGHTGRAPH_PT_light,
    LIGHTGRAPH_OT_connect,
    LIGHTGRAPH_OT_disconnect,
    LIGHTGRAPH_PT_link,
)

# Panels of Blender's that make no sense here.
_NOT_OURS = {"VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes", "RENDER_PT_simplify", "DATA_PT_light"}


def _shared() -> list[type]:
    """Blender's own panels that every engine shows: of materials, lights, cameras, worlds, output."""
    panels = bpy.types.Panel.__subclasses__()
    engines = ("BLENDER_RENDER", "BLENDER_EEVEE", "BLENDER_EEVEE_NEXT")
    return [
        p
        for p in panels
        if hasattr(p, "COMPAT_ENGINES")
        and any(e in p.COMPAT_ENGINES for e in engines)
        and p.__name__ not in _NOT_OURS
        and not p.__name__.startswith(("RENDER_PT_eevee", "CYCLES"))
    ]


def join() -> None:
    """Shows Blender's panels for this engine too."""
    for one in _shared():
        one.COMPAT_ENGINES.add(ENGINE)


def leave() -> None:
    for one in bpy.types.Panel.__subclasses__():
        if ENGINE in getattr(one, "COMPAT_ENGINES", ()) and not one.__name__.startswith("LIGHTGRAPH"):
            one.COMPAT_ENGINES.discard(ENGINE)
