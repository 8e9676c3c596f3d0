"""What needs no renderer: checks, comparisons, what comes with the package."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from typing import Any

import numpy as np

from . import _native
from ._values import texts
from .errors import Fault
from .scene import Scene

__all__ = [
    "Picture",
    "adapter",
    "allow_outside",
    "builtin_graphs",
    "check",
    "compare",
    "outputs",
    "parameters",
    "read",
    "write",
]


def check(
    graph: str | os.PathLike[str],
    scene: Scene | str | os.PathLike[str] | None = None,
    *,
    strict: bool = False,
    shaders: Iterable[str | os.PathLike[str]] = (),
    **params: Any,
) -> list[Fault]:
    """Every fault and warning of a graph and its shaders; an empty list where there is none. Needs no adapter.

    Without a scene the graph is checked for any. `strict` counts warnings as errors.
    """
    found = scene if scene is None or isinstance(scene, Scene) else Scene(scene)
    native = None if found is None else found._native
    return _native.check(os.fspath(graph), native, texts(params), bool(strict), [os.fspath(s) for s in shaders])


def compare(image: Any, reference: Any, mask: Any = None) -> dict[str, float]:
    """How far an image is from a reference, both (height, width, channels) in linear light: `rmse_percent`,
    `bias_percent`, `relmse`, `block_rmse_percent`, `p95_error`, `max_error`, the means, and `flip` (HDR-FLIP, 0 to 1).

    `mask`: (height, width) of bool, True for the pixels that count.
    """
    test, wanted = _pixels("the image", image), _pixels("the reference", reference)
    kept = None if mask is None else _mask(mask)
    return {**_native.compare(test, wanted, kept), "flip": _native.flip(test, wanted, kept)}


def parameters(
    graph: str | os.PathLike[str], shaders: Iterable[str | os.PathLike[str]] = ()
) -> dict[str, dict[str, Any]]:
    """By parameter of a graph: `type`, `default`, `min`, `max` and `about`."""
    found = _native.parameters(os.fspath(graph), [os.fspath(s) for s in shaders])
    keys = ("type", "default", "min", "max", "about")
    return {name: dict(zip(keys, values)) for name, values in found.items()}


def outputs(graph: str | os.PathLike[str], shaders: Iterable[str | os.PathLike[str]] = ()) -> list[str]:
    """All outputs of a graph. Needs no adapter."""
    return _native.outputs(os.fspath(graph), [os.fspath(s) for s in shaders])


def builtin_graphs() -> list[str]:
    """The graphs that come with the package, as `Renderer` takes them."""
    files = _native.builtin_files()
    return [f"lightgraph:{name}" for name in files if name.startswith("graphs/") and name.endswith(".ron")]


def adapter(part: str | None = None) -> tuple[str, str, bool]:
    """The adapter that renderers get: its name, its driver, and whether a CPU does its work."""
    return _native.adapter(part)


def allow_outside() -> None:
    """Lets scenes and graphs name files outside of their folder, from now on."""
    _native.allow_outside()


def read(path: str | os.PathLike[str]) -> np.ndarray:
    """The image of an OpenEXR file: float32 (height, width, channels), linear, read-only. Several layers: the first."""
    return _native.read(os.fspath(path))


def write(path: str | os.PathLike[str], image: Any, exposure: float = 0.0) -> None:
    """Writes an image, (height, width, channels) in linear light: `.png` for eyes (`exposure` in stops, tone mapped by
    Khronos PBR Neutral), anything else as OpenEXR with 32-bit floats. The file is whole or not there."""
    _native.write(os.fspath(path), _pixels("the image", image), float(exposure))


class Picture:
    """An image as a notebook shows it: `exposure` in stops, tone mapped."""

    def __init__(self, image: Any, exposure: float = 0.0) -> None:
        self.image = _pixels("the image", image)
        self.exposure = float(exposure)

    def _repr_png_(self) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "picture.png")
            write(path, self.image, self.exposure)
            with open(path, "rb") as file:
                return file.read()


def _pixels(what: str, image: Any) -> np.ndarray:
    found = np.asarray(image)
    if found.dtype.kind not in "fiu":
        raise TypeError(f"{what} has the dtype {found.dtype}: give float32")
    # What came over a wire may lie anywhere in memory; the native module reads floats where floats may lie.
    return np.require(found, np.float32, ["C_CONTIGUOUS", "ALIGNED"])


def _mask(mask: Any) -> list[bool]:
    found = np.asarray(mask)
    if found.dtype != np.bool_:
        raise TypeError(f"the mask has the dtype {found.dtype}: give bool")
    return found.ravel().tolist()
