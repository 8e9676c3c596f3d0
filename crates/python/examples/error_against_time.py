"""Error against time of three graphs on one scene, as a picture.

`python error_against_time.py SCENE OUT.png [SAMPLES]`
"""

import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import lightgraph as lg

GRAPHS = ["fast_grid", "facing_probes", "inset_grid"]
SIZE = (64, 64)


def main(scene: str, out: str, samples: int = 64) -> None:
    tracer = lg.Renderer("lightgraph:graphs/gi/pathtrace.ron", scene, SIZE, samples=samples)
    references = {scene: tracer.frame()["color"]}
    names = [f"lightgraph:graphs/gi/{name}.ron" for name in GRAPHS]
    settings = {"grid": [(2, 2, 2), (3, 3, 3), (4, 4, 4)], "bounces": [4]}
    with tempfile.TemporaryDirectory() as folder:
        entries = lg.sweep(names, [scene], settings, out=folder, client=False, size=SIZE, references=references)
    figure, axes = plt.subplots(figsize=(6, 4))
    for graph, name in zip(names, GRAPHS):
        own = [e for e in entries if e["graph"] == graph]
        axes.plot([1e3 * e["seconds"] for e in own], [e["error"]["rmse_percent"] for e in own], "o-", label=name)
    axes.set(xscale="log", xlabel="one frame from nothing, ms", ylabel="error of color, % of the mean")
    axes.legend()
    figure.savefig(out, dpi=120, bbox_inches="tight")


if __name__ == "__main__":
    main(*sys.argv[1:3], *map(int, sys.argv[3:4]))
