"""The add-on's link to a window: against a window that takes notes, and against a real one."""

import os
import shutil
import socket
import struct
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from matplotlib.image import imread

import lightgraph as lg
from conftest import ROOT
from test_blender import content, floor, lit, part

sys.path.append(str(ROOT / "editors/blender/tests"))
from note_taker import TOKEN, Window, until  # noqa: E402

link = part("link")

CAMERA = {"eye": (0, 3, 0.01), "target": (0, 0, 0), "fov": 20, "near": 0.01, "far": 10.0}


def moved(before, by):
    matrices = before.matrices.copy()
    matrices[0, :3, 3] += by
    return content.Content(before.shapes, before.lamps, matrices, before.environment)


def test_only_what_changed_is_sent():
    window = Window()
    follower = link.Link(window.link, "a test")
    first = lit(floor())
    follower.show(first, CAMERA)
    until(lambda: window.words() == ["hello", "camera", "scene"])
    assert window.messages[0][1] == {"version": 1, "token": TOKEN, "program": "a test"}
    assert window.messages[1][1]["eye"] == [0, 3, 0.01]
    _, header, gltf = window.messages[2]
    sent = lg.Scene.from_bytes(gltf)
    assert header == {"name": "Blender"} and set(sent.nodes) >= {"floor", "lamp"} and sent.lights == ["lamp"]

    # A lamp that moves sends a matrix, no meshes; at rest there is nothing more to say, for the bounds are the same.
    second = lit(first.shapes["floor"], height=2.0)
    follower.show(second, CAMERA)
    until(lambda: len(window.messages) == 4)
    word, header, body = window.messages[3]
    assert (word, header) == ("place", {"nodes": ["lamp"]})
    placed = np.frombuffer(body, "<f4").reshape(4, 4).T
    np.testing.assert_array_equal(placed, second.matrices[1].astype("f4"))
    time.sleep(3 * link.REST)
    follower.show(second, {**CAMERA, "fov": 30})
    until(lambda: len(window.messages) == 5)
    assert window.messages[4][0] == "camera"

    # What leaves the scene's bounds has the scene laid out anew, once it is at rest.
    third = moved(second, (1, 0, 0))
    follower.show(third, {**CAMERA, "fov": 30})
    until(lambda: len(window.messages) == 7)
    assert window.words()[5:] == ["place", "scene"]
    assert third.bounds()[1][0] == lg.Scene.from_bytes(window.messages[6][2]).bounds[1][0] == 3

    # Another material is another scene; a panorama stands behind it.
    sky = np.full((2, 4, 3), 0.5, np.float32)
    fourth = content.Content({"floor": floor(0.25)}, third.lamps, third.matrices, sky)
    follower.show(fourth, None)
    until(lambda: len(window.messages) == 8)
    word, header, body = window.messages[7]
    assert (word, header) == ("scene", {"name": "Blender", "panorama": [4, 2]}) and body.endswith(sky.tobytes())
    follower.show(content.Content(fourth.shapes, fourth.lamps, fourth.matrices, (0.1, 0.2, 0.3)), None)
    until(lambda: len(window.messages) == 9)
    assert window.messages[8][1]["radiance"] == [0.1, 0.2, 0.3]
    follower.stop()
    until(lambda: follower.state == "closed")
    assert not follower.error


def test_what_the_window_does_not_take_is_said_and_the_next_one_goes_whole():
    window, told = Window(), threading.Event()
    # Of the greeting, and of the scene.
    window.faults = [None, "error: Blender: it has no triangles"]
    follower = link.Link(window.link, "a test", told.set)
    first = lit(floor())
    follower.show(first, None)
    until(lambda: follower.error)
    assert told.is_set() and follower.state == "connected" and "no triangles" in follower.error
    # It is not sent again and again; the camera goes on.
    follower.show(first, CAMERA)
    until(lambda: window.words() == ["hello", "scene", "camera"])
    assert "no triangles" in follower.error
    follower.show(moved(first, (0, 1, 0)), CAMERA)
    until(lambda: window.words()[3:] == ["scene"] and not follower.error)
    # What can't be drawn does not reach the window.
    follower.show(content.Content(), CAMERA)
    until(lambda: "nothing to draw" in follower.error)
    follower.show(first, CAMERA)
    until(lambda: window.words()[3:] == ["scene", "scene"] and not follower.error)
    follower.stop()


