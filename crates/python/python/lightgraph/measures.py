"""What the commands `lightgraph bench` and `lightgraph tune` measure, as dictionaries."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from . import _apart
from ._values import pixels, texts

__all__ = ["bench", "tune"]

Paths = Iterable[str | os.PathLike[str]]


def bench(
    graphs: Paths,
    scenes: Paths,
    sweep: Mapping[str, Sequence[Any]] | None = None,
    *,
    out: str | os.PathLike[str],
    size: Sequence[int] = (128, 128),
    repeat: int = 3,
    seconds: float = 0.5,
    rounds: int = 1,
    phases: Iterable[str] = (),
    references: str | os.PathLike[str] | None = None,
    shard: tuple[int, int] | None = None,
    resume: bool = False,
    shaders: Paths = (),
) -> dict[str, Any]:
    """Times every graph on every scene, at its defaults and at all combinations of `sweep` (values by parameter), and
    returns what `lightgraph bench` writes to `OUT/results.json`: under `entries` the times, errors and memory of each.

    A scene is `"FILE"` or `"FILE:CAMERA"`. `references` is a folder with `references.json`, as docs/references.md says;
    without one there are times and no errors. `shard=(2, 8)` measures the second of eight parts, which
    `lightgraph bench --merge` joins. `size` is in pixels, `seconds` is when a phase in which something moves ends.
    docs/bench.md says what is measured and how.

    Runs in a process of its own. Raises `GraphError` with every fault before anything is measured; what a graph can't
    do on a scene is its entry's `fault`.
    """
    width, height = pixels(size)
    words = ["bench", "--out", os.fspath(out), "--size", f"{width}x{height}"]
    words += [f"--repeat={int(repeat)}", f"--seconds={float(seconds)}", f"--rounds={int(rounds)}"]
    words += [f"--graphs={_one('graphs', graph)}" for graph in _several("graphs", graphs)]
    words += [f"--scenes={_beside(_one('scenes', scene))}" for scene in _several("scenes", scenes)]
    words += [f"--sweep={_swept(sweep or {})}", *(f"--phases={phase}" for phase in phases)]
    words += [f"--shaders={os.fspath(folder)}" for folder in shaders]
    if references is not None:
        words.append(f"--references={os.fspath(references)}")
    if shard is not None:
        number, of = shard
        words.append(f"--shard={int(number)}/{int(of)}")
    if resume:
        words.append("--resume")
    _apart.run(words)
    return json.loads(Path(out, "results.json").read_text(encoding="utf-8"))


def tune(
    scene: str | os.PathLike[str],
    *,
    out: str | os.PathLike[str],
    budget: float | None = None,
    error: float | None = None,
    graphs: Paths = (),
    sweep: Mapping[str, Sequence[Any]] | None = None,
    size: Sequence[int] = (640, 360),
    camera: str | None = None,
    reference_seconds: float = 30.0,
    shaders: Paths = (),
) -> dict[str, Any]:
    """Chooses the graph and the setting for a scene, on this machine, and writes them to `out` as a variant (`.ron`),
    which `Renderer` takes as a graph.

    With `budget` (milliseconds) the least error of what renders a frame in this time, with `error` (percent) the
    fastest of what errs no more, without both the least product. All are held against a path tracer's image, made in
    `reference_seconds`. `graphs` and `sweep` (values by parameter) name what is tried in place of the usual; each
    graph's defaults are always tried.

    Returns `candidates`, each with `graph`, `setting`, `ms`, `rmse_percent` and whether it is `unbeaten`; `chosen`, the
    index of one of them; `reference`, how good it is; `variant`, the file. Raises `GraphError` where nothing serves.
    """
    if budget is not None and error is not None:
        raise TypeError("give one of `budget` and `error`")
    width, height = pixels(size)
    words = ["tune", "--json", "--scene", os.fspath(scene), "--out", os.fspath(out), "--size", f"{width}x{height}"]
    words += [f"--reference-seconds={float(reference_seconds)}"]
    words += [f"--graphs={_one('graphs', graph)}" for graph in _several("graphs", graphs)]
    words += [f"--shaders={os.fspath(folder)}" for folder in shaders]
    given = {"budget": budget, "error": error}
    words += [f"--{name}={float(value)}" for name, value in given.items() if value is not None]
    if camera is not None:
        words.append(f"--camera={camera}")
    if sweep is not None:
        words.append(f"--sweep={_swept(sweep)}")
    return json.loads(_apart.run(words))


def _several(name: str, paths: Paths) -> list[str]:
    if isinstance(paths, (str, os.PathLike)):
        raise TypeError(f"{name} = {paths!r}: give a list of paths")
    return [os.fspath(path) for path in paths]


def _one(name: str, path: str) -> str:
    if "," in path:
        raise ValueError(f"{name} hold {path!r}: a path here can't have a comma")
    return path


def _beside(scene: str) -> str:
    """A path: the command looks for a name alone among the scenes of the repository."""
    return scene if "/" in scene else f"./{scene}"


def _swept(sweep: Mapping[str, Sequence[Any]]) -> str:
    """As `--sweep` takes it."""
    axes = []
    for name, values in sweep.items():
        if isinstance(values, str) or not isinstance(values, Iterable):
            raise TypeError(f"sweep[{name!r}] = {values!r}: give a list of values")
        written = [texts({name: value})[0].split("=", 1)[1] for value in values]
        for text in written:
            if ";" in text or ("," in text and not text.startswith("(")):
                raise ValueError(f"sweep[{name!r}] holds {text!r}: a value here has no comma or semicolon")
        axes.append(f"{name}={','.join(written)}")
    return ";".join(axes)
