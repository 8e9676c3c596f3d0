"""How much two workers gain, and what the scheduler takes: the same views in this process, on one worker and on two.

`python scaling.py SCENE [COUNT [SIZE]]`

Each process is given one thread of Mesa's software driver (`LP_NUM_THREADS=1`), so that a worker is a core; GPUs take
no notice. All workers have started and opened their device before the clock does, as this process has. Processor time
is that of this process, in which the scheduler runs, and of all workers: what it grows by is what scheduling takes.
"""

import os
import sys
import tempfile
import time

import dask
import distributed
import psutil

import lightgraph as lg

GRAPH = "lightgraph:graphs/gi/fast_grid.ron"
# Dask looks after workers that share a machine with what they render less often, as without a `client`.
SELDOM = {
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "5s",
}


def opened(scene: str) -> lg.Camera:
    """Opens the device of this process; the scene's camera."""
    return lg.Renderer(GRAPH, scene, (8, 8)).camera


def main(scene: str, count: int = 200, size: int = 256) -> dict[str, tuple[float, float]]:
    """By who rendered: seconds, and seconds of processors."""
    middle = opened(scene)
    eyes = [(middle.eye[0] + 0.2 * (i / count - 0.5), *middle.eye[1:]) for i in range(count)]
    views = [
        lg.View(f"v{i:03}", GRAPH, scene, lg.Camera(eye, middle.target, middle.fov), (size, size))
        for i, eye in enumerate(eyes)
    ]
    found = {}

    def timed(name: str, client: object, workers: list[int]) -> None:
        processes = [psutil.Process(pid) for pid in (os.getpid(), *workers)]

        def spent() -> float:
            return sum(sum(process.cpu_times()[:2]) for process in processes)

        with tempfile.TemporaryDirectory() as folder:
            start, before = time.perf_counter(), spent()
            lg.render_many(views, out=folder, client=client, progress=False)
            found[name] = time.perf_counter() - start, spent() - before
        seconds, cpu = found[name]
        gain, more = found["this process"][0] / seconds, cpu / found["this process"][1] - 1
        print(f"{name:<14} {seconds:8.2f} s, {gain:.2f} ×; {cpu:.2f} s of processors, {more:+.1%}", flush=True)

    dask.config.set(SELDOM)
    timed("this process", False, [])
    print(f"load {os.getloadavg()[0]:.1f} besides")
    for workers in (1, 2):
        options = {"n_workers": workers, "threads_per_worker": 2, "dashboard_address": None}
        with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
            client.wait_for_workers(workers)
            client.run(opened, scene)
            timed(f"{workers} worker{'s' * (workers > 1)}", client, list(client.run(os.getpid).values()))
    return found


if __name__ == "__main__":
    # Before a device is opened, here and in the workers.
    os.environ["LP_NUM_THREADS"] = "1"
    main(sys.argv[1], *map(int, sys.argv[2:4]))
