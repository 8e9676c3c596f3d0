"""Many renders on many processes and machines, by Dask distributed."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import platform
import re
import sys
import threading
import time as clock
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .errors import GraphError
from .renderer import Renderer
from .scene import Camera
from .tools import compare, parameters, read, write

__all__ = ["View", "average", "render_many", "sweep"]

Entry = dict[str, Any]
_JOURNAL = "entries.jsonl"
# Workers of this machine share its cores with what they render: Dask looks after them less often than it would.
_SELDOM = {
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "5s",
}
_made: dict[tuple[str, str | None, tuple[int, ...]], tuple[Renderer, dict[str, Any]]] = {}

# Held by the thread of this process that renders.
_turn = threading.Lock()


@dataclass(frozen=True)
class View:
    """One picture of `render_many`. `name` is the stem of its files, and must be its own.

    `graph` and `scene` are what `Renderer` takes, as paths that every worker can read; `params` are parameters of the
    graph, `time` is in seconds, `size` is (width, height) in pixels. Of `frames` frames the last is kept, for graphs
    that accumulate.
    """

    name: str
    graph: str | os.PathLike[str]
    scene: str | os.PathLike[str] | None = None
    camera: Camera | str | None = None
    size: Sequence[int] = (640, 480)
    time: float = 0.0
    outputs: Sequence[str] = ("color",)
    params: Mapping[str, Any] = field(default_factory=dict)
    frames: int = 1


def sweep(
    graphs: Iterable[str | os.PathLike[str]],
    scenes: Iterable[str | os.PathLike[str]],
    settings: Mapping[str, Sequence[Any]] | Sequence[Mapping[str, Any]],
    *,
    out: str | os.PathLike[str],
    client: Any = None,
    size: Sequence[int] = (128, 128),
    frames: int = 1,
    output: str = "color",
    references: Mapping[Any, Any] | None = None,
    resume: bool = False,
    workers: int | None = None,
    progress: bool | None = None,
) -> list[Entry]:
    """Renders every graph on every scene at every setting, and returns an entry for each, in this order.

    `settings`: values by parameter, of which all combinations are made and each graph takes the parameters that it has;
    or a list of dictionaries, each taken as it is. Each entry has `graph`, `scene`, `settings`, `mean` (of the output),
    `seconds` (of `frames` frames, from nothing), `worker`, `machine`, `adapter` and `load`; with `references` (by
    scene: a path of an OpenEXR file or an array) also `error`, what `compare` returns. What a graph can't do on a scene
    is its entry's `fault`, and no reason to stop.

    Entries are appended to `OUT/entries.jsonl` as they come. With `resume` those that are there are kept and not
    rendered again.

    `client`: a `distributed.Client`, the address of a scheduler, None for `workers` processes on this machine (one for
    each core), or False for this process alone. Scenes, graphs and references are read by the workers: give paths that
    all of them see.

    Raises `FileExistsError` where `out` has entries and `resume` is not set, and `RuntimeError` at the end where tasks
    were lost with their workers; the rest is kept.
    """
    graphs_, scenes_ = [os.fspath(g) for g in graphs], [os.fspath(s) for s in scenes]
    if frames < 1:
        raise ValueError(f"frames = {frames}: give at least 1")
    given = {os.fspath(s): r if isinstance(r, np.ndarray) else os.fspath(r) for s, r in (references or {}).items()}
    for scene in given:
        if scene not in scenes_:
            raise ValueError(f"references[{scene!r}] is of no scene of the sweep: the keys are {', '.join(scenes_)}")
    combinations = {graph: _combinations(settings, graph) for graph in graphs_}
    if isinstance(settings, Mapping) and graphs_:
        known = {name for all_ in combinations.values() for one in all_ for name in one}
        for name in settings:
            if name not in known:
                raise ValueError(f"settings[{name!r}]: no graph of the sweep has the parameter `{name}`")
    tasks = {}
    for scene, graph in itertools.product(scenes_, graphs_):
        for one in combinations[graph]:
            what = {
                "graph": graph,
                "scene": scene,
                "settings": _plain(one),
                "size": [int(n) for n in size],
                "frames": frames,
                "output": output,
            }
            tasks[_key(what)] = (_measured, (what, given.get(scene)))
    # One thread: times are measured.
    return _run(tasks, client, Path(out), resume, (workers, 1), progress)


def render_many(
    views: Iterable[View],
    *,
    out: str | os.PathLike[str],
    client: Any = None,
    keep: bool = False,
    resume: bool = False,
    workers: int | None = None,
    progress: bool | None = None,
) -> list[Entry]:
    """Renders views to `OUT/NAME.OUTPUT.exr` (32-bit floats, linear), written by the workers: they must see the folder
    `out` as you do.

    Returns an entry for each view, in their order, with `files` by output; entries are appended to `OUT/entries.jsonl`
    as they come. `client`, `resume`, `workers` and what is raised are those of `sweep`.

    Each view begins from nothing, so that it does not matter which worker renders it. With `keep` a worker keeps its
    state from view to view: light that does not depend on the camera is computed once. Leave it off for graphs that
    accumulate over frames.
    """
    folder, tasks, seen = Path(out).absolute(), {}, set()
    for view in views:
        if not isinstance(view, View):
            raise TypeError(f"views hold a {type(view).__name__}: give lightgraph.View")
        if not re.fullmatch(r"[\w-][\w.-]*", view.name):
            raise ValueError(
                f"View.name = {view.name!r}: give letters, digits, `_`, `-` and `.`, since files are named after it"
            )
        if view.name in seen:
            raise ValueError(f"two views have the name {view.name!r}: give each its own")
        if view.frames < 1:
            raise ValueError(f"View.frames = {view.frames}: give at least 1")
        seen.add(view.name)
        what = {
            "name": view.name,
            "graph": os.fspath(view.graph),
            "scene": None if view.scene is None else os.fspath(view.scene),
            "settings": _plain(view.params),
            "size": [int(n) for n in view.size],
            "time": float(view.time),
            "outputs": list(view.outputs),
            "camera": _seen_from(view.camera),
            "frames": view.frames,
        }
        tasks[_key(what)] = (_rendered, (what, view, os.fspath(folder), keep))
    return _run(tasks, client, folder, resume, (workers, 2), progress)


def average(
    graph: str | os.PathLike[str],
    scene: str | os.PathLike[str],
    seeds: Iterable[int],
    *,
    out: str | os.PathLike[str],
    frames: int = 1,
    output: str = "color",
    camera: Camera | str | None = None,
    size: Sequence[int] = (128, 128),
    client: Any = None,
    resume: bool = False,
    workers: int | None = None,
    progress: bool | None = None,
    **params: Any,
) -> tuple[np.ndarray, np.ndarray]:
    """The mean of a graph's image over seeds, a part of `frames` frames for each, and the standard error of this mean:
    float64 of the shape (height, width, channels). The graph must have a parameter `seed`, as
    `lightgraph:graphs/gi/pathtrace.ron` does.

    The parts are `OUT/seed_N.OUTPUT.exr`, rendered as `render_many` does; further seeds are added by `resume`. Their
    mean is the same to the last bit, however many workers there were.
    """
    all_ = sorted(dict.fromkeys(int(seed) for seed in seeds))
    if len(all_) < 2:
        raise ValueError(f"seeds = {all_}: give at least two, the standard error comes from how parts differ")
    if "seed" not in parameters(graph):
        raise ValueError(f"{os.fspath(graph)} has no parameter `seed`: its images are all the same")
    views = [
        View(
            f"seed_{seed}",
            graph,
            scene,
            camera,
            size,
            outputs=(output,),
            params={**params, "seed": seed},
            frames=frames,
        )
        for seed in all_
    ]
    entries = render_many(views, out=out, client=client, resume=resume, workers=workers, progress=progress)
    for entry in entries:
        if "fault" in entry:
            raise RuntimeError(f"{entry['name']} could not be rendered: {entry['fault']}")
    # Welford: one part at a time in memory.
    mean = squares = np.zeros(())
    for n, entry in enumerate(entries, 1):
        part = read(os.path.join(out, entry["files"][output])).astype(np.float64)
        step = part - mean
        mean = mean + step / n
        squares = squares + step * (part - mean)
    count = len(entries)
    return mean, np.sqrt(squares / (count - 1) / count)


def _combinations(settings: Any, graph: str) -> list[dict[str, Any]]:
    if not isinstance(settings, Mapping):
        return [dict(one) for one in settings] or [{}]
    has = parameters(graph)
    used = {name: values for name, values in settings.items() if name in has}
    for name, values in used.items():
        if isinstance(values, str) or not isinstance(values, Iterable):
            raise TypeError(f"settings[{name!r}] = {values!r}: give a list of values")
    return [dict(zip(used, values)) for values in itertools.product(*used.values())]


def _plain(params: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters as JSON has them."""
    plain = lambda v: v.tolist() if isinstance(v, (np.ndarray, np.generic)) else v  # noqa: E731
    return {name: list(v) if isinstance(v := plain(value), tuple) else v for name, value in params.items()}


