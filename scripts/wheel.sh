#!/usr/bin/env bash
# Builds the wheel of the Python module, to target/wheels, and uses it as others do: in an environment of its own, away
# from the repository.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

wheels=$PWD/target/wheels
rm -f "$wheels"/lightgraph-*.whl
target/python/venv/bin/maturin build --quiet --release --manifest-path crates/python/Cargo.toml --out "$wheels"
away=$(mktemp -d)
trap 'rm -rf "$away"' EXIT
target/python/venv/bin/python -m venv "$away/venv"
"$away/venv/bin/pip" install --quiet --disable-pip-version-check "$wheels"/lightgraph-*.whl
cd "$away"
venv/bin/lightgraph --version
venv/bin/lightgraph check lightgraph:graphs/gi/fast_grid.ron
venv/bin/python - <<'PYTHON'
import numpy as np

import lightgraph as lg

assert "site-packages" in lg.__file__, lg.__file__
graphs = lg.builtin_graphs()
assert len(graphs) > 20, graphs
for graph in graphs:
    faults = [f for f in lg.check(graph) if f.severity == "error"]
    assert not faults, f"{graph}: {faults[0]}"
floor = lg.Mesh([[-2, 0, -2], [-2, 0, 2], [2, 0, 2], [2, 0, -2]], [[0, 1, 2], [0, 2, 3]])
wall = lg.Mesh([[-2, 0, -2], [2, 0, -2], [2, 3, -2], [-2, 3, -2]], [[0, 1, 2], [0, 2, 3]])
scene = lg.Scene.from_arrays(
    {"floor": floor, "wall": wall}, lg.PointLight((0, 2, 1), 50), lg.Camera((0, 1.5, 5), (0, 1, 0))
)
r = lg.Renderer("lightgraph:graphs/gi/fast_grid.ron", scene, (64, 48), grid=(3, 3, 3))
images = r.frame(outputs=["direct", "indirect"])
assert all(np.isfinite(image).all() and image.max() > 0 for image in images.values())
print(f"{len(graphs)} graphs came with the wheel; fast_grid renders on {lg.adapter()[0]}")
PYTHON
ls -l "$wheels"
