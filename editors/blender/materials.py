"""Materials and worlds as lightgraph's graphs know them: glTF's model.

Needs no Blender: what is asked of a node is what `bpy.types.Node` has. What a material says beyond it becomes a notice,
and the nearest that can be said is drawn.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Channel:
    """One number of an image's pixels: `"R"`, `"G"`, `"B"`, or `""` for how bright they are."""

    image: Any
    name: str = ""


@dataclass
class Surface:
    """What a material says. Textures are images of Blender."""

    color: tuple[float, float, float] = (0.8, 0.8, 0.8)
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roughness: float = 1.0
    metallic: float = 0.0
    color_image: Any = None
    emission_image: Any = None
    roughness_image: Channel | None = None
    metallic_image: Channel | None = None
    normal_image: Any = None
    normal_scale: float = 1.0
    alpha: float = 1.0
    has_holes: bool = False
    """The alpha of `color_image` counts."""
    transmission: float = 0.0
    ior: float = 1.5
    coat: float = 0.0
    coat_roughness: float = 0.0
    coat_normal_image: Any = None
    coat_normal_scale: float = 1.0
    notices: list[str] = field(default_factory=list)


@dataclass
class Sky:
    """What a world says: radiance, and what multiplies it by direction."""

    color: tuple[float, float, float] = (0.0, 0.0, 0.0)
    image: Any = None
    turn: float = 0.0
    """Radians about the vertical by which directions are turned before they are looked up in the image."""
    notices: list[str] = field(default_factory=list)


BLACK = (0.0, 0.0, 0.0)
# What of a Principled surface has no part in a Lambert surface with glTF's metals, and what it is when nobody set it.
_IGNORED = {
    "Subsurface Weight": 0.0,
    "Subsurface": 0.0,
    "Sheen Weight": 0.0,
    "Sheen": 0.0,
    "Anisotropic": 0.0,
    "Thin Film Thickness": 0.0,
}


def surface(material: Any) -> Surface:
    """What a material says; None is Blender's default."""
    found = Surface()
    if material is None:
        return found
    tree = material.node_tree if getattr(material, "use_nodes", True) else None
    if tree is None:
        found.color = _color(material.diffuse_color)
        found.metallic, found.roughness = float(material.metallic), float(material.roughness)
        return found
    output = _output(tree)
    node = _source(_socket(output, "Surface")) if output is not None else None
    if node is None:
        found.color = BLACK
        return found
    for name in ("Volume", "Displacement"):
        if _source(_socket(output, name)) is not None:
            found.notices.append(f"{name.lower()} is left out")
    _shade(node, found)
    return found


def sky(world: Any) -> Sky:
    """What a world says."""
    found = Sky()
    if world is None:
        return found
    tree = world.node_tree if getattr(world, "use_nodes", True) else None
    if tree is None:
        found.color = _color(world.color)
        return found
    output = _output(tree)
    node = _source(_socket(output, "Surface")) if output is not None else None
    if node is None:
        return found
    if node.bl_idname not in ("ShaderNodeBackground", "ShaderNodeEmission"):
        found.notices.append(f"{_called(node)} is no Background: it is black")
        return found
    strength = _number(node, "Strength", found.notices)
    color, found.image = _tinted(node, "Color", found.notices, "ShaderNodeTexEnvironment")
    if found.image is not None:
        found.turn = _turn(_source(_socket(node, "Color"))) or 0.0
    found.color = _times(color, strength)
    return found


