"""What is to be drawn, free of Blender, and what of it differs from what was drawn before."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import lightgraph as lg
import numpy as np


@dataclass(frozen=True)
class Lamp:
    """A light without extent that shines along its −z."""

    kind: str
    """`"POINT"`, `"SPOT"` or `"SUN"`."""
    strength: float
    """W/sr, of a sun W/m²."""
    color: tuple[float, float, float]
    outer: float = 0.0
    """Whole angles in degrees, of a spot."""
    inner: float = 0.0

    def light(self, matrix: np.ndarray) -> Any:
        at, towards = matrix[:3, 3], matrix[:3, 3] - matrix[:3, 2]
        match self.kind:
            case "SPOT":
                return lg.SpotLight(at, towards, self.strength, self.outer, self.inner, self.color)
            case "SUN":
                return lg.DirectionalLight(towards - at, self.strength, self.color)
            case _:
                return lg.PointLight(at, self.strength, self.color)


@dataclass(eq=False)
class Content:
    """A scene. Meshes that did not change are the same objects as before, and so is a panorama."""

    shapes: dict[str, tuple[lg.Mesh, ...]] = field(default_factory=dict)
    lamps: dict[str, Lamp] = field(default_factory=dict)
    matrices: np.ndarray = field(default_factory=lambda: np.empty((0, 4, 4)))
    """Node to world: of the shapes, then of the lamps. Those of lamps neither scale nor mirror."""
    environment: Any = None

    def names(self) -> list[str]:
        return [*self.shapes, *self.lamps]

    def scene(self) -> lg.Scene:
        """A scene with everything in its place.

        Raises `ValueError` and `lightgraph.GraphError` for what can't be drawn.
        """
        return lg.Scene.from_arrays(*self._placed(), environment=self.environment, name="Blender")

    def glb(self) -> bytes:
        """The bytes of a .glb with everything in its place but the environment.

        Raises `ValueError` for what can't be drawn.
        """
        return lg.glb(*self._placed())

    def _placed(self) -> tuple[dict[str, lg.Node], dict[str, Any]]:
        if not self.shapes:
            raise ValueError("there is nothing to draw: the scene has no faces that are rendered")
        count = len(self.shapes)
        shapes = {name: lg.Node(parts, m) for (name, parts), m in zip(self.shapes.items(), self.matrices)}
        lights = {name: lamp.light(m) for (name, lamp), m in zip(self.lamps.items(), self.matrices[count:])}
        return shapes, lights

    def bounds(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The lower and the upper corner of the box round everything."""
        corners = []
        for parts, matrix in zip(self.shapes.values(), self.matrices):
            for part in parts:
                placed = part.positions @ matrix[:3, :3].T + matrix[:3, 3]
                corners += [placed.min(axis=0), placed.max(axis=0)]
        found = np.array(corners).reshape(-1, 3)
        return tuple(found.min(axis=0, initial=np.inf)), tuple(found.max(axis=0, initial=-np.inf))

    def fits(self, before: Content | None) -> bool:
        """Whether this is what was there before, if for where things are."""
        if before is None or not same(self.environment, before.environment):
            return False
        if self.lamps != before.lamps or self.shapes.keys() != before.shapes.keys():
            return False
        if any(mine is not theirs for mine, theirs in zip(self.shapes.values(), before.shapes.values())):
            return False
        if list(self.shapes) != list(before.shapes) or list(self.lamps) != list(before.lamps):
            return False
        other = self._other(before)
        signs = [np.sign(np.linalg.det(c.matrices[other, :3, :3])) for c in (self, before)]
        return np.array_equal(*signs)

    def _other(self, before: Content) -> np.ndarray:
        return np.flatnonzero((self.matrices != before.matrices).any(axis=(1, 2)))

    def moved(self, before: Content) -> dict[str, np.ndarray]:
        """Where things are that were elsewhere, for content that fits."""
        names = self.names()
        return {names[i]: self.matrices[i] for i in self._other(before)}


def same(a: Any, b: Any) -> bool:
    """Whether two environments are the same panorama or the same constant."""
    return a is b or isinstance(a, tuple) and isinstance(b, tuple) and a == b


def upright(matrix: np.ndarray) -> np.ndarray:
    """A matrix without its scale and mirroring that keeps the place and the way −z points."""
    made = np.identity(4)
    back = matrix[:3, 2] / (np.linalg.norm(matrix[:3, 2]) or 1.0)
    right = np.cross(matrix[:3, 1], back)
    if np.linalg.norm(right) < 1e-9:
        right = np.cross(np.identity(3)[int(np.argmin(np.abs(back)))], back)
    right = right / (np.linalg.norm(right) or 1.0)
    made[:3, 0], made[:3, 1], made[:3, 2], made[:3, 3] = right, np.cross(back, right), back, matrix[:3, 3]
    return made