def test_a_window_that_closes_is_told_and_nothing_waits_for_it():
    window = Window()
    follower = link.Link(window.link, "a test")
    follower.show(lit(floor()), CAMERA)
    until(lambda: len(window.messages) == 3)
    window.close()
    until(lambda: follower.state == "closed", 10)
    assert "closed" in follower.error
    start = time.monotonic()
    follower.show(lit(floor()), CAMERA)
    follower.stop()
    assert time.monotonic() - start < 1


@pytest.mark.parametrize("answer", [b"HTTP/1.1 400 Bad Request\r\n\r\n", struct.pack("<II", 3, 0) + b"[1]", b"\0" * 8])
def test_who_is_no_window_is_left(answer):
    follower = link.Link(Window(answer).link, "a test")
    until(lambda: follower.state == "closed")
    assert "no window of lightgraph" in follower.error


def test_nobody_there_is_said():
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    follower = link.Link(f"lightgraph://127.0.0.1:{port}/{TOKEN}", "a test")
    until(lambda: follower.state == "closed")
    assert "refused" in follower.error


@pytest.mark.parametrize(
    "text",
    ["", "127.0.0.1:7000", "http://a:7000/b", "lightgraph://127.0.0.1/a", "lightgraph://a:b/c", "lightgraph://a:7000"],
)
def test_what_is_no_link_names_one(text):
    with pytest.raises(ValueError, match="lightgraph view --link"):
        link.address(text)
    assert link.address(" lightgraph://[::1]:7000/abc\n") == ("::1", 7000, "abc")


def test_a_message_too_large_is_not_sent(monkeypatch):
    window = Window()
    monkeypatch.setattr(link, "BODY", 100)
    connection = link.Connection(window.link, "a test")
    with pytest.raises(link.Refused, match="may have 100"):
        connection.scene(bytes(101), "Blender")
    connection.camera(CAMERA)
    assert window.words() == ["hello", "camera"] and connection.is_open()
    connection.close()


SCRIPT = """[
    File("sent"), Rest, Shot("sent.png"), File("moved"), Rest, Shot("moved.png"),
    File("painted"), Rest, Shot("painted.png"), Close,
]"""


def test_a_real_window_follows(tmp_path):
    assert shutil.which("Xvfb"), "Xvfb is needed: on Debian and Ubuntu `apt install xvfb`"
    program = os.environ.get("LIGHTGRAPH", ROOT / "target/debug/lightgraph")
    reading, writing = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x1024x24", "-nolisten", "tcp"],
        pass_fds=[writing],
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    window = follower = None
    try:
        with os.fdopen(reading) as said:
            display = f":{said.readline().strip()}"
        (tmp_path / "script").write_text(SCRIPT)
        graph = str(ROOT / "graphs/gi/direct.ron")
        arguments = ["view", graph, "--link", "--size", "900x600", "--pixels", "0.25", "--script", "script"]
        environment = {k: v for k, v in os.environ.items() if not k.startswith("WAYLAND")} | {"DISPLAY": display}
        window = subprocess.Popen([program, *arguments], cwd=tmp_path, env=environment, stdout=-1, text=True)
        follower = link.Link(window.stdout.readline(), "a test")

        def shown(name, scene):
            follower.show(scene, CAMERA)
            until(lambda: follower._content is scene and follower._laid is scene, 60)
            assert not follower.error
            (tmp_path / name).touch()
            until((tmp_path / f"{name}.png").exists, 300)
            until(lambda: (tmp_path / f"{name}.png").stat().st_size > 0)
            return imread(tmp_path / f"{name}.png")

        first = lit(floor())
        images = [shown("sent", first), shown("moved", lit(first.shapes["floor"], height=0.05))]
        (grey,) = first.shapes["floor"]
        red = lg.Mesh(grey.positions, grey.indices, material=lg.Material((1, 0, 0)))
        images.append(shown("painted", lit((red,))))
        assert window.wait(60) == 0
        until(lambda: follower.state == "closed", 10)
        assert "closed" in follower.error
        sent, moved_, painted = (image[image.shape[0] // 3, image.shape[1] // 2] for image in images)
        assert sent[0] > 0.05 and abs(sent[0] - sent[2]) < 0.02, sent
        assert np.abs(images[0] - images[1]).max() > 0.1
        # The tone map takes colour from what is bright.
        assert painted[0] - painted[1] > 0.3 and abs(painted[1] - painted[2]) < 0.02, painted
    finally:
        if follower is not None:
            follower.stop()
        for one in (window, server):
            if one is not None:
                one.kill()
                one.wait()