def _seen_from(camera: Camera | str | None) -> Any:
    if not isinstance(camera, Camera):
        return camera
    eye, target, up, *rest = camera._look()
    return [list(eye), list(target), list(up), list(rest[0]), *rest[1:]]


def _key(what: Mapping[str, Any]) -> str:
    return json.dumps(what, sort_keys=True)


def _run(
    tasks: dict[str, Any],
    client: Any,
    out: Path,
    resume: bool,
    workers: tuple[int | None, int],
    progress: bool | None,
) -> list[Entry]:
    path = out / _JOURNAL
    found = _kept(path) if path.exists() else {}
    if found and not resume:
        raise FileExistsError(
            f"{path} has entries: give `resume=True` to keep them and go on, or another folder as `out`"
        )
    kept = {key: entry for key, entry in found.items() if key in tasks}
    todo = {key: task for key, task in tasks.items() if key not in kept}
    out.mkdir(parents=True, exist_ok=True)
    bar = _Progress(len(tasks), len(kept), sys.stderr.isatty() if progress is None else progress)
    lost: list[str] = []
    with open(path, "a", encoding="utf-8") as journal:
        if path.stat().st_size and not path.read_bytes().endswith(b"\n"):
            journal.write("\n")
        done = _here(todo, lost) if client is False else _there(todo, client, workers, lost)
        with contextlib.closing(done):
            for key, entry in done:
                kept[key] = entry
                journal.write(json.dumps({"key": key, **entry}) + "\n")
                journal.flush()
                bar.step()
    bar.end()
    if lost:
        raise RuntimeError(
            f"{len(lost)} of {len(tasks)} tasks failed; the rest is in {path}, `resume=True` goes on. "
            f"The first: {lost[0]}"
        )
    return [kept[key] for key in tasks]


