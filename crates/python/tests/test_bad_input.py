"""What is wrong is an exception with a name and a remedy, and the renderer stays as it was."""

import gc
import pickle

import numpy as np
import pytest

import lightgraph as lg


@pytest.mark.parametrize(
    "wrong, error, said",
    [
        ({"size": (10**9, 10**9)}, lg.GraphError, "GiB are allowed"),
        ({"size": (40000, 8)}, lg.GraphError, "exceeds the adapter's limit"),
        ({"size": (8.5, 8)}, TypeError, "whole pixels"),
        ({"size": "ab"}, TypeError, "whole pixels"),
        ({"size": (0, 8)}, ValueError, "at least 1"),
        ({"camera": "came"}, lg.GraphError, "did you mean `cam`"),
        ({"camera": 3}, TypeError, "lightgraph.Camera"),
        ({"outputs": "color"}, TypeError, "list of names"),
        ({"outputs": ["colr"]}, lg.GraphError, "did you mean `color`"),
        ({"grid": (np.nan,) * 3}, lg.GraphError, "not a vec3u"),
        ({"grid": {}}, TypeError, "tuple of numbers"),
        ({"bounces": -1}, lg.GraphError, "not a u32"),
        ({"bouncs": 1}, lg.GraphError, "did you mean `bounces`"),
        ({"adapter": "nonesuch"}, lg.NoAdapterError, "adapters here"),
        ({"shaders": ["/nonexistent"]}, lg.GraphError, "can't read /nonexistent"),
    ],
)
def test_renderers_refuse(make, wrong, error, said):
    with pytest.raises(error, match=said):
        make("lightgraph:graphs/gi/fast_grid.ron", **wrong)


def test_calls_refuse_and_change_nothing(make):
    r = make()
    before = r.frame()["color"]
    for call, error, said in [
        (lambda: r.frame(time=float("nan")), ValueError, "finite number of seconds"),
        (lambda: r.frame(time="1"), TypeError, "seconds, as a number"),
        (lambda: r.move("lmp", by=(0, 0, 1)), lg.GraphError, "did you mean `lamp`"),
        (lambda: r.move("lamp", by=(0, np.nan, 1)), ValueError, "finite numbers"),
        (lambda: r.move("lamp"), TypeError, "one of `by` and `to`"),
        (lambda: setattr(r, "camera", lg.Camera((0, 0, 0), (0, 0, 0))), lg.GraphError, "two different places"),
        (lambda: setattr(r, "size", (0, 0)), ValueError, "at least 1"),
    ]:
        with pytest.raises(error, match=said):
            call()
    assert r.frame()["color"] is before


def test_images_refuse(tmp_path):
    black = np.zeros((4, 4, 3), np.float32)
    with pytest.raises(lg.GraphError, match="NaN or an infinity"):
        lg.compare(black, np.full_like(black, np.nan))
    with pytest.raises(lg.GraphError, match="at least one pixel"):
        lg.write(tmp_path / "none.png", black[:0])
    with pytest.raises(lg.GraphError, match="can't read"):
        lg.read(tmp_path / "none.exr")
    with pytest.raises(TypeError, match="give float32"):
        lg.Picture(black.astype(str))


def test_faults_travel_to_other_processes(make):
    with pytest.raises(lg.GraphError) as caught:
        make(bouncs=2)
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.faults == caught.value.faults and str(again) == str(caught.value)


def test_a_frame_needs_neither_renderer_nor_scene(make):
    r = make()
    frame, scene = r.submit(), r.scene
    del r, scene
    gc.collect()
    assert frame.result()["color"].shape == (24, 32, 4)
