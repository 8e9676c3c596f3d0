"""What several tests need: the repository, its command, a small renderer."""

import os
import pathlib
import subprocess

import pytest

import lightgraph as lg

ROOT = pathlib.Path(__file__).resolve().parents[3]


@pytest.fixture
def scenes():
    return ROOT / "scenes"


@pytest.fixture
def make(scenes):
    """A renderer of the direct light of a Cornell box, 32 pixels wide."""

    def made(graph="lightgraph:graphs/gi/direct.ron", **more):
        return lg.Renderer(graph, scenes / "cornell_point.gltf", **{"size": (32, 24), **more})

    return made


@pytest.fixture
def command():
    """Runs the `lightgraph` command of LIGHTGRAPH, else of the debug build."""
    program = os.environ.get("LIGHTGRAPH", ROOT / "target/debug/lightgraph")
    if not pathlib.Path(program).exists():
        pytest.fail(f"{program} is not there: `cargo build` makes it, LIGHTGRAPH names another")

    def run(*args):
        return subprocess.run([program, *map(str, args)], check=True, capture_output=True, text=True)

    return run
