"""Meshes as arrays, through `foreach_get` and without a loop over what they consist of.

Needs no Blender: what is asked of a mesh is what `bpy.types.Mesh` has, from 3.4 to 5.x.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np


ARRAYS = ("positions", "indices", "normals", "uvs", "tangents")


@dataclass(frozen=True, eq=False)
class Part:
    """The triangles of a mesh that have one material."""

    slot: int
    positions: np.ndarray
    indices: np.ndarray
    normals: np.ndarray | None
    uvs: np.ndarray | None
    tangents: np.ndarray | None = None

    def same(self, other: Part) -> bool:
        """Whether both are the same triangles."""
        arrays = [(getattr(self, name), getattr(other, name)) for name in ARRAYS]
        alike = [a is b or (a is not None and b is not None and np.array_equal(a, b)) for a, b in arrays]
        return self.slot == other.slot and all(alike)


def _got(collection: Any, name: str, width: int, kind: type) -> np.ndarray:
    found = np.empty(len(collection) * width, dtype=kind)
    collection.foreach_get(name, found)
    return found if width == 1 else found.reshape(-1, width)


def parts(mesh: Any, textured: bool, bent: bool = False) -> list[Part]:
    """The triangles of a mesh by the slots of their materials; with texture coordinates if it is textured, with tangents
    if a normal map bends its normals.

    Vertices stand for corners of faces where normals or texture coordinates differ from face to face.
    """
    mesh.calc_loop_triangles()
    triangles = mesh.loop_triangles
    if len(triangles) == 0:
        return []
    positions = _got(mesh.vertices, "co", 3, np.float32)
    uvs = _uvs(mesh) if textured else None
    domain = getattr(mesh, "normals_domain", "CORNER")
    normals = None
    if uvs is None and domain != "CORNER":
        indices = _got(triangles, "vertices", 3, np.int32)
        if domain == "POINT":
            normals = _got(mesh.vertex_normals, "vector", 3, np.float32)
    else:
        indices = _got(triangles, "loops", 3, np.int32)
        positions = positions[_got(mesh.loops, "vertex_index", 1, np.int32)]
        if domain != "FACE":
            normals = _corner_normals(mesh)
    tangents = _tangents(mesh) if bent and uvs is not None else None
    if tangents is not None and normals is None:
        normals = _corner_normals(mesh)
    slots = _got(triangles, "material_index", 1, np.int32)
    first = int(slots[0])
    if (slots == first).all():
        return [Part(first, positions, indices, normals, uvs, tangents)]
    vertices = (positions, normals, uvs, tangents)
    return [_part(int(slot), indices[slots == slot], *vertices) for slot in np.unique(slots)]


def _part(slot: int, indices: np.ndarray, *arrays: np.ndarray | None) -> Part:
    """Triangles with those of the vertices that they use."""
    used = np.zeros(len(arrays[0]), dtype=bool)
    used[indices] = True
    places = np.cumsum(used, dtype=np.int32) - 1
    positions, normals, uvs, tangents = (None if a is None else a[used] for a in arrays)
    return Part(slot, positions, places[indices], normals, uvs, tangents)


def _corner_normals(mesh: Any) -> np.ndarray:
    if hasattr(mesh, "corner_normals"):
        return _got(mesh.corner_normals, "vector", 3, np.float32)
    # Before 4.1.
    mesh.calc_normals_split()
    return _got(mesh.loops, "normal", 3, np.float32)


def _tangents(mesh: Any) -> np.ndarray | None:
    """Tangents of corners, in w the side of the third axis; None where Blender makes none, as of faces of many corners."""
    try:
        mesh.calc_tangents()
    except RuntimeError:
        return None
    made = np.empty((len(mesh.loops), 4), dtype=np.float32)
    made[:, :3] = _got(mesh.loops, "tangent", 3, np.float32)
    made[:, 3] = _got(mesh.loops, "bitangent_sign", 1, np.float32)
    mesh.free_tangents()
    return made


def _uvs(mesh: Any) -> np.ndarray | None:
    """Texture coordinates of corners, v from the top."""
    layer = mesh.uv_layers.active if mesh.uv_layers else None
    if layer is None:
        return None
    found = _got(layer.data, "uv", 2, np.float32)
    found[:, 1] = 1.0 - found[:, 1]
    return found


# How far apart the two sides of a sheet lie, in its diagonals: rays must tell them apart.
THICKNESS = 1e-4


def both_sides(part: Part) -> Part:
    """The same triangles from the back too, with normals of their own: light leaves a front alone."""
    count = len(part.positions)
    size = float(np.linalg.norm(part.positions.max(axis=0) - part.positions.min(axis=0)))
    back = part.positions - np.float32(size * THICKNESS) * _vertex_normals(part)
    normals = None if part.normals is None else np.concatenate([part.normals, -part.normals])
    uvs, tangents = (None if a is None else np.concatenate([a, a]) for a in (part.uvs, part.tangents))
    indices = np.concatenate([part.indices, part.indices[:, ::-1] + count])
    return Part(part.slot, np.concatenate([part.positions, back]), indices, normals, uvs, tangents)


def _vertex_normals(part: Part) -> np.ndarray:
    """Unit normals of vertices: those of their triangles by area. Vertices at one place may part."""
    a, b, c = (part.positions[part.indices[:, i]].astype(np.float64) for i in range(3))
    across, count = np.cross(b - a, c - a), len(part.positions)
    sums = [np.bincount(part.indices.ravel(), np.repeat(across[:, axis], 3), count) for axis in range(3)]
    normals = np.stack(sums, axis=1)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return (normals / np.where(lengths > 0, lengths, 1)).astype(np.float32)


def is_closed(indices: np.ndarray) -> bool:
    """Whether every edge of these triangles has one on its other side, so that no back is seen from outside."""
    edges = np.concatenate([indices[:, [0, 1]], indices[:, [1, 2]], indices[:, [2, 0]]]).astype(np.int64)
    count = int(indices.max()) + 1
    there = np.sort(edges[:, 0] * count + edges[:, 1])
    back = np.sort(edges[:, 1] * count + edges[:, 0])
    return bool(np.array_equal(there, back))


# Corners of the polygon for an ellipse.
SIDES = 48


def face(shape: str, size: float, size_y: float) -> tuple[np.ndarray, np.ndarray, float]:
    """An area light's face, which shines along −z: corners, triangles, its area in its own space."""
    wide, high = size, size_y if shape in ("RECTANGLE", "ELLIPSE") else size
    if shape in ("SQUARE", "RECTANGLE"):
        corners = np.array([[-1, -1, 0], [-1, 1, 0], [1, 1, 0], [1, -1, 0]], dtype=np.float32)
        exact = wide * high
    else:
        turn = -np.arange(SIDES) * (2 * np.pi / SIDES)
        # As large as the ellipse that it stands for.
        grown = np.sqrt(np.pi / (SIDES / 2 * np.sin(2 * np.pi / SIDES)))
        corners = np.stack([np.cos(turn) * grown, np.sin(turn) * grown, 0 * turn], axis=1).astype(np.float32)
        exact = np.pi / 4 * wide * high
    triangles = np.array([[0, i, i + 1] for i in range(1, len(corners) - 1)], dtype=np.int32)
    return corners * np.array([wide / 2, high / 2, 1], dtype=np.float32), triangles, float(exact)


