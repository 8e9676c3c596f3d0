"""How long a change takes from the dependency graph to the frame's submission. Bounds are for a release build."""

import os

import bpy
import numpy as np
import pytest

import scenes
from test_cycles import graph

# A debug build is checked for working, not for its time.
RELEASE = os.environ.get("LIGHTGRAPH_RELEASE") == "1"


@pytest.fixture
def follow(addon, followed):
    """Reads what changed, and has a frame submitted; milliseconds of reading, of submitting."""
    live = addon.live.Live()

    def once():
        followed.milliseconds = 0.0
        content = followed.now()
        read = followed.milliseconds
        camera = {"eye": (0, 6, 12), "target": (0, 0, 0), "near": 0.1, "far": 100.0}
        job = addon.live.Job(content, camera, (64, 64), graph(once.graph))
        picture = live.wait(job, lambda: False, lambda share: None)
        assert not picture.error, picture.error
        return read, picture.milliseconds

    once.graph = "direct"
    yield once
    live.stop()


def grid(name, side, location=(0, 0, 0)):
    """A plane of side² quads."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=side, y_subdivisions=side, size=4, location=location)
    bpy.context.object.name = name
    return bpy.context.object


def told(what, found, bound):
    read, sent = min(found, key=sum)
    print(f"{what}: {read + sent:.1f} ms ({read:.1f} to read, {sent:.1f} to submit)")
    if RELEASE and bound is not None:
        assert read + sent <= bound


@pytest.mark.parametrize("name", ["direct", "pathtrace", "final_gather"])
def test_a_moved_object_sends_a_matrix(name, empty, follow):
    follow.graph = name
    big = grid("big", 310)
    small = scenes.added("cube", location=(0, 0, 1), scale=(0.3,) * 3)
    scenes.light("POINT", 500, (0, 0, 4))
    follow()
    found = []
    for i in range(8):
        (big if i % 2 else small).location.x += 0.05
        found.append(follow())
    told(f"{name}: a small object moved among 192,000 triangles", found[::2], 20)
    told(f"{name}: one of 192,000 triangles moved", found[1::2], 20 if name == "direct" else None)


def test_an_edited_mesh_is_sent_alone(empty, follow):
    edited = grid("edited", 158)
    scenes.light("POINT", 500, (0, 0, 4))
    follow()
    found = []
    for i in range(12):
        edited.data.vertices[5000].co.z += 0.1
        edited.data.update()
        found.append(follow())
    told("an edited mesh of 50,000 triangles", found, 100)


@pytest.mark.parametrize("fineness", [1, 2])
def test_instances(fineness, empty, follow):
    """The library lays out the triangles of every instance: how long it takes is a matter of their number."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=fineness)
    part = bpy.context.object
    part.scale = (0.05,) * 3
    scenes.light("POINT", 500, (0, 0, 4))
    follow()
    places = np.random.default_rng(1).uniform(-3, 3, (1000, 3))
    for place in places:
        copy = bpy.data.objects.new("copy", part.data)
        copy.location, copy.scale = place, (0.05,) * 3
        bpy.context.collection.objects.link(copy)
    what = f"1,000 instances of {20 * 4 ** (fineness - 1)} triangles"
    told(f"{what} added", [follow()], 300)
    for obj in list(bpy.context.scene.objects)[2:]:
        obj.location.z += 0.1
    told(f"{what} moved", [follow()], 300)
