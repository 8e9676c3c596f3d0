"""Data-driven render graphs: RON graphs, WGSL shaders, headless global illumination, frames as numpy arrays.

import lightgraph as lg
r = lg.Renderer("lightgraph:graphs/gi/fast_grid.ron", "hall.glb", size=(640, 480), grid=(8, 8, 8))
image = r.frame()["color"]  # float32 (height, width, 4), linear light
"""

import atexit as _atexit

from ._native import drain as _drain
from ._native import version as _version
from .cluster import View, average, render_many, sweep
from .errors import Fault, GraphError, GraphWarning, NoAdapterError, Place
from .measures import bench, tune
from .renderer import Frame, Plan, Renderer
from .scene import Camera, DirectionalLight, Material, Mesh, Node, PointLight, Scene, SpotLight, glb
from .tools import Picture, adapter, allow_outside, builtin_graphs, check, compare, outputs, parameters, read, write

__version__ = _version()
_atexit.register(_drain)
__all__ = [
    "Camera",
    "DirectionalLight",
    "Fault",
    "Frame",
    "GraphError",
    "GraphWarning",
    "Material",
    "Mesh",
    "NoAdapterError",
    "Node",
    "Picture",
    "Place",
    "Plan",
    "PointLight",
    "Renderer",
    "Scene",
    "SpotLight",
    "View",
    "adapter",
    "allow_outside",
    "average",
    "bench",
    "builtin_graphs",
    "check",
    "compare",
    "glb",
    "outputs",
    "parameters",
    "read",
    "render_many",
    "sweep",
    "tune",
    "write",
]
