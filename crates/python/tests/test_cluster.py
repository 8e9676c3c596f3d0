"""Sweeps and views on workers: in this process, on a loopback cluster, with a worker killed, resumed."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time

import distributed
import numpy as np
import pytest

import lightgraph as lg

GRAPHS = ["lightgraph:graphs/gi/direct.ron", "lightgraph:graphs/gi/fast_grid.ron"]
SETTINGS = {"grid": [(1, 1, 1), (2, 2, 2)], "bounces": [0, 1, 2, 4]}


# Of a worker with VICTIM set: its first task waits until another's entry is in that journal, and ends the process.
PRELOAD = """
import os, pathlib, signal, time
import lightgraph.cluster

def dies(*args):
    journal = pathlib.Path(os.environ["VICTIM"])
    while not (journal.exists() and journal.stat().st_size):
        time.sleep(0.01)
    os.kill(os.getpid(), signal.SIGKILL)

if "VICTIM" in os.environ:
    lightgraph.cluster._measured = dies
"""


@contextlib.contextmanager
def started(folder, victim=None):
    """A scheduler and two workers on loopback, both ready: the scheduler's address, and the first worker's process,
    which dies in its first task of a sweep that writes to the folder `victim`."""
    file, preload, log = folder / "scheduler.json", folder / "preload.py", folder / "cluster.log"
    preload.write_text(PRELOAD)
    processes = []

    def start(program, *args, **env):
        command = [sys.executable, "-m", f"distributed.cli.{program}", "--scheduler-file", file, "--no-dashboard"]
        command = [str(c) for c in (*command, *args)]
        with open(log, "a") as to:
            processes.append(subprocess.Popen(command, stdout=to, stderr=to, env={**os.environ, **env}))

    try:
        start("dask_scheduler", "--host", "127.0.0.1", "--port", "0")
        worker = ("--host", "127.0.0.1", "--nthreads", "1", "--no-nanny", "--preload", preload)
        start("dask_worker", *worker, **({"VICTIM": str(victim / "entries.jsonl")} if victim else {}))
        start("dask_worker", *worker)
        until = time.monotonic() + 120
        while not (file.exists() and file.stat().st_size):
            assert time.monotonic() < until, log.read_text()
            time.sleep(0.1)
        address = json.loads(file.read_text())["address"]
        with distributed.Client(address) as client:
            client.wait_for_workers(2, timeout=120)
        yield address, processes[1]
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """The address of a scheduler with two workers."""
    with started(tmp_path_factory.mktemp("cluster")) as (address, _):
        yield address


def errors(entries):
    return [(e["graph"], e["settings"], e["mean"], e["error"]) for e in entries]


def lines(folder):
    return [json.loads(line) for line in (folder / "entries.jsonl").read_text().splitlines()]


@pytest.fixture
def swept(scenes, tmp_path):
    """Sweeps two graphs over eight settings, against one image."""
    scene = scenes / "cornell_point.gltf"
    truth = lg.Renderer(GRAPHS[1], scene, (24, 16), grid=(3, 3, 3)).frame()["color"]
    lg.write(tmp_path / "truth.exr", truth)

    def run(out, **more):
        return lg.sweep(GRAPHS, [scene], SETTINGS, out=tmp_path / out, size=(24, 16), references={scene: truth}, **more)

    return run


def test_a_killed_worker_loses_and_doubles_nothing(swept, tmp_path):
    alone = swept("alone", client=False)
    assert len(alone) == 9, "`direct` has none of the parameters and is rendered once"
    with started(tmp_path, victim=tmp_path / "many") as (address, victim):
        many = swept("many", client=address)
        assert victim.wait(timeout=60) == -signal.SIGKILL
    assert errors(many) == errors(alone)
    keys = [entry["key"] for entry in lines(tmp_path / "many")]
    assert len(keys) == len(set(keys)) == 9
    assert victim.pid not in {entry["worker"] for entry in many}


def test_a_killed_client_s_sweep_is_resumed(swept, cluster, scenes, tmp_path):
    alone = swept("alone", client=False)
    scene = scenes / "cornell_point.gltf"
    script = f"""
import os, signal
import lightgraph as lg
from lightgraph import cluster

class Dies(cluster._Progress):
    def step(self):
        super().step()
        if self.done == 3:
            os.kill(os.getpid(), signal.SIGKILL)

cluster._Progress = Dies
lg.sweep({GRAPHS!r}, [{str(scene)!r}], {SETTINGS!r}, out={str(tmp_path / "cut")!r}, client={cluster!r},
         size=(24, 16), references={{{str(scene)!r}: lg.read({str(tmp_path / "truth.exr")!r})}})
