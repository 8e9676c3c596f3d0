"""Arrays to the bytes of a GLB, which the library reads as any other."""

from __future__ import annotations

import json
import math
import struct
import zlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ._values import array, matrix, number, vector

if TYPE_CHECKING:
    from .scene import Camera, Material, Mesh, Node

_FLOAT, _UINT = 5126, 5125


def glb(meshes: Mapping[str, Mesh], lights: Mapping[str, Any], cameras: Mapping[str, Camera]) -> bytes:
    """A glTF 2.0 file with one node for each mesh, light and camera."""
    from .scene import Camera, Mesh, Node

    if not meshes:
        raise ValueError(
            'a scene needs at least one mesh: give `meshes={"floor": lightgraph.Mesh(positions, indices)}`'
        )
    build = _Build()
    for name, mesh in meshes.items():
        if isinstance(mesh, Node):
            build.node(name, mesh)
        else:
            _of_class(f"meshes[{name!r}]", mesh, Mesh)
            build.mesh(name, mesh)
    for name, light in lights.items():
        build.light(name, light)
    for name, camera in cameras.items():
        _of_class(f"cameras[{name!r}]", camera, Camera)
        build.camera(name, camera)
    return build.bytes()


def _of_class(what: str, thing: Any, wanted: type) -> None:
    if not isinstance(thing, wanted):
        raise TypeError(f"{what} is a {type(thing).__name__}: give a lightgraph.{wanted.__name__}")