def _kept(path: Path) -> dict[str, Entry]:
    """Entries of a journal; a line that was cut off is left out."""
    kept = {}
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        with contextlib.suppress(ValueError, KeyError, TypeError):
            entry = json.loads(line)
            kept[entry.pop("key")] = entry
    return kept


def _here(todo: Mapping[str, Any], lost: list[str]) -> Generator[tuple[str, Entry], None, None]:
    for key, (work, args) in todo.items():
        try:
            entry = work(*args)
        except Exception as error:
            lost.append(f"{type(error).__name__}: {error}")
        else:
            yield key, entry


def _there(
    todo: Mapping[str, Any], client: Any, workers: tuple[int | None, int], lost: list[str]
) -> Generator[tuple[str, Entry], None, None]:
    if not todo:
        return
    try:
        import distributed
    except ImportError as error:
        raise ImportError("`pip install distributed` installs what this needs; `client=False` goes without") from error
    with contextlib.ExitStack() as stack:
        if client is None:
            import dask

            with dask.config.set(_SELDOM):
                count, threads = workers[0] or os.cpu_count(), workers[1]
                cluster = distributed.LocalCluster(
                    n_workers=count, threads_per_worker=threads, dashboard_address=None
                )
            client = stack.enter_context(distributed.Client(stack.enter_context(cluster)))
        elif isinstance(client, str):
            client = stack.enter_context(distributed.Client(client))
        # Earlier tasks first: neighbours are of one graph and scene, and a worker keeps its renderer.
        futures = {
            client.submit(work, *args, pure=False, retries=2, priority=-i): key
            for i, (key, (work, args)) in enumerate(todo.items())
        }
        try:
            for future in distributed.as_completed(futures):
                try:
                    entry = future.result()
                except Exception as error:
                    lost.append(f"{type(error).__name__}: {error}")
                else:
                    yield futures[future], entry
        finally:
            client.cancel(list(futures))