def ball(radius: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Returns corners, triangles and area of a polyhedron that has the area of a light's ball. It shines to all sides
    alike, to a thousandth."""
    golden = (1 + np.sqrt(5)) / 2
    corners = np.array([np.roll((0, a, b), i) for i in range(3) for a in (-1, 1) for b in (-golden, golden)])
    # The faces of a regular icosahedron, whose edges are 2 long.
    near = np.linalg.norm(corners[:, None] - corners, axis=2) < 2.1
    rows = [r for r in itertools.combinations(range(12), 3) if near[np.ix_(r, r)].all()]
    faces = _unit(corners[np.array(rows)])
    inward = np.linalg.det(faces) < 0
    faces[inward] = faces[inward, ::-1]
    for _ in range(2):
        a, b, c = (faces[:, i] for i in range(3))
        ab, bc, ca = _unit(a + b), _unit(b + c), _unit(c + a)
        parts = ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
        faces = np.concatenate([np.stack(part, axis=1) for part in parts])
    across = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    faces *= radius * np.sqrt(8 * np.pi / np.linalg.norm(across, axis=1).sum())
    triangles = np.arange(len(faces) * 3, dtype=np.int32).reshape(-1, 3)
    return faces.reshape(-1, 3).astype(np.float32), triangles, float(4 * np.pi * radius**2)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
