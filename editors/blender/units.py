"""Blender's units and axes as lightgraph has them. Needs no Blender.

Blender's world has z up and lightgraph's y: a matrix that goes from Blender's world to lightgraph's stands to the left
of what puts a thing into Blender's world. Meshes keep their own coordinates. Lights and cameras look down their −z in
both.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

# Row by row: x stays, z becomes y, y becomes −z.
AXES = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)

# What Blender calls the power of a light is the flux of a sphere or of a face that shines alike to all sides (Blender
# Manual, Rendering > Lights > Light Objects, "Power of Lights"); with it, and with no factor for the eye:
#   a sphere, and a spot, which is a sphere behind a mask: radiant intensity = flux / 4π,
#   a face: radiance = flux / (π area),
#   a sun's strength is the irradiance on what faces it.
# `tests/test_cycles.py` holds them to Cycles. Before 4.0, Cycles took 4 in place of π for a face.


def intensity(watts: float) -> float:
    """Radiant intensity of a point or spot light, W/sr."""
    return watts / (4 * math.pi)


def radiance(watts: float, area: float, version: tuple[int, ...] = (4, 0)) -> float:
    """Radiance of an area light of so many m² in a version of Blender, W/(m² sr)."""
    sphere = math.pi if version >= (4, 0) else 4.0
    return watts / (sphere * area) if area > 0 else 0.0


def strength(energy: float, exposure: float = 0.0) -> float:
    """A light's energy with its exposure in stops."""
    return energy * 2.0**exposure


def node(matrix: np.ndarray) -> np.ndarray:
    """An object's matrix (object to Blender's world) as that of a node."""
    return AXES @ matrix


def camera(view: np.ndarray, projection: np.ndarray) -> dict:
    """What `lightgraph.Camera` is made with, from camera to Blender's world and a projection as OpenGL has them."""
    p = np.asarray(projection, dtype=np.float64)
    placed = node(np.asarray(view, dtype=np.float64))
    eye, back, up = placed[:3, 3], placed[:3, 2], placed[:3, 1]
    back, up = back / np.linalg.norm(back), up / np.linalg.norm(up)
    # Clip space is two units high; the centre of the image is where it is 0.
    if p[3, 2] != 0:
        centre = np.array([p[0, 2] / p[0, 0], p[1, 2] / p[1, 1]])
        near, far = p[2, 3] / (p[2, 2] - 1), p[2, 3] / (p[2, 2] + 1)
        lens = {"fov": math.degrees(2 * math.atan(1 / p[1, 1]))}
    else:
        centre = np.array([-p[0, 3] / p[0, 0], -p[1, 3] / p[1, 1]])
        near, far = (p[2, 3] + 1) / p[2, 2], (p[2, 3] - 1) / p[2, 2]
        lens = {"height": 2 / p[1, 1]}
        # A flat view may begin behind the eye; from farther back it is the same.
        least = (far - near) * 1e-4
        if near < least:
            away = least - near
            eye, near, far = eye + back * away, near + away, far + away
    shift = centre * p[1, 1] / 2
    return {
        "eye": tuple(eye),
        "target": tuple(eye - back),
        "up": tuple(up),
        "near": float(near),
        "far": float(far),
        "shift": tuple(shift),
        **lens,
    }


def render_size(render: Any) -> tuple[int, int]:
    """Width and height of final renders (`bpy.types.RenderSettings`)."""
    scale = render.resolution_percentage / 100
    return max(1, int(render.resolution_x * scale)), max(1, int(render.resolution_y * scale))


def render_camera(scene: Any, depsgraph: Any) -> dict:
    """What `lightgraph.Camera` is made with, for the camera of a scene (`bpy.types.Scene`)."""
    seen, render = scene.camera.evaluated_get(depsgraph), scene.render
    x, y = render_size(render)
    aspect = {"scale_x": render.pixel_aspect_x, "scale_y": render.pixel_aspect_y}
    projection = seen.calc_matrix_camera(depsgraph, x=x, y=y, **aspect)
    return camera(np.array(seen.matrix_world), np.array(projection))


# The least rim of a spot over the cosine that glTF's formula (KHR_lights_punctual) knows.
LEAST_RIM = 1e-3


def spot_angles(size: float, blend: float) -> tuple[float, float]:
    """Whole angles in degrees, outer and inner, of a spot as Blender has it: `size` in radians, and the share of the
    cone that is its soft rim.

    Blender's rim goes over the cosine as 3t² − 2t³, lightgraph's (glTF's) as t² from the inner angle on. Both take the
    same from the light: ∫ 3t² − 2t³ = 1/2 over the one, ∫ t² = 1/3 over the other.
    """
    outer = math.cos(min(size, math.pi) / 2)
    lost = blend * (1 - outer) / 2
    rim = 1.5 * lost
    if rim < LEAST_RIM:
        outer -= LEAST_RIM * 2 / 3 - lost
        rim = LEAST_RIM
    outer = max(outer, 0.0)
    inner = min(1.0, outer + rim)
    return math.degrees(2 * math.acos(outer)), math.degrees(2 * math.acos(inner))
