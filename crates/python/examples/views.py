"""A data set of random views with colour, depth and normal. Interrupted, it goes on.

`python views.py SCENE FOLDER [COUNT]`
"""

import sys

import numpy as np

import lightgraph as lg

GRAPH = "lightgraph:graphs/gi/fast_grid.ron"
OUTPUTS = ["color", "surface_depth", "surface_normal"]


def main(scene: str, folder: str, count: int = 200) -> None:
    low, high = map(np.array, lg.Scene(scene).bounds)
    middle, half = (low + high) / 2, (high - low) / 2
    random = np.random.default_rng(7)
    views = []
    for i in range(count):
        # Eyes in the middle half of the room, so that few stand in a wall.
        eye = middle + half * random.uniform(-0.5, 0.5, 3)
        target = eye + random.normal(size=3) * (1.0, 0.3, 1.0)
        camera = lg.Camera(tuple(eye), tuple(target), fov=float(random.uniform(40, 80)))
        views.append(lg.View(f"view_{i:04}", GRAPH, scene, camera, (128, 96), outputs=OUTPUTS))
    # Probes do not depend on the camera: a worker computes them once.
    lg.render_many(views, out=folder, keep=True, resume=True)


if __name__ == "__main__":
    main(*sys.argv[1:3], *map(int, sys.argv[3:4]))