class _Progress:
    def __init__(self, total: int, done: int, shown: bool) -> None:
        self.total, self.done, self.shown = total, done, shown

    def step(self) -> None:
        self.done += 1
        if self.shown:
            print(f"\r{self.done}/{self.total}", end="", file=sys.stderr, flush=True)

    def end(self) -> None:
        if self.shown:
            print(file=sys.stderr)


def _renderer(graph: str, scene: str | None, size: Sequence[int]) -> tuple[Renderer, dict[str, Any]]:
    """This process's renderer, made anew where it is of another graph or scene; and its parameters' defaults. For who
    holds `_turn`."""
    key = (graph, scene, tuple(size))
    if key not in _made:
        # The old one's memory first.
        _made.clear()
        made = Renderer(graph, scene, size)
        _made[key] = (made, made.params)
    return _made[key]


def _tried(what: Mapping[str, Any], work: Callable[[], Entry]) -> Entry:
    try:
        done = work()
    except GraphError as error:
        # Another worker would find the same.
        done = {"fault": str(error)}
    except (Exception, KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:
        # A panic of the native module is no `Exception`: on a worker nobody would hear of it.
        raise RuntimeError(f"{type(error).__name__}: {error}") from error
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {**what, **done, "worker": os.getpid(), "machine": platform.node(), "load": load}


def _measured(what: Mapping[str, Any], reference: Any) -> Entry:
    def work() -> Entry:
        with _turn:
            renderer, defaults = _renderer(what["graph"], what["scene"], what["size"])
            renderer.set(**{**defaults, **what["settings"]})
            renderer.reset()
            start = clock.perf_counter()
            for _ in range(what["frames"]):
                image = renderer.frame(0.0, [what["output"]])[what["output"]]
            seconds, adapter = clock.perf_counter() - start, renderer.stats["adapter"]["name"]
        entry: Entry = {"seconds": seconds, "mean": float(image.mean(dtype=np.float64)), "adapter": adapter}
        if reference is not None:
            truth = read(reference) if isinstance(reference, str) else reference
            entry["error"] = compare(image[..., : truth.shape[-1]], truth)
        return entry

    return _tried(what, work)


def _rendered(what: Mapping[str, Any], view: View, out: str, keep: bool) -> Entry:
    def work() -> Entry:
        with _turn:
            renderer, defaults = _renderer(what["graph"], what["scene"], what["size"])
            renderer.set(**{**defaults, **view.params})
            renderer.camera = view.camera
            if not keep:
                renderer.reset()
            start = clock.perf_counter()
            for _ in range(view.frames):
                images = renderer.frame(view.time, view.outputs)
            seconds, adapter = clock.perf_counter() - start, renderer.stats["adapter"]["name"]
        # Another thread renders while this one waits for the disk.
        files = {output: f"{view.name}.{output}.exr" for output in view.outputs}
        for output, name in files.items():
            write(os.path.join(out, name), images[output])
        return {"files": files, "seconds": seconds, "adapter": adapter}

    return _tried(what, work)
