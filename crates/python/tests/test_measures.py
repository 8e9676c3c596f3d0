"""`bench` and `tune`, and the command that comes with the package."""

import json
import subprocess
import sys

import numpy as np
import pytest

import lightgraph as lg
from lightgraph.measures import _swept

DIRECT, GRID = (f"lightgraph:graphs/gi/{name}.ron" for name in ("direct", "fast_grid"))


@pytest.fixture
def scene(scenes):
    return scenes / "cornell_point.gltf"


def module(*words):
    """Runs `python -m lightgraph`."""
    command = [sys.executable, "-m", "lightgraph", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def test_a_bench_is_what_the_command_writes(scenes, tmp_path):
    work = [DIRECT], [scenes / "cornell_point.gltf", scenes / "furnace.glb"], {"bias": [1.0, 2]}
    more = {"size": (16, 12), "repeat": 1, "phases": ["still"], "references": tmp_path}
    found = lg.bench(*work, out=tmp_path / "whole", **more)
    told = [(e["scene"], e["setting"]) for e in found["entries"]]
    settings = ["", "bias=1.0", "bias=2"]
    assert told == [(scene, setting) for scene in ("cornell_point", "furnace") for setting in settings]
    for entry in found["entries"]:
        assert entry["fault"] is None and [p["phase"] for p in entry["phases"]] == ["first", "still"]
        assert entry["host"]["machine"]["adapter"] == lg.adapter()[0]
    for number in (1, 2):
        part = lg.bench(*work, out=tmp_path / f"part-{number}", shard=(number, 2), **more)
        assert part["part"]["shard"] == {"number": number, "of": 2} and len(part["entries"]) == 3
    done = module("bench", "--merge", tmp_path / "part-1", tmp_path / "part-2", "--out", tmp_path / "joined")
    assert done.returncode == 0, done.stderr
    joined = json.loads((tmp_path / "joined" / "results.json").read_text())
    assert [(e["scene"], e["setting"]) for e in joined["entries"]] == told
    # What is there is not measured again.
    assert lg.bench(*work, out=tmp_path / "whole", resume=True, **more) == found


def test_a_sweep_is_written_as_the_command_reads_it():
    assert _swept({"grid": [(1, 1, 1), 2], "soft": [True]}) == "grid=(1, 1, 1),2;soft=true"


def test_a_scene_is_tuned(scene, tmp_path):
    out = tmp_path / "tuned.ron"
    more = {"out": out, "graphs": [DIRECT], "sweep": {"bias": [1.0]}, "size": (16, 12), "reference_seconds": 0.1}
    found = lg.tune(scene, error=1000, **more)
    chosen = found["candidates"][found["chosen"]]
    assert chosen["unbeaten"] and chosen["ms"] == min(c["ms"] for c in found["candidates"])
    assert found["variant"] == str(out) and found["reference"]["frames"] >= 4
    assert [c["setting"] for c in found["candidates"]] == [{}, {"bias": "1"}]
    image = lg.Renderer(out, scene, (16, 12)).frame()["color"]
    assert np.isfinite(image).all() and image.max() > 0
    with pytest.raises(lg.GraphError, match="nothing measured errs by"):
        lg.tune(scene, error=1e-9, **more)


@pytest.mark.parametrize(
    "call, error, said",
    [
        (lambda s, o: lg.bench(["no.ron"], [s], out=o), lg.GraphError, "can't read no.ron"),
        (lambda s, o: lg.bench([GRID], [s], {"gird": [2]}, out=o), lg.GraphError, "did you mean `grid`"),
        (lambda s, o: lg.bench([GRID], [s], {"grid": 2}, out=o), TypeError, "give a list of values"),
        (lambda s, o: lg.bench(GRID, [s], out=o), TypeError, "give a list of paths"),
        (lambda s, o: lg.bench([GRID], ["a,b.glb"], out=o), ValueError, "can't have a comma"),
        (lambda s, o: lg.bench([GRID], [s], out=o, shard=(3, 2)), ValueError, "the second of eight parts"),
        (lambda s, o: lg.bench([GRID], [s], out=o, phases=["rest"]), ValueError, "none of first, still"),
        (lambda s, o: lg.tune(s, out=o, budget=1, error=1), TypeError, "one of `budget` and `error`"),
        (lambda s, o: lg.tune(s, out=o, budget=-1), ValueError, "30ms"),
    ],
)
def test_what_is_wrong_is_said_before_anything_is_measured(scene, tmp_path, call, error, said):
    with pytest.raises(error, match=said):
        call(scene, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_command_comes_with_the_package(scene, tmp_path):
    out = tmp_path / "direct.exr"
    done = module("render", DIRECT, "--scene", scene, "--size", "16x12", "--out", out)
    assert done.returncode == 0, done.stderr
    np.testing.assert_array_equal(lg.read(out), lg.Renderer(DIRECT, scene, (16, 12)).frame()["color"])
    assert module("--version").stdout == f"lightgraph {lg.__version__}\n"
    assert module("bench", "--shard", "9/3").returncode == 2
    done = module("check", "no.ron")
    assert done.returncode == 1 and "can't read no.ron" in done.stderr
