"""Scenes as plain tables: glTF, GLB and scene RON, so far as the scenes of this project need them.

Positions and directions are in world space, metres; lights are in glTF's units taken as radiometric (docs/references.md).
"""

import base64
import json
import re
import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np


class Unsupported(Exception):
    """The scene holds something that these scripts do not translate."""


@dataclass
class Picture:
    data: bytes  # PNG or JPEG
    nearest: bool  # no mean of texels


@dataclass
class Material:
    albedo: list  # base colour, linear RGB
    picture: Picture | None  # multiplied onto it, sRGB
    emission: list  # radiance, RGB; zero for none
    double_sided: bool
    metallic: float = 0.0
    roughness: float = 1.0
    finish: Picture | None = None  # multiplied onto both: roughness in green, metalness in blue
    normal: Picture | None = None
    glow: Picture | None = None  # multiplied onto the emission, sRGB
    cutoff: float | None = None  # nothing is there where the picture's alpha is less

    def only_matte(self, name):
        """Refuses what the renderer `name` is not told of."""
        if self.finish or self.normal or self.glow or self.cutoff is not None:
            raise Unsupported(f"{name}: of textures only those of base colours are translated")
        if self.metallic:
            raise Unsupported(f"{name}: metals are not translated")


@dataclass
class Mesh:
    positions: np.ndarray  # n × 3, f32
    faces: np.ndarray  # m × 3, u32
    normals: np.ndarray | None  # n × 3, f32; None for flat faces
    uv: np.ndarray | None  # n × 2, f32, v downwards
    material: int
    colors: np.ndarray | None = None  # n × 3, f32, linear: multiplied onto the base colour


@dataclass
class Light:
    kind: str  # "point", "spot" or "directional"
    position: np.ndarray
    direction: np.ndarray  # of travel
    intensity: list  # radiant intensity, of a directional light irradiance, RGB
    cos_inner: float = -1.0
    cos_outer: float = -1.0


@dataclass
class Camera:
    position: np.ndarray
    right: np.ndarray
    up: np.ndarray
    forward: np.ndarray
    yfov: float  # radians


@dataclass
class Scene:
    meshes: list = field(default_factory=list)
    materials: list = field(default_factory=list)
    lights: list = field(default_factory=list)
    cameras: dict = field(default_factory=dict)
    camera: str = ""  # the one to look through where none is asked for
    panorama: Path | None = None  # light from all around: its middle is seen towards −Z

    def rays(self, camera, width, height):
        """Origin and directions (h·w × 3, row 0 on top) of the rays through the pixels' centres."""
        c = self.cameras[camera or self.camera]
        tangent = np.tan(c.yfov / 2)
        x = ((np.arange(width) + 0.5) / width * 2 - 1) * tangent * width / height
        y = (1 - (np.arange(height) + 0.5) / height * 2) * tangent
        d = c.forward + x[None, :, None] * c.right + y[:, None, None] * c.up
        d /= np.linalg.norm(d, axis=2, keepdims=True)
        return c.position, d.reshape(-1, 3)


def load(path):
    """Reads `scenes/hall`, `scenes/hall.ron` or `scenes/hall.glb`."""
    path = find(Path(path))
    camera = panorama = None
    if path.suffix == ".ron":
        text = re.sub(r"//[^\n]*", "", path.read_text())
        if "specular" in text:
            raise Unsupported(f"{path.name}: glossy materials are not translated")
        camera = re.search(r'camera:\s*"([^"]*)"', text)
        camera = camera and camera.group(1)
        environment = re.search(r"environment:\s*(\w+)\(([^)]*)\)", text)
        if environment:
            file = re.fullmatch(r'\s*file:\s*"([^"]*)",?\s*', environment.group(2))
            if environment.group(1) != "File" or not file:
                raise Unsupported(f"{path.name}: of environments only unturned panoramas are translated")
            panorama = path.parent / file.group(1)
        path = path.parent / re.search(r'gltf:\s*"([^"]*)"', text).group(1)
    scene = read(path)
    scene.camera = camera or next(iter(scene.cameras))
    scene.panorama = panorama
    return scene


def find(path):
    if path.is_file():
        return path
    for suffix in (".ron", ".glb", ".gltf"):
        if path.with_name(path.name + suffix).is_file():
            return path.with_name(path.name + suffix)
    raise FileNotFoundError(f"no scene at {path}")


def read(path):
    j, data = document(path)
    scene = Scene(materials=[material(j, data, m) for m in j["materials"]])
    lights = j.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    for node in j["nodes"]:
        if "children" in node:
            raise Unsupported(f"{path.name}: nodes with children are not translated")
        m = matrix(node)
        if "camera" in node:
            yfov = j["cameras"][node["camera"]]["perspective"]["yfov"]
            scene.cameras[node["name"]] = Camera(m[:3, 3], m[:3, 0], m[:3, 1], -m[:3, 2], yfov)
        punctual = node.get("extensions", {}).get("KHR_lights_punctual")
        if punctual:
            scene.lights.append(light(lights[punctual["light"]], m))
        if "mesh" in node:
            scene.meshes += [mesh(j, data, p, m) for p in j["meshes"][node["mesh"]]["primitives"]]
    return scene