class _Build:
    def __init__(self) -> None:
        self.blob = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.meshes: list[dict[str, Any]] = []
        self.materials: list[dict[str, Any]] = []
        self.lights: list[dict[str, Any]] = []
        self.cameras: list[dict[str, Any]] = []
        self.nodes: list[dict[str, Any]] = []
        self.images: list[dict[str, Any]] = []
        # Things given again are written once: by identity, with what keeps that from being taken by another.
        self.written: dict[tuple[int, ...], tuple[int, Any]] = {}

    def once(self, key: tuple[int, ...], things: Any, write: Callable[[], int]) -> int:
        if key not in self.written:
            self.written[key] = (write(), things)
        return self.written[key][0]

    def node(self, name: str, node: Node) -> None:
        from .scene import Mesh

        at = f"meshes[{name!r}]"
        parts = [node.meshes] if isinstance(node.meshes, Mesh) else list(node.meshes)
        if not parts:
            raise ValueError(f"{at} has no meshes: give at least one")
        for i, part in enumerate(parts):
            _of_class(f"{at}.meshes[{i}]", part, Mesh)
            if any(vector(f"{at}.meshes[{i}].translation", part.translation)):
                raise ValueError(f"{at}.meshes[{i}] has a translation: a node's `matrix` says where its meshes are")

        def write() -> int:
            primitives = [self.primitive(f"{at}.meshes[{i}]", part) for i, part in enumerate(parts)]
            self.meshes.append({"name": name, "primitives": primitives})
            return len(self.meshes) - 1

        mesh = self.once(tuple(map(id, parts)), parts, write)
        self.nodes.append({"name": name, "mesh": mesh, "matrix": matrix(f"{at}.matrix", node.matrix)})

    def mesh(self, name: str, mesh: Mesh) -> None:
        at = f"meshes[{name!r}]"
        self.meshes.append({"name": name, "primitives": [self.primitive(at, mesh)]})
        translation = vector(f"{at}.translation", mesh.translation)
        self.nodes.append({"name": name, "mesh": len(self.meshes) - 1, "translation": translation})

    def primitive(self, at: str, mesh: Mesh) -> dict[str, Any]:
        positions = _floats(f"{at}.positions", mesh.positions, (3,))
        count = len(positions)
        attributes = {"POSITION": self.accessor(positions, "VEC3", bounds=True)}
        for key, semantic, widths in (
            ("normals", "NORMAL", (3,)),
            ("uvs", "TEXCOORD_0", (2,)),
            ("colors", "COLOR_0", (3, 4)),
            ("tangents", "TANGENT", (4,)),
        ):
            given = getattr(mesh, key)
            if given is None:
                continue
            rows = _floats(f"{at}.{key}", given, widths)
            if len(rows) != count:
                raise ValueError(f"{at}.{key} has {len(rows)} rows, but there are {count} positions: give as many")
            attributes[semantic] = self.accessor(rows, f"VEC{rows.shape[1]}")
        primitive: dict[str, Any] = {
            "attributes": attributes,
            "material": self.material(f"{at}.material", mesh.material),
        }
        if mesh.indices is not None:
            primitive["indices"] = self.accessor(_indices(f"{at}.indices", mesh.indices, count).ravel(), "SCALAR")
        elif count % 3:
            raise ValueError(f"{at}.positions has {count} rows without `indices`: give three for each triangle")
        return primitive

    def material(self, at: str, material: Material) -> int:
        from .scene import Material

        _of_class(at, material, Material)
        return self.once((id(material),), material, lambda: self.material_entry(at, material))

    def texture(self, at: str, pixels: Any) -> dict[str, int]:
        def write() -> int:
            self.images.append({"bufferView": self.view(png(at, pixels)), "mimeType": "image/png"})
            return len(self.images) - 1

        return {"index": self.once((id(pixels),), pixels, write)}

    def material_entry(self, at: str, material: Material) -> int:
        color, emission = vector(f"{at}.color", material.color), vector(f"{at}.emission", material.emission)
        factors = ("alpha", "roughness", "metallic", "normal_scale", "transmission", "ior")
        factors += ("coat", "coat_roughness", "coat_normal_scale")
        said = {name: number(f"{at}.{name}", getattr(material, name)) for name in factors}
        entry: dict[str, Any] = {
            "pbrMetallicRoughness": {
                "baseColorFactor": [*color, said["alpha"]],
                "roughnessFactor": said["roughness"],
                "metallicFactor": said["metallic"],
            },
            "doubleSided": bool(material.double_sided),
        }
        if material.name:
            entry["name"] = material.name
        if material.color_texture is not None:
            texture = self.texture(f"{at}.color_texture", material.color_texture)
            entry["pbrMetallicRoughness"]["baseColorTexture"] = texture
        if material.emission_texture is not None:
            entry["emissiveTexture"] = self.texture(f"{at}.emission_texture", material.emission_texture)
        if material.finish_texture is not None:
            texture = self.texture(f"{at}.finish_texture", material.finish_texture)
            entry["pbrMetallicRoughness"]["metallicRoughnessTexture"] = texture
        if material.normal_texture is not None:
            texture = self.texture(f"{at}.normal_texture", material.normal_texture)
            entry["normalTexture"] = {**texture, "scale": said["normal_scale"]}
        if said["alpha"] < 1 or _has_holes(material.color_texture):
            entry["alphaMode"] = "BLEND"
        stated: dict[str, Any] = {}
        if said["transmission"] > 0:
            stated["KHR_materials_transmission"] = {"transmissionFactor": said["transmission"]}
        if said["ior"] != 1.5:
            stated["KHR_materials_ior"] = {"ior": said["ior"]}
        if said["coat"] > 0:
            coat: dict[str, Any] = {
                "clearcoatFactor": said["coat"],
                "clearcoatRoughnessFactor": said["coat_roughness"],
            }
            if material.coat_normal_texture is not None:
                texture = self.texture(f"{at}.coat_normal_texture", material.coat_normal_texture)
                coat["clearcoatNormalTexture"] = {**texture, "scale": said["coat_normal_scale"]}
            stated["KHR_materials_clearcoat"] = coat
        strength = max(emission)
        if min(emission) < 0:
            raise ValueError(f"{at}.emission = {material.emission!r}: light is not negative")
        if strength > 0:
            entry["emissiveFactor"] = [e / strength for e in emission]
            stated["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
        if stated:
            entry["extensions"] = stated
        self.materials.append(entry)
        return len(self.materials) - 1

    def light(self, name: str, light: Any) -> None:
        from .scene import DirectionalLight, PointLight, SpotLight

        at = f"lights[{name!r}]"
        entry: dict[str, Any] = {"name": name}
        match light:
            case PointLight():
                entry |= {"type": "point", "intensity": number(f"{at}.candela", light.candela)}
                matrix = _towards(vector(f"{at}.at", light.at), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
            case SpotLight():
                outer, inner = (math.radians(number(f"{at}.{n}", getattr(light, n))) / 2 for n in ("angle", "inner"))
                entry |= {"type": "spot", "intensity": number(f"{at}.candela", light.candela)}
                entry["spot"] = {"innerConeAngle": inner, "outerConeAngle": outer}
                place, to = vector(f"{at}.at", light.at), vector(f"{at}.look_at", light.look_at)
                matrix = _towards(place, tuple(np.subtract(to, place)), (0.0, 1.0, 0.0), at)
            case DirectionalLight():
                entry |= {"type": "directional", "intensity": number(f"{at}.lux", light.lux)}
                matrix = _towards((0.0, 0.0, 0.0), vector(f"{at}.direction", light.direction), (0.0, 1.0, 0.0), at)
            case _:
                kinds = "PointLight, SpotLight or DirectionalLight"
                raise TypeError(f"{at} is a {type(light).__name__}: give a lightgraph.{kinds}")
        if entry["intensity"] < 0:
            raise ValueError(f"{at} has the strength {entry['intensity']}: light is not negative")
        color = vector(f"{at}.color", light.color)
        brightest = max(*color, 1.0)
        entry["color"] = [c / brightest for c in color]
        entry["intensity"] *= brightest
        self.lights.append(entry)
        lit = {"KHR_lights_punctual": {"light": len(self.lights) - 1}}
        self.nodes.append({"name": name, "matrix": matrix, "extensions": lit})

    def camera(self, name: str, camera: Camera) -> None:
        at = f"cameras[{name!r}]"
        eye, target, up = (vector(f"{at}.{key}", getattr(camera, key)) for key in ("eye", "target", "up"))
        near = 1e-2 if camera.near is None else number(f"{at}.near", camera.near)
        far = None if camera.far is None else number(f"{at}.far", camera.far)
        if camera.height is None:
            lens: dict[str, Any] = {"yfov": math.radians(number(f"{at}.fov", camera.fov)), "znear": near}
            if far is not None:
                lens["zfar"] = far
            entry = {"name": name, "type": "perspective", "perspective": lens}
        else:
            half = number(f"{at}.height", camera.height) / 2
            lens = {"xmag": half, "ymag": half, "znear": near, "zfar": far or 1e3}
            entry = {"name": name, "type": "orthographic", "orthographic": lens}
        self.cameras.append(entry)
        matrix = _towards(eye, tuple(np.subtract(target, eye)), up, at)
        self.nodes.append({"name": name, "matrix": matrix, "camera": len(self.cameras) - 1})

    def view(self, data: bytes) -> int:
        self.views.append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data)})
        self.blob += data + b"\0" * (-len(data) % 4)
        return len(self.views) - 1

    def accessor(self, array: np.ndarray, kind: str, bounds: bool = False) -> int:
        view = self.view(array.tobytes())
        component = _UINT if array.dtype == np.uint32 else _FLOAT
        entry: dict[str, Any] = {
            "bufferView": view,
            "componentType": component,
            "count": len(array),
            "type": kind,
        }
        if bounds:
            entry |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        self.accessors.append(entry)
        return len(self.accessors) - 1

    def bytes(self) -> bytes:
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "lightgraph"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self.nodes)))}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": len(self.blob)}],
            "extensionsUsed": sorted(
                {"KHR_lights_punctual"}.union(*(m.get("extensions", {}).keys() for m in self.materials))
            ),
        }
        if self.images:
            document["images"] = self.images
            document["textures"] = [{"source": i} for i in range(len(self.images))]
        if self.cameras:
            document["cameras"] = self.cameras
        if self.lights:
            document["extensions"] = {"KHR_lights_punctual": {"lights": self.lights}}
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        blob = bytes(self.blob) + b"\0" * (-len(self.blob) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _has_holes(texture: Any) -> bool:
    """Whether a texture has alpha that says something."""
    found = np.asarray(texture)
    return found.ndim == 3 and found.shape[2] == 4 and bool((found[:, :, 3] < 255).any())


def png(name: str, pixels: Any) -> bytes:
    """A PNG of a uint8 array of the shape (height, width, 3) or (height, width, 4)."""
    found = np.asarray(pixels)
    if found.dtype != np.uint8:
        raise TypeError(f"{name} has the dtype {found.dtype}: give uint8")
    if found.ndim != 3 or found.shape[2] not in (3, 4) or 0 in found.shape:
        raise ValueError(f"{name} has the shape {found.shape}: give (height, width, 3) or (height, width, 4)")
    height, width, channels = found.shape
    rows = np.zeros((height, 1 + width * channels), np.uint8)
    rows[:, 1:] = found.reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 6, 0, 0, 0)
    data = zlib.compress(rows.tobytes(), 1)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def _floats(name: str, given: Any, widths: tuple[int, ...]) -> np.ndarray:
    found = array(name, given)
    shapes = " or ".join(f"(n, {w})" for w in widths)
    if found.dtype.kind not in "fiu":
        raise TypeError(f"{name} has the dtype {found.dtype}: give numbers of the shape {shapes}")
    if found.ndim != 2 or found.shape[1] not in widths or len(found) == 0:
        raise ValueError(f"{name} has the shape {found.shape}: give {shapes}")
    with np.errstate(over="ignore"):
        made = np.ascontiguousarray(found, dtype="<f4")
    finite = np.isfinite(made).all(axis=1)
    if not finite.all():
        raise ValueError(f"{name}[{int(np.argmin(finite))}] holds a NaN or an infinity: give finite numbers")
    return made


