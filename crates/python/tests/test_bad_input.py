"""What is wrong is an exception with a name and a remedy, and the renderer stays as it was."""

import gc
import pickle
import subprocess
import sys
import threading

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
        (lambda: setattr(r, "camera", lg.Camera((0, 0, 1), (0, 0, 0), fov=NAN)), ValueError, "finite number"),
        (lambda: setattr(r, "size", (0, 0)), ValueError, "at least 1"),
        (lambda: setattr(r, "scene", "hall"), TypeError, "lightgraph.Scene"),
        (lambda: r.frame(outputs=5), TypeError, "list of names"),
        (lambda: r.frame(outputs=["colr"]), lg.GraphError, "no output `colr`"),
        (lambda: r.set(bias=NAN), lg.GraphError, "not a f32"),
        (lambda: r.set(bias=object()), TypeError, "a parameter is a number"),
        (lambda: r.place([1]), TypeError, "dictionary of matrices"),
        (lambda: r.place({"lamp": np.full((4, 4), NAN)}), ValueError, "NaN or an infinity"),
    ]:
        with pytest.raises(error, match=said):
            call()
    assert r.frame()["color"] is before


NAN = float("nan")
CORNERS = np.array([[-2, 0, -2], [-2, 0, 2], [2, 0, 2]], np.float32)


def mesh(**more):
    return lg.Mesh(**{"positions": CORNERS, "indices": [[0, 1, 2]], **more})


@pytest.mark.parametrize(
    "given, error, said",
    [
        ({"meshes": mesh(positions=CORNERS * 1e300)}, ValueError, "NaN or an infinity"),
        ({"meshes": mesh(positions=[[1, 2, 3], [1, 2]])}, ValueError, "rows of equal length"),
        ({"meshes": mesh(positions=None)}, TypeError, "give numbers"),
        ({"meshes": mesh(indices=[[-1, 0, 1]])}, ValueError, "positions 0 to 2"),
        ({"meshes": mesh(uvs=np.zeros((2, 2)))}, ValueError, "give as many"),
        ({"meshes": mesh(material=lg.Material(roughness="a"))}, TypeError, "roughness = 'a': give a number"),
        ({"meshes": mesh(material=lg.Material(alpha=NAN))}, ValueError, "alpha = nan: give a finite number"),
        ({"meshes": mesh(material=lg.Material(color_texture=np.zeros((2, 2, 3))))}, TypeError, "give uint8"),
        ({"lights": lg.PointLight((0, 1, 0), NAN)}, ValueError, "candela = nan: give a finite number"),
        ({"lights": lg.SpotLight((0, 1, 0), (0, 0, 0), 1, angle=NAN)}, ValueError, "angle = nan"),
        ({"cameras": lg.Camera((0, 0, 1), (0, 0, 0), fov="a")}, TypeError, "fov = 'a': give a number"),
        ({"environment": np.full((4, 8, 3), np.nan, np.float32)}, ValueError, "finite and not negative"),
        ({"environment": np.zeros((4, 8, 3)).astype(str)}, TypeError, "give float32"),
        ({"environment": np.zeros((4, 5, 3), np.float32)}, lg.GraphError, "twice as wide as high"),
    ],
)
def test_scenes_refuse(given, error, said):
    with pytest.raises(error, match=said):
        lg.Scene.from_arrays(**{"meshes": mesh(), **given})


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


def test_a_scene_is_replaced_and_freed_while_frames_are_under_way(make):
    expected = make().frame()["color"]
    r = make()
    frames = []
    for _ in range(4):
        frames.append(r.submit())
        r.scene = lg.Scene.from_arrays(mesh(), lg.PointLight((0, 1, 0), 1.0), lg.Camera((0, 2, 2), (0, 0, 0)))
        frames.append(r.submit())
        r.scene = make().scene
        gc.collect()
    r.size = (8, 8)
    del r
    gc.collect()
    images = [frame.result()["color"] for frame in frames]
    for image in images[::2]:
        np.testing.assert_array_equal(image, expected)
    assert all(image.shape == (24, 32, 4) for image in images)


def test_threads_share_a_renderer(make):
    r = make()
    expected = r.frame()["color"]
    found = []
    threads = [threading.Thread(target=lambda: found.append(r.submit().result()["color"])) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8
    for image in found:
        np.testing.assert_array_equal(image, expected)


@pytest.mark.parametrize(
    "ending, said",
    [
        ("", ""),
        # A device does not outlive a fork, and says so.
        (
            """
import os, sys
child = os.fork()
if not child:
    try:
        r.frame()
    except lg.GraphError as error:
        os._exit(7 if "spawn" in str(error) else 8)
    os._exit(9)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
""",
            "7",
        ),
    ],
)
def test_a_process_ends_in_peace_with_a_frame_under_way(scenes, ending, said):
    script = f"""
import lightgraph as lg
r = lg.Renderer("lightgraph:graphs/gi/direct.ron", {str(scenes / "cornell_point.gltf")!r}, (32, 24))
frame = r.submit()
{ending}
"""
    # A process that leaves while the driver's threads work crashes in about every other run.
    for _ in range(6):
        command = [sys.executable, "-W", "ignore", "-c", script]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300)
        assert (done.returncode, done.stdout.strip()) == (0, said), done.stderr