def _shade(node: Any, found: Surface) -> None:
    kind, said = node.bl_idname, found.notices
    if kind == "ShaderNodeBsdfPrincipled":
        found.color, found.color_image = _tinted(node, "Base Color", said)
        found.metallic, found.metallic_image = _channel(node, "Metallic", said)
        found.roughness, found.roughness_image = _channel(node, "Roughness", said)
        _see_through(node, found)
        # Their names before Blender 4.0 come second.
        found.coat = _either(node, ("Coat Weight", "Clearcoat"), said)
        found.coat_roughness = _either(node, ("Coat Roughness", "Clearcoat Roughness"), said)
        name = "Emission Color" if _socket(node, "Emission Color") is not None else "Emission"
        emission, found.emission_image = _tinted(node, name, said)
        found.emission = _times(emission, _number(node, "Emission Strength", said))
        if max(found.emission) <= 0:
            found.emission_image = None
        for name, usual in _IGNORED.items():
            socket = _socket(node, name)
            if socket is not None and (socket.is_linked or abs(socket.default_value - usual) > 1e-6):
                said.append(f"{name} is left out")
        found.normal_image, found.normal_scale = _normals(node, "Normal", said)
        if found.coat > 0:
            name = "Coat Normal" if _socket(node, "Coat Normal") is not None else "Clearcoat Normal"
            found.coat_normal_image, found.coat_normal_scale = _normals(node, name, said)
    elif kind == "ShaderNodeBsdfDiffuse":
        found.color, found.color_image = _tinted(node, "Color", said)
        found.normal_image, found.normal_scale = _normals(node, "Normal", said)
    elif kind == "ShaderNodeEmission":
        found.color = BLACK
        emission, found.emission_image = _tinted(node, "Color", said)
        found.emission = _times(emission, _number(node, "Strength", said))
    elif kind == "ShaderNodeAddShader":
        _added(node, found)
    else:
        said.append(f"{_called(node)} is none of Principled, Diffuse and Emission: it is drawn matte and grey")


def _either(node: Any, names: tuple[str, ...], notices: list[str]) -> float:
    name = next((n for n in names if _socket(node, n) is not None), None)
    return 0.0 if name is None else _number(node, name, notices)


def _see_through(node: Any, found: Surface) -> None:
    """Alpha and transmission."""
    alpha = _socket(node, "Alpha")
    source = _source(alpha)
    if source is not None and source.bl_idname == "ShaderNodeTexImage":
        output = getattr(alpha.links[0], "from_socket", None)
        if source.image is found.color_image is not None and getattr(output, "name", "") == "Alpha":
            found.has_holes = True
        else:
            found.notices.append("Alpha: an image other than that of Base Color is not read; it is opaque")
    elif alpha is not None:
        found.alpha = _number(node, "Alpha", found.notices)
    found.transmission = _either(node, ("Transmission Weight", "Transmission"), found.notices)
    if found.transmission > 0:
        found.ior = _number(node, "IOR", found.notices)


def _normals(node: Any, name: str, notices: list[str]) -> tuple[Any, float]:
    """The image and the strength of a normal map in tangent space."""
    source = _source(_socket(node, name))
    if source is None:
        return None, 1.0
    image = None
    if source.bl_idname == "ShaderNodeNormalMap" and getattr(source, "space", "TANGENT") == "TANGENT":
        image = _source(_socket(source, "Color"))
    if image is None or image.bl_idname != "ShaderNodeTexImage" or image.image is None:
        notices.append(f"{name}: {_called(source)} is not read; only images in tangent space are")
        return None, 1.0
    return image.image, _number(source, "Strength", notices)


def _channel(node: Any, name: str, notices: list[str]) -> tuple[float, Channel | None]:
    """A number, and the channel of an image that takes its place."""
    source, channel = _source(_socket(node, name)), ""
    if source is not None and source.bl_idname in ("ShaderNodeSeparateColor", "ShaderNodeSeparateRGB"):
        channel = getattr(getattr(_socket(node, name).links[0], "from_socket", None), "name", "")[:1]
        source = _source(source.inputs[0])
    if source is not None and source.bl_idname == "ShaderNodeTexImage" and source.image is not None:
        return 1.0, Channel(source.image, channel)
    return _number(node, name, notices), None


def _added(node: Any, found: Surface) -> None:
    """A surface and its emission, given by two nodes."""
    both = [_source(socket) for socket in node.inputs]
    shaded = []
    for one in both:
        if one is not None:
            part = Surface()
            _shade(one, part)
            found.notices += part.notices
            shaded.append(part)
    found.color = BLACK
    for part in shaded:
        if max(part.emission) > 0:
            if max(found.emission) > 0:
                found.notices.append("of two emissions only one is drawn")
            found.emission, found.emission_image = part.emission, part.emission_image
        if max(part.color) > 0:
            if max(found.color) > 0:
                found.notices.append("of two surfaces only one is drawn")
            found.color, found.color_image = part.color, part.color_image
            found.metallic, found.roughness = part.metallic, part.roughness


