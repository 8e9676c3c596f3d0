"""The examples, on small inputs."""

import importlib.util
import pathlib

import numpy as np

import lightgraph as lg

EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.main


def test_error_against_time(scenes, tmp_path):
    example("error_against_time")(str(scenes / "cornell_point.gltf"), str(tmp_path / "out.png"), 16)
    assert (tmp_path / "out.png").stat().st_size > 5000


def test_views(scenes, tmp_path):
    example("views")(str(scenes / "cornell_point.gltf"), str(tmp_path), 4)
    files = sorted(tmp_path.glob("*.exr"))
    assert len(files) == 12
    color, depth, normal = map(lg.read, files[:3])
    assert color.shape == (96, 128, 4) and depth.shape[:2] == normal.shape[:2] == (96, 128)
    assert color.max() > 0


def test_fit(scenes):
    found, wanted = example("fit")(str(scenes / "cornell_point.gltf"))
    np.testing.assert_allclose(found, wanted, atol=0.02)


def test_frame_times(scenes):
    found = example("frame_times")(str(scenes / "cornell_point.gltf"), 20)
    assert found["nothing changed"][0] < found["the camera moved"][0]
