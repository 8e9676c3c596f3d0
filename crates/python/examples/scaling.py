"""How much two workers gain, and what the scheduler takes: the same views in this process, on one worker and on two.

`python scaling.py SCENE [COUNT]`

Each process is given one thread of Mesa's software driver (`LP_NUM_THREADS=1`), so that a worker is a core; GPUs take
no notice. All workers have started before the clock does; each compiles its graph within the time, as this process
does.
"""

import os
import sys
import tempfile
import time

import distributed

import lightgraph as lg

GRAPH = "lightgraph:graphs/gi/fast_grid.ron"


def main(scene: str, count: int = 200, size: int = 256) -> dict[str, float]:
    """Seconds by who rendered."""
    middle = lg.Renderer(GRAPH, scene, (8, 8)).camera
    eyes = [(middle.eye[0] + 0.2 * (i / count - 0.5), *middle.eye[1:]) for i in range(count)]
    views = [
        lg.View(f"v{i:03}", GRAPH, scene, lg.Camera(eye, middle.target, middle.fov), (size, size))
        for i, eye in enumerate(eyes)
    ]
    found = {}

    def timed(name: str, client: object) -> None:
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            lg.render_many(views, out=folder, client=client, progress=False)
            found[name] = time.perf_counter() - start
        print(f"{name:<14} {found[name]:8.2f} s, {found['this process'] / found[name]:.2f} ×", flush=True)

    timed("this process", False)
    for workers in (1, 2):
        options = {"n_workers": workers, "threads_per_worker": 1, "dashboard_address": None}
        with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
            client.wait_for_workers(workers)
            timed(f"{workers} worker{'s' * (workers > 1)}", client)
    return found


if __name__ == "__main__":
    # Before a device is opened, here and in the workers.
    os.environ["LP_NUM_THREADS"] = "1"
    main(sys.argv[1], *map(int, sys.argv[2:3]))