def _output(tree: Any) -> Any:
    """The output that counts."""
    outputs = [n for n in tree.nodes if n.bl_idname in ("ShaderNodeOutputMaterial", "ShaderNodeOutputWorld")]
    active = [n for n in outputs if getattr(n, "is_active_output", False)]
    return (active or outputs or [None])[0]


def _socket(node: Any, name: str) -> Any:
    return next((s for s in node.inputs if s.name == name or getattr(s, "identifier", None) == name), None)


# Rounds of reroutes and links that a chain may have; one that is a ring ends, too.
_LONGEST = 64


def _source(socket: Any) -> Any:
    """The node that a socket is linked to, behind reroutes; None without."""
    for _ in range(_LONGEST):
        if socket is None or not socket.is_linked or not socket.links:
            return None
        node = socket.links[0].from_node
        if node.bl_idname != "NodeReroute":
            return None if getattr(node, "mute", False) else node
        socket = node.inputs[0]
    return None


def _tinted(node: Any, name: str, notices: list[str], textures: str = "ShaderNodeTexImage") -> tuple[Any, Any]:
    """A colour, and the image that multiplies it."""
    socket = _socket(node, name)
    if socket is None:
        return BLACK, None
    source = _source(socket)
    if source is None:
        return _color(socket.default_value), None
    if source.bl_idname == textures and source.image is not None:
        if not _plain_coordinates(source) and _turn(source) is None:
            notices.append(f"{name}: the coordinates of {_called(source)} are not read; the active ones are taken")
        return (1.0, 1.0, 1.0), source.image
    if source.bl_idname == "ShaderNodeRGB":
        return _color(source.outputs[0].default_value), None
    notices.append(f"{name}: {_called(source)} is not read; the colour beside it is drawn")
    return _color(socket.default_value), None


def _plain_coordinates(texture: Any, wanted: str | None = None) -> bool:
    """Whether a node takes the coordinates that it would take if nothing were said."""
    socket = _socket(texture, "Vector")
    source = _source(socket)
    if source is None or source.bl_idname == "ShaderNodeUVMap":
        return True
    said = getattr(socket.links[0], "from_socket", None)
    wanted = wanted or ("Generated" if texture.bl_idname == "ShaderNodeTexEnvironment" else "UV")
    return source.bl_idname == "ShaderNodeTexCoord" and getattr(said, "name", None) == wanted


def _turn(texture: Any) -> float | None:
    """The turn about the vertical that a mapping gives a panorama; None where it does more than that, or is none."""
    mapping = _source(_socket(texture, "Vector"))
    if texture.bl_idname != "ShaderNodeTexEnvironment" or mapping is None or mapping.bl_idname != "ShaderNodeMapping":
        return None
    if getattr(mapping, "vector_type", "POINT") != "POINT" or not _plain_coordinates(mapping, "Generated"):
        return None
    values = {n: _socket(mapping, n) for n in ("Location", "Rotation", "Scale")}
    if any(s is None or s.is_linked for s in values.values()):
        return None
    rotation, scale = tuple(values["Rotation"].default_value), tuple(values["Scale"].default_value)
    plain = tuple(values["Location"].default_value) == (0, 0, 0) and scale == (1, 1, 1) and rotation[:2] == (0, 0)
    return float(rotation[2]) if plain else None


def _number(node: Any, name: str, notices: list[str]) -> float:
    socket = _socket(node, name)
    if socket is None:
        return 1.0 if name.endswith("Strength") else 0.0
    source = _source(socket)
    if source is None:
        return float(socket.default_value)
    if source.bl_idname == "ShaderNodeValue":
        return float(source.outputs[0].default_value)
    notices.append(f"{name}: {_called(source)} is not read; the number beside it is taken")
    return float(socket.default_value)


def _called(node: Any) -> str:
    return f'the node "{node.name}"'


def _color(value: Any) -> tuple[float, float, float]:
    return tuple(max(0.0, float(v)) for v in tuple(value)[:3])


def _times(color: tuple[float, float, float], factor: float) -> tuple[float, float, float]:
    return tuple(c * max(0.0, factor) for c in color)
