"""Data-driven render graphs: RON graphs, WGSL shaders, headless global illumination, frames as numpy arrays."""

from ._native import version

__version__ = version()
__all__ = ["version"]
