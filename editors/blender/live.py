"""Frames drawn by a thread of their own, so that Blender waits for nothing. Needs no Blender."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import lightgraph as lg
import numpy as np

from .content import Content

# Seconds between two looks at whether a frame has arrived.
NAP = 0.001

# Seconds that a frame may take.
PATIENCE = 120

# Seconds that things are left alone before the scene's bounds are found anew.
REST = 0.3


@dataclass(frozen=True, eq=False)
class Job:
    """What is to be seen."""

    content: Content
    camera: Mapping[str, Any]
    """Of `lightgraph.Camera`."""
    size: tuple[int, int]
    graph: str
    params: Mapping[str, Any] = field(default_factory=dict)
    outputs: tuple[str, ...] = ("color",)
    rounds: int = 1
    """Frames at most; a graph whose image no longer changes ends earlier."""
    time: float = 0.0
    final: bool = False
    """Nothing comes after it that might move on."""


@dataclass(frozen=True, eq=False)
class Picture:
    """What there is to show for a job."""

    job: Job
    round: int
    """Frames that went into it."""
    images: dict[str, np.ndarray]
    ended: bool
    """Nothing more comes of this job."""
    faults: tuple[lg.Fault, ...] = ()
    error: str = ""
    """Why there is no image, in one line; the images are then the last good ones."""
    milliseconds: float = 0.0
    """From the job to its first frame's submission."""


