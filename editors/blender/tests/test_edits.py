"""Random edits end in the image of a fresh start; nothing is left behind by them; nothing reaches the console."""

import os
import random
import resource

import bpy
import numpy as np
import pytest

import scenes
from test_cycles import graph

# `LIGHTGRAPH_EDITS=2000` for the whole of it.
EDITS = int(os.environ.get("LIGHTGRAPH_EDITS", 200))
LOOK_EVERY = 10


class Editor:
    """Edits a file as its user might."""

    def __init__(self, seed):
        self.random = random.Random(seed)

    def meshes(self):
        return [o for o in bpy.context.scene.objects if o.type == "MESH"]

    def place(self):
        r = self.random
        return (r.uniform(-2, 2), r.uniform(-2, 2), r.uniform(0.3, 2.5))

    def color(self):
        return tuple(self.random.uniform(0.05, 0.9) for _ in range(3))

    def add(self):
        if len(self.meshes()) < 24:
            kind = self.random.choice(["cube", "ball", "monkey", "torus"])
            scenes.added(kind, scenes.matte("edit", self.color()), location=self.place(), scale=(0.4,) * 3)

    def delete(self):
        # The floor stays, so that there is something to draw.
        others = self.meshes()[1:]
        if others:
            bpy.data.objects.remove(self.random.choice(others))

    def move(self):
        thing = self.random.choice(list(bpy.context.scene.objects))
        if thing.type != "CAMERA":
            thing.location = self.place()

    def turn(self):
        self.random.choice(self.meshes()).rotation_euler = self.place()

    def mirror(self):
        self.random.choice(self.meshes()).scale.x *= -1

    def modify(self):
        thing = self.random.choice(self.meshes())
        if len(thing.modifiers) > 1:
            thing.modifiers.remove(thing.modifiers[0])
        else:
            kind = self.random.choice(["BEVEL", "ARRAY", "MIRROR", "SOLIDIFY", "TRIANGULATE"])
            thing.modifiers.new("edit", kind)

    def edit(self):
        mesh = self.random.choice(self.meshes()).data
        vertex = self.random.choice(mesh.vertices)
        vertex.co.z += self.random.uniform(-0.1, 0.1)
        mesh.update()

    def paint(self):
        materials = [m for m in bpy.data.materials if m.users]
        if materials:
            for node in self.random.choice(materials).node_tree.nodes:
                if node.bl_idname == "ShaderNodeBsdfDiffuse":
                    node.inputs["Color"].default_value = (*self.color(), 1)

    def swap(self):
        materials = list(bpy.data.materials)
        thing = self.random.choice(self.meshes())
        if materials and thing.material_slots:
            thing.material_slots[0].material = self.random.choice(materials)

    def dim(self):
        lights = [o for o in bpy.context.scene.objects if o.type == "LIGHT"]
        if lights:
            self.random.choice(lights).data.energy *= self.random.uniform(0.7, 1.4)

    def light(self):
        lights = [o for o in bpy.context.scene.objects if o.type == "LIGHT"]
        if len(lights) > 3:
            bpy.data.objects.remove(lights[0])
        else:
            scenes.light(self.random.choice(["POINT", "SPOT", "SUN"]), 50, (0, 0, 4))

    def hide(self):
        others = self.meshes()[1:]
        if others:
            thing = self.random.choice(others)
            thing.hide_render = not thing.hide_render

    def instance(self):
        thing = self.random.choice(self.meshes())
        copy = bpy.data.objects.new("copy", thing.data)
        copy.location = self.place()
        bpy.context.collection.objects.link(copy)

    def undo(self):
        bpy.ops.ed.undo_push()
        self.move()
        bpy.ops.ed.undo_push()
        if bpy.ops.ed.undo.poll():
            bpy.ops.ed.undo()

    def reload(self, path):
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        bpy.ops.wm.open_mainfile(filepath=str(path))

    KINDS = (add, delete, move, move, move, turn, mirror, modify, edit, edit, paint, paint, swap, dim, light, hide)
    KINDS += (instance, undo)

    def any(self):
        self.random.choice(self.KINDS)(self)


def test_random_edits_end_in_the_image_of_a_fresh_start(empty, addon, followed, tmp_path, capfd):
    scenes.point()
    editor = Editor(7)
    live = addon.live.Live()

    def look(content, live):
        camera = {"eye": (0, 4, 9), "target": (0, 1, 0), "near": 0.1, "far": 100.0}
        job = addon.live.Job(content, camera, (96, 72), graph("direct"))
        picture = live.wait(job, lambda: False, lambda share: None)
        assert not picture.error, picture.error
        return picture.images["color"]

    def alike(what):
        fresh = addon.live.Live()
        wanted = look(addon.sync.Sync().read(bpy.context.evaluated_depsgraph_get()), fresh)
        fresh.stop()
        shown = look(followed.now(), live)
        np.testing.assert_allclose(shown, wanted, atol=1e-4, err_msg=what)

    memory = []
    for i in range(EDITS):
        editor.any()
        if i % 500 == 499:
            editor.reload(tmp_path / "edits.blend")
            followed.sync.forget()
        if i % 40 == 39:
            bpy.ops.outliner.orphans_purge(do_recursive=True)
        content = followed.now()
        if i % LOOK_EVERY == 0:
            look(content, live)
        if i % 100 == 0:
            alike(f"after {i} edits")
            memory.append(resident())
    alike("in the end")
    live.stop()
    said = capfd.readouterr().err
    with capfd.disabled():
        print("MiB by hundreds of edits:", memory)
    if len(memory) > 10:
        assert memory[-1] < memory[len(memory) // 2] * 1.2 + 50
    assert "Traceback" not in said


def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() // 2**20