def document(path):
    """The JSON of a glTF or GLB, and its one buffer."""
    raw = path.read_bytes()
    if path.suffix == ".gltf":
        j = json.loads(raw)
        return j, base64.b64decode(j["buffers"][0]["uri"].split(",", 1)[1])
    (length,) = struct.unpack_from("<I", raw, 12)
    j = json.loads(raw[20 : 20 + length])
    (size,) = struct.unpack_from("<I", raw, 20 + length)
    return j, raw[28 + length : 28 + length + size]


def view(j, data, index):
    v = j["bufferViews"][index]
    start = v.get("byteOffset", 0)
    return data[start : start + v["byteLength"]]


def accessor(j, data, index):
    a = j["accessors"][index]
    kind = {5126: np.float32, 5123: np.uint16, 5125: np.uint32}[a["componentType"]]
    columns = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[a["type"]]
    values = np.frombuffer(view(j, data, a["bufferView"]), kind, a["count"] * columns, a.get("byteOffset", 0))
    return values.reshape(-1, columns)


def matrix(node):
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = node.get("rotation", [0, 0, 0, 1])
    m = np.eye(4)
    m[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    m[:3, :3] *= node.get("scale", [1, 1, 1])
    m[:3, 3] = node.get("translation", [0, 0, 0])
    return m


def material(j, data, m):
    surface = m.get("pbrMetallicRoughness", {})
    strength = m.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    mode = m.get("alphaMode", "OPAQUE")
    if mode == "BLEND":
        raise Unsupported("blended surfaces are not translated")
    made = Material(
        albedo=surface.get("baseColorFactor", [1, 1, 1, 1])[:3],
        picture=picture(j, data, surface.get("baseColorTexture")),
        emission=[strength * e for e in m.get("emissiveFactor", [0, 0, 0])],
        double_sided=m.get("doubleSided", False),
        metallic=surface.get("metallicFactor", 1.0),
        roughness=surface.get("roughnessFactor", 1.0),
        finish=picture(j, data, surface.get("metallicRoughnessTexture")),
        normal=picture(j, data, m.get("normalTexture")),
        glow=picture(j, data, m.get("emissiveTexture")),
        cutoff=m.get("alphaCutoff", 0.5) if mode == "MASK" else None,
    )
    if made.metallic == 0.0 and made.roughness != 1.0:
        raise Unsupported("what is no metal must be wholly rough: it would have a faint lobe besides")
    return made


def picture(j, data, reference):
    if reference is None:
        return None
    if "extensions" in reference or reference.get("texCoord", 0) != 0 or reference.get("scale", 1) != 1:
        raise Unsupported("textures are read by the first coordinates as they are")
    texture = j["textures"][reference["index"]]
    sampler = j.get("samplers", [{}])[texture.get("sampler", 0)]
    if sampler.get("wrapS", 10497) != 10497 or sampler.get("wrapT", 10497) != 10497:
        raise Unsupported("textures repeat")
    return Picture(view(j, data, j["images"][texture["source"]]["bufferView"]), sampler.get("magFilter") == 9728)


def light(l, m):
    if "range" in l:
        raise Unsupported("lights with a range are not translated")
    intensity = [l.get("intensity", 1.0) * c for c in l.get("color", [1, 1, 1])]
    found = Light(l["type"], m[:3, 3], -m[:3, 2] / np.linalg.norm(m[:3, 2]), intensity)
    if l["type"] == "spot":
        spot = l.get("spot", {})
        found.cos_inner = float(np.cos(spot.get("innerConeAngle", 0.0)))
        found.cos_outer = float(np.cos(spot.get("outerConeAngle", np.pi / 4)))
    return found


def mesh(j, data, p, m):
    attributes = p["attributes"]
    positions = accessor(j, data, attributes["POSITION"]) @ m[:3, :3].T + m[:3, 3]
    normals = uv = colors = None
    if "NORMAL" in attributes:
        normals = accessor(j, data, attributes["NORMAL"]) @ np.linalg.inv(m[:3, :3])
        normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    if "TEXCOORD_0" in attributes:
        uv = accessor(j, data, attributes["TEXCOORD_0"])
    if "COLOR_0" in attributes:
        colors = accessor(j, data, attributes["COLOR_0"])
    faces = accessor(j, data, p["indices"]).reshape(-1, 3).astype(np.uint32)
    return Mesh(positions.astype(np.float32), faces, normals, uv, p["material"], colors)