"""
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", script], capture_output=True, text=True, timeout=300)
    assert done.returncode == -signal.SIGKILL, done.stderr
    kept = lines(tmp_path / "cut")
    assert len(kept) == 3
    again = swept("cut", client=cluster, resume=True)
    assert errors(again) == errors(alone)
    after = lines(tmp_path / "cut")
    assert after[:3] == kept and len({entry["key"] for entry in after}) == len(after) == 9


def test_a_sweep_goes_on_where_it_was_stopped(swept, cluster, tmp_path):
    whole = swept("out", client=False)
    path = tmp_path / "out" / "entries.jsonl"
    text = path.read_text().splitlines(keepends=True)
    path.write_text("".join(text[:4]) + text[4][: len(text[4]) // 2])
    with pytest.raises(FileExistsError, match="resume=True"):
        swept("out", client=False)
    again = swept("out", client=cluster, resume=True)
    assert errors(again) == errors(whole)
    assert [e["worker"] for e in again[:4]] == [os.getpid()] * 4
    assert os.getpid() not in {e["worker"] for e in again[4:]}
    # Where nothing is left to do nobody is asked.
    assert swept("out", client="tcp://127.0.0.1:1", resume=True) == again


def test_views_become_files(scenes, cluster, tmp_path):
    scene = scenes / "cornell_point.gltf"
    cameras = [lg.Camera((x, 1.0, 3.0), (0.0, 1.0, 0.0)) for x in (-0.3, 0.0, 0.3)]
    views = [
        lg.View(f"v{i}", GRAPHS[0], scene, c, (24, 16), outputs=["color", "direct"]) for i, c in enumerate(cameras)
    ]
    entries = lg.render_many(views, out=tmp_path / "views", client=cluster)
    assert [e["name"] for e in entries] == ["v0", "v1", "v2"]
    for view, entry in zip(views, entries):
        image = lg.Renderer(GRAPHS[0], scene, (24, 16), camera=view.camera).frame()["color"]
        np.testing.assert_array_equal(lg.read(tmp_path / "views" / entry["files"]["color"]), image)
    kept = lg.render_many(views, out=tmp_path / "kept", client=False, keep=True)
    assert [e["files"] for e in kept] == [e["files"] for e in entries]


def test_parts_of_an_average_are_one_run(scenes, cluster, tmp_path):
    scene, graph = scenes / "cornell_point.gltf", "lightgraph:graphs/gi/pathtrace.ron"
    more = {"size": (24, 16), "frames": 2, "samples": 8}
    mean, error = lg.average(graph, scene, range(4), out=tmp_path / "parts", client=cluster, **more)
    parts = [lg.read(tmp_path / "parts" / f"seed_{seed}.color.exr").astype(float) for seed in range(4)]
    np.testing.assert_allclose(mean, np.mean(parts, axis=0), rtol=1e-14)
    np.testing.assert_allclose(error, np.std(parts, axis=0, ddof=1) / 2, rtol=1e-9, atol=1e-15)
    alone, _ = lg.average(graph, scene, range(4), out=tmp_path / "alone", client=False, **more)
    np.testing.assert_array_equal(alone, mean)
    # One run of as many paths, by a seed of its own.
    r = lg.Renderer(graph, scene, (24, 16), samples=8, seed=9)
    for _ in range(8):
        one = r.frame()["color"]
    lit = error[..., :3] > 0
    # Its error is as large as that of the mean; three parts of freedom make wide tails, which the median leaves out.
    off = np.abs(one - mean)[..., :3][lit] / error[..., :3][lit]
    assert np.median(off) < 2.0
    bias = (one - mean)[..., :3].mean() / np.sqrt((error[..., :3] ** 2).mean() / lit.sum() * 2)
    assert abs(bias) < 6.0
    with pytest.raises(ValueError, match="`seed`"):
        lg.average(GRAPHS[0], scene, range(4), out=tmp_path / "no")


def test_what_is_wrong_is_said(scenes, tmp_path):
    scene = scenes / "cornell_point.gltf"
    with pytest.raises(ValueError, match="`bouncs`"):
        lg.sweep(GRAPHS, [scene], {"bouncs": [1]}, out=tmp_path, client=False)
    with pytest.raises(TypeError, match="list of values"):
        lg.sweep(GRAPHS, [scene], {"bounces": 1}, out=tmp_path, client=False)
    with pytest.raises(ValueError, match="no scene of the sweep"):
        lg.sweep(GRAPHS, [scene], {"bounces": [1]}, out=tmp_path, references={"hall": "hall.exr"})
    [entry] = lg.sweep(GRAPHS[1:], [scene], [{"bounces": 10**9}], out=tmp_path / "a", client=False)
    assert "bounces" in entry["fault"]
    view = lg.View("a", GRAPHS[0], scene)
    with pytest.raises(ValueError, match="two views"):
        lg.render_many([view, view], out=tmp_path / "b")
    with pytest.raises(ValueError, match="View.name"):
        lg.render_many([lg.View("../a", GRAPHS[0], scene)], out=tmp_path / "b")


def test_a_panic_on_a_worker_ends_in_an_error():
    class PanicException(BaseException):
        pass

    def panics():
        raise PanicException("out of range")

    from lightgraph.cluster import _tried

    with pytest.raises(RuntimeError, match="PanicException: out of range"):
        _tried({}, panics)
