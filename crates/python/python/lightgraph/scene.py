"""Scenes, from files or from arrays."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _native, _gltf
from ._values import array, number, say, vector
from .errors import Fault

__all__ = ["Camera", "DirectionalLight", "Material", "Mesh", "Node", "PointLight", "Scene", "SpotLight", "glb"]

Vec3 = Sequence[float]


@dataclass(frozen=True)
class Camera:
    """Sees from `eye` towards `target`, both in metres. `fov` is the whole vertical angle in degrees.

    `near` and `far` bound what is seen, in metres from the eye; where they are None the scene's size decides. With
    `height`, the image is flat (orthographic) and shows so many metres from top to bottom; `fov` plays no part then.
    `shift`: how far the image's centre lies from `target`, to the right and up, in heights of the image; for what
    `Renderer.camera` sees.
    """

    eye: Vec3
    target: Vec3
    fov: float = 50.0
    up: Vec3 = (0.0, 1.0, 0.0)
    near: float | None = None
    far: float | None = None
    height: float | None = None
    shift: Sequence[float] = (0.0, 0.0)

    def _look(self) -> tuple[Any, ...]:
        flat = self.height is not None
        extent = number("Camera.height", self.height) / 2 if flat else number("Camera.fov", self.fov)
        near, far = (
            None if bound is None else number(f"Camera.{name}", bound)
            for name, bound in (("near", self.near), ("far", self.far))
        )
        places = [vector("Camera." + n, getattr(self, n)) for n in ("eye", "target", "up")]
        return (*places, (extent, flat), near, far, vector("Camera.shift", self.shift, 2))

    @staticmethod
    def _of(look: tuple[Any, ...]) -> Camera:
        eye, target, up, (extent, flat), near, far, shift = look
        if flat:
            return Camera(eye, target, up=up, near=near, far=far, height=2 * extent, shift=shift)
        return Camera(eye, target, extent, up, near, far, shift=shift)


@dataclass(frozen=True)
class Material:
    """A surface. Colours are linear, from 0 to 1; `emission` is radiance and leaves the front face.

    Textures multiply what they belong to: uint8 arrays of the shape (height, width, 3) or (height, width, 4), row 0 at
    the top, where v is 0. Those of `color` and `emission` are in sRGB, the fourth channel of `color_texture` times
    `alpha` is the share of the surface that is there. `finish_texture` has roughness in green and metalness in blue,
    `normal_texture` normals as glTF has them, x and y times `normal_scale`; `coat_normal_texture` and
    `coat_normal_scale` are those of the coat, which follows the mesh's normals without. `transmission`, `ior`, `coat`
    and `coat_roughness` are those of glTF's extensions.
    """

    color: Vec3 = (0.8, 0.8, 0.8)
    emission: Vec3 = (0.0, 0.0, 0.0)
    roughness: float = 1.0
    metallic: float = 0.0
    double_sided: bool = False
    name: str = ""
    color_texture: Any = None
    emission_texture: Any = None
    alpha: float = 1.0
    finish_texture: Any = None
    normal_texture: Any = None
    normal_scale: float = 1.0
    transmission: float = 0.0
    ior: float = 1.5
    coat: float = 0.0
    coat_roughness: float = 0.0
    coat_normal_texture: Any = None
    coat_normal_scale: float = 1.0


@dataclass(frozen=True)
class Mesh:
    """Triangles of one material.

    `positions`: (n, 3), metres. `indices`: (m, 3), rows of `positions`, counter-clockwise seen from the front; None:
    each three positions are a triangle. `normals`: (n, 3), unit; None: those of the triangles. `uvs`: (n, 2). `colors`:
    (n, 3) or (n, 4), linear, times the material's. `tangents`: (n, 4), for normal maps as glTF has them; None: made from
    `uvs`. `translation`: where the mesh is put; `Renderer.move` moves it from
    there.
    """

    positions: Any
    indices: Any = None
    normals: Any = None
    uvs: Any = None
    colors: Any = None
    material: Material = Material()
    translation: Vec3 = (0.0, 0.0, 0.0)
    tangents: Any = None


@dataclass(frozen=True)
class Node:
    """Meshes, one for each of their materials, where `matrix` (4 rows of 4 numbers, node to world) puts them.

    Meshes that several nodes share are kept once. `Renderer.place` puts a node elsewhere.
    """

    meshes: Mesh | Sequence[Mesh]
    matrix: Any = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


@dataclass(frozen=True)
class PointLight:
    """Light from a point, the same to all sides: `candela` times the linear `color`."""

    at: Vec3
    candela: float
    color: Vec3 = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class SpotLight:
    """A cone of light from `at` towards `look_at`; `angle` is the whole angle across in degrees, at full strength
    within `inner`."""

    at: Vec3
    look_at: Vec3
    candela: float
    angle: float = 60.0
    inner: float = 0.0
    color: Vec3 = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class DirectionalLight:
    """Light that travels along `direction`, from infinitely far; a surface that faces it gets `lux` times `color`."""

    direction: Vec3
    lux: float
    color: Vec3 = (1.0, 1.0, 1.0)


Light = PointLight | SpotLight | DirectionalLight


class Scene:
    """A scene, never changed; any number of renderers share it.

    `Scene("hall.glb")` reads a glTF, a GLB or a scene RON; the ending may be left out.
    `Scene.from_arrays` makes one without a file.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._native = _native.Scene.load(os.fspath(path))
        self._told()

    @classmethod
    def _wrapped(cls, native: _native.Scene) -> Scene:
        scene = cls.__new__(cls)
        scene._native = native
        scene._told()
        return scene

    def _told(self) -> None:
        self._notices = tuple(self._native.notices)
        say(self._notices)

    @classmethod
    def from_arrays(
        cls,
        meshes: Mesh | Node | Mapping[str, Mesh | Node],
        lights: Light | Mapping[str, Light] | None = None,
        cameras: Camera | Mapping[str, Camera] | None = None,
        environment: Any = None,
        name: str = "arrays",
    ) -> Scene:
        """A scene made of arrays.

        `meshes`, `lights` and `cameras` are single ones, or dictionaries by name: the names are what `Renderer.move`
        and `Renderer.camera` know. `environment` is radiance from all around, (red, green, blue), or a panorama of it,
        float32 of the shape (height, 2 × height, 3): its middle is towards −Z, row 0 above. Without light the scene is
        dark.

        Raises `ValueError` for arrays of a wrong shape, `TypeError` for a wrong dtype, and `GraphError` for what no
        scene can be made of.
        """
        document = glb(meshes, lights, cameras)
        description = None
        panorama = environment is not None and array("environment", environment).ndim == 3
        if environment is not None and not panorama:
            r, g, b = vector("environment", environment)
            description = f"Scene(environment: Constant(radiance: ({r}, {g}, {b})))"
        native = _native.Scene.from_bytes(document, name, description)
        if panorama:
            native = native.lit_by(_panorama(environment))
        return cls._wrapped(native)

    @classmethod
    def from_bytes(cls, gltf: bytes, name: str = "scene", description: str | None = None) -> Scene:
        """A scene of the bytes of a .gltf or .glb that needs no other file, and the text of a scene RON."""
        return cls._wrapped(_native.Scene.from_bytes(bytes(gltf), name, description))

    @property
    def name(self) -> str:
        """The file's name without its ending."""
        return self._native.name

    @property
    def bounds(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The lower and the upper corner of the box round everything, over all motion, in metres."""
        low, high = self._native.bounds
        return tuple(low), tuple(high)

    @property
    def nodes(self) -> list[str]:
        """Names that `Renderer.move` takes."""
        return self._native.nodes

    @property
    def lights(self) -> list[str]:
        """The lights' names; `Renderer.move` takes them, too."""
        return self._native.lights

    @property
    def cameras(self) -> list[str]:
        """Names that `Renderer.camera` takes."""
        return self._native.cameras

    @property
    def duration(self) -> float:
        """Seconds until everything that moves has moved once."""
        return self._native.duration

    @property
    def facts(self) -> dict[str, Any]:
        """What graphs may ask of the scene: counts, corners, by name."""
        return self._native.facts()

    @property
    def notices(self) -> tuple[Fault, ...]:
        """What is ignored, dropped or made up."""
        return self._notices

    def __repr__(self) -> str:
        facts = self.facts
        return f"<lightgraph.Scene {self.name!r}: {facts['triangles']} triangles, {facts['lights']} lights>"


def glb(
    meshes: Mesh | Node | Mapping[str, Mesh | Node],
    lights: Light | Mapping[str, Light] | None = None,
    cameras: Camera | Mapping[str, Camera] | None = None,
) -> bytes:
    """The bytes of a .glb of what `Scene.from_arrays` takes, for a file or for another program.

    Raises `ValueError` and `TypeError` as it does.
    """
    return _gltf.glb(_named(meshes, "mesh"), _named(lights, "light"), _named(cameras, "camera"))


def _panorama(environment: Any) -> np.ndarray:
    found = array("environment", environment)
    if found.dtype.kind not in "fiu":
        raise TypeError(f"environment has the dtype {found.dtype}: give float32")
    with np.errstate(over="ignore"):
        made = np.require(found, np.float32, ["C_CONTIGUOUS", "ALIGNED"])
    if not (np.isfinite(made).all() and (made >= 0).all()):
        raise ValueError("environment holds a NaN, an infinity or a number below 0: radiance is finite and not negative")
    return made


def _named(things: Any, noun: str) -> dict[str, Any]:
    if things is None:
        return {}
    if isinstance(things, Mapping):
        return {str(name): thing for name, thing in things.items()}
    return {noun: things}