class Live:
    """A renderer that follows the last job given to it. `changed` is called from its thread after each picture."""

    def __init__(self, changed: Callable[[], None] | None = None) -> None:
        self._changed = changed or (lambda: None)
        self._condition = threading.Condition()
        self._wanted: Job | None = None
        self._stopped = False
        self._picture: Picture | None = None
        self._renderer: lg.Renderer | None = None
        self._shown: Content | None = None
        self._stamp: tuple = ()
        self._made: tuple = ()
        self._params: dict[str, Any] = {}
        # Milliseconds from the job to its first submission.
        self._taken: float | None = None
        # What the renderer's scene was made of, before things were placed.
        self._laid: Content | None = None
        # Something was placed since the scene's bounds were found.
        self._loose = False
        self._thread = threading.Thread(target=self._run, name="lightgraph", daemon=True)
        self._thread.start()

    def draw(self, job: Job) -> None:
        """Draws this from now on, and returns at once."""
        with self._condition:
            self._wanted = job
            self._condition.notify_all()

    @property
    def picture(self) -> Picture | None:
        """What there is to show."""
        return self._picture

    def wait(self, job: Job, cancelled: Callable[[], bool], progress: Callable[[float], None]) -> Picture | None:
        """Draws a job to its end. None when cancelled."""
        self.draw(job)
        seen = 0
        while not cancelled():
            with self._condition:
                self._condition.wait(0.05)
            picture = self._picture
            if picture is not None and picture.job is job:
                if picture.ended:
                    return picture
                if picture.round != seen:
                    seen = picture.round
                    progress(seen / job.rounds)
            if not self._thread.is_alive():
                return None
        self.draw_nothing()
        return None

    def draw_nothing(self) -> None:
        """Ends the job after its present frame."""
        with self._condition:
            self._wanted = None

    def stop(self) -> None:
        """Ends the thread. It is not waited for: a frame may be under way."""
        with self._condition:
            self._stopped, self._wanted = True, None
            self._condition.notify_all()

    def _run(self) -> None:
        while True:
            with self._condition:
                while self._wanted is None and not self._stopped:
                    self._condition.wait()
                if self._stopped:
                    return
                job = self._wanted
            self._draw(job)
            with self._condition:
                if self._wanted is job:
                    self._wanted = None

    def _draw(self, job: Job) -> None:
        start = time.perf_counter()
        last = self._picture.images if self._picture is not None else {}
        try:
            renderer = self._follow(job)
            self._taken = None
            while not self._drawn(job, renderer, start):
                continue
        except lg.GraphError as error:
            faults = tuple(f for f in error.faults if f.severity == "error")
            line = faults[0].message if faults else str(error)
            self._failed(job, last, line, faults)
        except (ValueError, TypeError, OSError, MemoryError) as error:
            self._failed(job, last, str(error))
        except BaseException as error:
            # A panic of the library: whoever draws next begins anew.
            self._failed(job, last, f"lightgraph failed: {error}")

    def _drawn(self, job: Job, renderer: lg.Renderer, start: float) -> bool:
        """Draws the frames of a job; False where it is to be drawn again, in other bounds."""
        images = {}
        for round_ in range(1, job.rounds + 1):
            before = images
            flight = renderer.submit(job.time, job.outputs)
            if self._taken is None:
                self._taken = (time.perf_counter() - start) * 1e3
            end = time.monotonic() + PATIENCE
            while not flight.ready() and time.monotonic() < end:
                time.sleep(NAP)
            # One that isn't ready now is waited for a last time, and said to be lost.
            images = flight.result()
            loose = round_ == 1 and self._loose
            ended = not loose and (round_ == job.rounds or _alike(images, before))
            self._publish(Picture(job, round_, images, ended, milliseconds=self._taken))
            if loose and self._wanted is job:
                if not self._rested(job):
                    return True
                if not self._bounded(job, renderer):
                    return False
                if job.rounds == 1:
                    self._publish(Picture(job, round_, images, True, milliseconds=self._taken))
            if ended or self._wanted is not job:
                return True
        return True

    def _rested(self, job: Job) -> bool:
        """Waits whether anything moves on."""
        end = time.monotonic() + (0 if job.final else REST)
        with self._condition:
            while self._wanted is job and (left := end - time.monotonic()) > 0:
                self._condition.wait(left)
            return self._wanted is job

    def _bounded(self, job: Job, renderer: lg.Renderer) -> bool:
        """Whether everything is within the bounds that the renderer knows, and they are no larger; makes it so."""
        self._loose = False
        before, self._laid = self._laid, job.content
        if before is not None and job.content.bounds() == before.bounds():
            return True
        renderer.scene = job.content.scene()
        return False

    def _failed(self, job: Job, images: dict, error: str, faults: tuple[lg.Fault, ...] = ()) -> None:
        self._renderer, self._shown = None, None
        self._publish(Picture(job, 0, images, True, faults, error or "lightgraph failed"))

    def _publish(self, picture: Picture) -> None:
        with self._condition:
            self._picture = picture
            self._condition.notify_all()
        self._changed()

    def _follow(self, job: Job) -> lg.Renderer:
        """The renderer, as the job has it."""
        stamp = stamps(job.graph)
        renderer = self._renderer
        made = (job.graph, job.outputs)
        # A parameter that is no longer set has its default again, which a new renderer knows.
        unset = self._params.keys() - job.params.keys()
        if renderer is None or self._made != made or stamp != self._stamp or unset:
            self._renderer = None
            scene = job.content.scene()
            renderer = lg.Renderer(job.graph, scene, job.size, outputs=job.outputs, **job.params)
            self._laid, self._loose = job.content, False
            self._made, self._stamp, self._params = made, stamp, dict(job.params)
        else:
            self._renderer = None
            if renderer.size != job.size:
                renderer.size = job.size
            changed = {n: v for n, v in job.params.items() if self._params.get(n) != v}
            if changed:
                renderer.set(**changed)
                self._params.update(changed)
            if not job.content.fits(self._shown):
                renderer.scene = job.content.scene()
                self._laid, self._loose = job.content, False
            else:
                moved = job.content.moved(self._shown)
                if moved:
                    renderer.place(moved)
                    self._loose = True
        renderer.camera = lg.Camera(**job.camera)
        self._renderer, self._shown = renderer, job.content
        return renderer


def _alike(images: dict[str, np.ndarray], before: dict[str, np.ndarray]) -> bool:
    return images.keys() == before.keys() and all(np.array_equal(images[n], before[n], equal_nan=True) for n in images)


def stamps(graph: str) -> tuple:
    """When the files of a graph were last written: its own, those beside it, and the shaders that it may take."""
    if graph.startswith("lightgraph:"):
        return ()
    folder = Path(graph).parent
    shaders = [f / "shaders" for f in (folder, folder.parent, folder.parent.parent)]
    found = []
    for paths in (folder.glob("*.ron"), *(f.rglob("*.wgsl") for f in shaders)):
        for path in paths:
            try:
                status = path.stat()
            except OSError:
                continue
            found.append((str(path), status.st_mtime_ns, status.st_size))
    return tuple(sorted(found))
