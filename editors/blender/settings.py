"""What the user chooses: graph, parameters, passes, frames."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import lightgraph as lg

from .live import Picture, stamps

# What was drawn last, and what of the scene can't be drawn, for the panel.
last_picture: Picture | None = None
last_notices: tuple[str, ...] = ()

FILE = "FILE"


@dataclass(frozen=True)
class Wanted:
    """The choices for a scene."""

    graph: str
    params: dict[str, Any]
    output: str
    passes: tuple[str, ...]
    rounds_final: int
    rounds_view: int

    def key(self) -> tuple:
        """What tells one viewport's choices from another's."""
        return (self.graph, tuple(sorted(self.params.items())), self.output, self.rounds_view)


@dataclass
class Declared:
    """What a graph declares, or why that can't be told."""

    stamp: tuple
    params: dict[str, dict[str, Any]] = field(default_factory=dict)
    outputs: list[str] = field(default_factory=list)
    faults: tuple[lg.Fault, ...] = ()


_declared: dict[str, Declared] = {}


def declared(graph: str) -> Declared:
    """What a graph declares; read again when its files change."""
    stamp = stamps(graph)
    known = _declared.get(graph)
    if known is None or known.stamp != stamp:
        known = Declared(stamp)
        try:
            known.params, known.outputs = lg.parameters(graph), lg.outputs(graph)
        except lg.GraphError as error:
            known.faults = error.faults
        _declared[graph] = known
    return known


def shipped() -> list[str]:
    """The graphs that come with the module and draw scenes."""
    return [g for g in lg.builtin_graphs() if "/post/" not in g and "/play/" not in g]


def _items() -> list[tuple[str, str, str]]:
    items = [(g, g.rsplit("/", 1)[-1].removesuffix(".ron"), "") for g in shipped()]
    return [*items, (FILE, "A file …", "A graph or a variant of your own")]


def _usual() -> str:
    """Right in the open and in rooms, with little noise while things move, and less while nothing does."""
    return next(g for g in shipped() if g.endswith("/final_gather.ron"))


def _other_graph(self: Settings, context: Any) -> None:
    engine_passes(context)


def engine_passes(context: Any) -> None:
    """Has Blender ask again for the render passes."""
    layer = getattr(context, "view_layer", None)
    if layer is not None:
        layer.update_render_passes()


class Settings(bpy.types.PropertyGroup):
    """Choices kept with a scene. Values of parameters are its own properties, named `param:NAME`."""

    graph: bpy.props.EnumProperty(
        name="Graph", description="What draws", items=_items(), default=_usual(), update=_other_graph
    )
    file: bpy.props.StringProperty(
        name="File", description="A graph or a variant (.ron)", subtype="FILE_PATH", update=_other_graph
    )
    output: bpy.props.StringProperty(name="Output", description="The output shown", default="color")
    passes: bpy.props.StringProperty(
        name="Passes",
        description="Further outputs as render passes, parted by spaces",
        default="direct",
        update=_other_graph,
    )
    rounds_view: bpy.props.IntProperty(
        name="Viewport frames", description="Frames of a progressive graph while nothing changes", default=64, min=1
    )
    rounds_final: bpy.props.IntProperty(
        name="Render frames", description="Frames of a progressive graph in a final render", default=64, min=1
    )


def prefix(name: str) -> str:
    """The property that holds a parameter."""
    return f"param:{name}"


def path_of(chosen: Settings) -> str:
    """The graph, as a renderer takes it."""
    return bpy.path.abspath(chosen.file) if chosen.graph == FILE else chosen.graph


def of(scene: Any) -> Wanted:
    """The choices for a scene."""
    chosen = scene.lightgraph
    graph = path_of(chosen)
    known = declared(graph)
    params = {}
    for name, said in known.params.items():
        value = chosen.get(prefix(name))
        if value is not None:
            params[name] = as_declared(value, said["default"])
    outputs = known.outputs or [chosen.output]
    output = chosen.output if chosen.output in outputs else outputs[0]
    passes = tuple(p for p in dict.fromkeys(chosen.passes.split()) if p in known.outputs and p != output)
    return Wanted(graph, params, output, passes, chosen.rounds_final, chosen.rounds_view)


def as_declared(value: Any, default: Any) -> Any:
    """A property as a parameter of the kind of its default: Blender keeps bools as ints, and vectors as arrays."""
    if isinstance(default, (tuple, list)):
        given = list(value) if hasattr(value, "__len__") else [value] * len(default)
        return tuple(as_declared(v, d) for v, d in zip(given, default))
    return type(default)(value)


def pass_name(output: str) -> str:
    """The name of the render pass of an output."""
    return output.replace("_", " ").capitalize()


def tell(picture: Picture, notices: list[str]) -> None:
    """Keeps what a render came to for the panel."""
    global last_picture, last_notices
    last_picture, last_notices = picture, tuple(notices)