def _indices(name: str, given: Any, count: int) -> np.ndarray:
    found = array(name, given)
    if found.dtype.kind not in "iu":
        raise TypeError(f"{name} has the dtype {found.dtype}: give integers of the shape (m, 3)")
    if found.ndim != 2 or found.shape[1] != 3 or len(found) == 0:
        raise ValueError(f"{name} has the shape {found.shape}: give (m, 3)")
    inside = ((found >= 0) & (found < count)).all(axis=1)
    if not inside.all():
        row = int(np.argmin(inside))
        raise ValueError(f"{name}[{row}] = {found[row].tolist()}: there are positions 0 to {count - 1}")
    return np.ascontiguousarray(found, dtype="<u4")


def _towards(eye: tuple[float, ...], forward: tuple[float, ...], up: tuple[float, ...], at: str = "") -> list[float]:
    """A node's matrix, column by column, that looks along `forward`."""
    length = float(np.linalg.norm(forward))
    if length == 0:
        raise ValueError(f"{at} looks at the place where it is: give another")
    back = -np.asarray(forward, dtype=float) / length
    right = np.cross(up, back)
    if np.linalg.norm(right) < 1e-6:
        right = np.cross((0.0, 0.0, 1.0) if abs(back[2]) < 0.9 else (1.0, 0.0, 0.0), back)
    right /= np.linalg.norm(right)
    columns = (right, np.cross(back, right), back, np.asarray(eye))
    return [float(v) for column, w in zip(columns, (0.0, 0.0, 0.0, 1.0)) for v in (*column, w)]
