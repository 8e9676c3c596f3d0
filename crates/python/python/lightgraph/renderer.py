"""A graph on a scene, frame by frame."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from . import _native
from ._values import array as as_array
from ._values import matrix, names, pixels, say, seconds, texts, vector
from .scene import Camera, Scene

__all__ = ["Frame", "Plan", "Renderer"]

Images = dict[str, np.ndarray]


class Plan:
    """What a graph compiles to, for one scene, size and set of parameters. A notebook shows it as a picture."""

    def __init__(self, native: _native.Plan) -> None:
        self._native = native

    def text(self) -> str:
        """The plan for people: steps in their order, memory, what each step reads and writes."""
        return self._native.text()

    def svg(self) -> str:
        """The plan as a picture (SVG)."""
        return self._native.svg()

    def dot(self) -> str:
        """The plan for Graphviz."""
        return self._native.dot()

    def json(self) -> dict[str, Any]:
        """The plan as dictionaries and lists."""
        return self._native.json()

    @property
    def bytes(self) -> tuple[int, int]:
        """Bytes of textures and buffers as allocated, and as they would be if nothing shared memory."""
        return self._native.bytes

    def __str__(self) -> str:
        return self.text()

    def _repr_html_(self) -> str:
        return self.svg()


class Frame:
    """A frame under way. It needs neither its renderer nor the scene any more."""

    def __init__(self, native: _native.Flight) -> None:
        self._native = native
        self._images: Images | None = None

    def ready(self) -> bool:
        """Whether the images are there. Never waits."""
        return self._images is not None or self._native.ready()

    def result(self) -> Images:
        """Waits for the frame and returns its images by output, as `Renderer.frame` does."""
        if self._images is None:
            self._images = self._native.result()
        return self._images

    def __await__(self) -> Iterator[Any]:
        import asyncio

        return asyncio.to_thread(self.result).__await__()


class Renderer:
    """Renders a graph on a scene. State and caches persist between frames; only what changed runs.

    `graph` is a file, or `"lightgraph:graphs/NAME.ron"` for one that comes with the package. `scene` is a path or a
    `Scene`; a graph that uses none needs none. `size` is (width, height) in pixels. Further keywords set parameters of
    the graph.

    `outputs`: those that frames give; without it `color`, or the graph's first. `shaders`: folders looked into first.
    `adapter`: a part of an adapter's name. `skip=False` runs every step of every frame, `verify` compares skipped steps
    bit for bit, `watch` checks the numbers of every step.

    Raises `GraphError` with every fault, and `NoAdapterError` where there is no adapter.
    """

    def __init__(
        self,
        graph: str | os.PathLike[str],
        scene: Scene | str | os.PathLike[str] | None = None,
        size: Sequence[int] = (640, 480),
        *,
        outputs: Iterable[str] | None = None,
        camera: Camera | str | None = None,
        shaders: Iterable[str | os.PathLike[str]] = (),
        adapter: str | None = None,
        skip: bool = True,
        verify: bool = False,
        watch: bool = False,
        **params: Any,
    ) -> None:
        self._scene = scene if scene is None or isinstance(scene, Scene) else Scene(scene)
        self._native = _native.Renderer(
            os.fspath(graph),
            None if self._scene is None else self._scene._native,
            pixels(size),
            texts(params),
            names("outputs", outputs),
            camera if isinstance(camera, str) else None,
            [os.fspath(folder) for folder in shaders],
            adapter,
            (bool(skip), bool(verify), bool(watch)),
        )
        if camera is not None and not isinstance(camera, str):
            self.camera = camera
        self._said()

    def _said(self) -> None:
        say(self._native.notices())

    def frame(self, time: float | None = None, outputs: Iterable[str] | None = None) -> Images:
        """Renders a frame at `time` (seconds; None: that of the last frame) and waits for it.

        Returns by output a float32 array of the shape (height, width, channels), linear light, row 0 on top; with
        layers (layers, height, width, channels); of a buffer its words as uint32. The arrays are read-only: the same
        one comes back as long as the output stays the same. Other outputs than before are made from now on, too.
        """
        images = self._native.frame(seconds(time), names("outputs", outputs))
        self._said()
        return images

    def submit(self, time: float | None = None, outputs: Iterable[str] | None = None) -> Frame:
        """Begins a frame as `frame` does and waits for nothing; several may be under way. `await` works on what it
        returns."""
        return Frame(self._native.submit(seconds(time), names("outputs", outputs)))

    def frames(self, times: Iterable[float], outputs: Iterable[str] | None = None, ahead: int = 2) -> Iterator[Images]:
        """The frames at these times, one after the other, with up to `ahead` of them under way."""
        flying: deque[Frame] = deque()
        for time in times:
            flying.append(self.submit(time, outputs))
            if len(flying) > max(0, int(ahead)):
                yield flying.popleft().result()
        while flying:
            yield flying.popleft().result()

    def set(self, **params: Any) -> None:
        """Sets parameters: all of them or, where one can't be, none (`GraphError`)."""
        self._native.set(texts(params))
        self._said()

    @property
    def params(self) -> dict[str, Any]:
        """By parameter: its value."""
        return self._native.params()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        width, height = self._native.size()
        return width, height

    @size.setter
    def size(self, size: Sequence[int]) -> None:
        self._native.resize(pixels(size))

    @property
    def outputs(self) -> list[str]:
        """All outputs of the graph."""
        return self._native.outputs()[1]

    @property
    def inputs(self) -> dict[str, tuple[str, list[int]]]:
        """By input of the graph: `"buffer"` and its bytes, or a format with layers, height and width."""
        return self._native.inputs()

    def lend(self, name: str, array: Any) -> None:
        """Gives an input of the graph an array, from the next frame on.

        An image: float32 of the shape (height, width), (height, width, channels) or (layers, height, width, channels),
        without NaN. A buffer: an array of 32-bit numbers with as many bytes as the graph says.
        """
        given = as_array(f"what is given as `{name}`", array)
        # As the device gets it: a number too large for 32 bits is none.
        with np.errstate(over="ignore"):
            finite = given.dtype.kind != "f" or np.isfinite(given.astype(np.float32, copy=False)).all()
        if not finite:
            raise ValueError(f"what is given as `{name}` holds a NaN or an infinity: give finite numbers")
        if self.inputs.get(name, ("",))[0] == "buffer":
            if given.dtype not in (np.dtype("f4"), np.dtype("u4"), np.dtype("i4")):
                raise TypeError(f"`{name}` is a buffer, given the dtype {given.dtype}: give float32, uint32 or int32")
            self._native.lend_bytes(name, np.ascontiguousarray(given).tobytes())
            return
        if given.dtype.kind not in "fiu":
            raise TypeError(f"`{name}` is an image, given the dtype {given.dtype}: give float32")
        self._native.lend_image(name, np.require(given, np.float32, ["C_CONTIGUOUS", "ALIGNED"]))

    def move(self, name: str, *, by: Sequence[float] | None = None, to: Sequence[float] | None = None) -> None:
        """Moves a node with all that hangs from it, or a light: `by` so many metres from where it is, or `to` a place
        (world)."""
        if (by is None) == (to is None):
            raise TypeError("give one of `by` and `to`")
        if by is not None:
            self._native.move_by(name, vector("by", by))
        else:
            self._native.move_to(name, vector("to", to))

    def place(self, places: Mapping[str, Any]) -> None:
        """Puts nodes, with all that hangs from them, where matrices say: by name 4 rows of 4 numbers, node to world. A
        matrix holds until the next one, and stands above `move`. All are placed or, where one can't be, none."""
        if not isinstance(places, Mapping):
            raise TypeError(f"places is a {type(places).__name__}: give a dictionary of matrices by name")
        self._native.place([(name, matrix(f"places[{name!r}]", given)) for name, given in places.items()])

    @property
    def scene(self) -> Scene | None:
        """What is rendered. Set another `Scene` to show that from the next frame on, seen from the same place: what
        `move` and `place` did is over then, and so is what earlier frames found. Shaders are not made again."""
        return self._scene

    @scene.setter
    def scene(self, scene: Scene) -> None:
        if not isinstance(scene, Scene):
            raise TypeError(f"scene = {scene!r}: give a lightgraph.Scene")
        self._native.show(scene._native)
        self._scene = scene
        self._said()

    def position(self, name: str) -> tuple[float, ...]:
        """Where a node or a light is (world, metres)."""
        return tuple(self._native.position(name))

    @property
    def camera(self) -> Camera:
        """What is seen. Set a `Camera`, the name of one of the scene's, or None for the scene's own."""
        return Camera._of(self._native.seen())

    @camera.setter
    def camera(self, camera: Camera | str | None) -> None:
        if isinstance(camera, Camera):
            self._native.look(camera._look())
        elif camera is None or isinstance(camera, str):
            self._native.look_through(camera)
        else:
            raise TypeError(f"camera = {camera!r}: give a lightgraph.Camera, a name or None")

    def reset(self) -> None:
        """Forgets all state: the next frame has the number 0 and runs every step."""
        self._native.reset()

    @property
    def stats(self) -> dict[str, Any]:
        """What the last frame took: by step whether and why it ran, milliseconds, loops, bytes, the adapter. `call_ms` is
        the library's whole call, the same from Rust; `wall_ms` of it from recording to the end of the device's work."""
        return self._native.stats()

    @property
    def plan(self) -> Plan:
        """The plan as it is now."""
        return Plan(self._native.plan())
