"""Scenes from arrays against closed forms, and what is no scene."""

import math

import numpy as np
import pytest

import lightgraph as lg

FLOOR = np.array([[-2, 0, -2], [-2, 0, 2], [2, 0, 2], [2, 0, -2]], dtype=np.float32)
TWO = np.array([[0, 1, 2], [0, 2, 3]])


def test_a_plane_under_a_point_light_is_lambert():
    scene = lg.Scene.from_arrays(
        {"floor": lg.Mesh(FLOOR, TWO, material=lg.Material(color=(0.5, 0.5, 0.5)))},
        {"lamp": lg.PointLight((0.0, 1.0, 0.0), candela=10.0)},
        lg.Camera((0.0, 3.0, 0.01), (0.0, 0.0, 0.0), fov=20),
    )
    assert "floor" in scene.nodes and scene.lights == ["lamp"]
    r = lg.Renderer("lightgraph:graphs/gi/direct.ron", scene, size=(33, 33))
    middle = r.frame(outputs=["direct"])["direct"][16, 16, :3]
    # Radiance of a matte plane below a light: intensity times albedo over π, at one metre and straight on.
    np.testing.assert_allclose(middle, 10.0 * 0.5 / math.pi, rtol=1e-2)
    r.move("lamp", to=(0.0, 2.0, 0.0))
    np.testing.assert_allclose(r.frame()["direct"][16, 16, :3], 10.0 * 0.5 / math.pi / 4, rtol=1e-2)


@pytest.mark.parametrize(
    "mesh, error",
    [
        (lg.Mesh(FLOOR[:, :2], TWO), ValueError),
        (lg.Mesh(np.full((4, 3), np.nan), TWO), ValueError),
        (lg.Mesh(FLOOR, TWO + 9), (ValueError, IndexError)),
        (lg.Mesh(FLOOR.astype("U8"), TWO), (TypeError, ValueError)),
        (lg.Mesh(FLOOR, TWO.astype(float)), TypeError),
    ],
)
def test_wrong_arrays_are_refused(mesh, error):
    with pytest.raises(error) as caught:
        lg.Scene.from_arrays(mesh)
    assert len(str(caught.value)) > 20


def test_images_compare(tmp_path):
    a = np.full((16, 16, 3), 0.5, np.float32)
    assert lg.compare(a, a)["rmse_percent"] == 0
    assert lg.compare(1.1 * a, a)["bias_percent"] == pytest.approx(10, abs=0.01)
    with pytest.raises((ValueError, lg.GraphError)):
        lg.compare(a[:8], a)
    # As an array lies that came over a wire.
    apart = np.frombuffer(b"\0" + a.tobytes(), np.float32, offset=1).reshape(a.shape)
    assert not apart.flags.aligned and lg.compare(apart, a)["rmse_percent"] == 0
    path = tmp_path / "a.exr"
    lg.write(path, a)
    np.testing.assert_array_equal(lg.read(path), a)
    assert lg.Picture(a)._repr_png_().startswith(b"\x89PNG")
    lg.write(tmp_path / "a.png", a, exposure=1.0)
    assert (tmp_path / "a.png").stat().st_size > 50


def test_what_comes_with_the_package():
    assert "lightgraph:graphs/gi/final_gather.ron" in lg.builtin_graphs()
    assert lg.parameters("lightgraph:graphs/gi/fast_grid.ron")["bounces"]["type"] == "u32"
    assert lg.check("lightgraph:graphs/gi/direct.ron") == []
    assert len(lg.adapter()) == 3
