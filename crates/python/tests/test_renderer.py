"""Frames: what they hold, what runs again, what is refused."""

import asyncio
import resource
import statistics
import time

import numpy as np
import pytest

import lightgraph as lg


def test_a_frame_is_the_image_of_the_command_to_the_bit(make, command, scenes, tmp_path):
    out = tmp_path / "direct.exr"
    scene = scenes / "cornell_point.gltf"
    command("render", "lightgraph:graphs/gi/direct.ron", "--scene", scene, "--size", "32x24", "--output", f"direct={out}")
    exr = lg.read(out)
    image = make().frame(outputs=["direct"])["direct"]
    assert image.shape == (24, 32, 4) and image.dtype == np.float32
    np.testing.assert_array_equal(image, exr)


def test_nothing_changed_runs_nothing(make):
    r = make("lightgraph:graphs/gi/fast_grid.ron", grid=(2, 2, 2))
    first = r.frame()["color"]
    assert r.frame()["color"] is first, "the same array comes back"
    assert r.stats["steps"] and not any(step["ran"] for step in r.stats["steps"])
    times = []
    for _ in range(200):
        start = time.perf_counter()
        r.frame()
        times.append(time.perf_counter() - start)
    # Of a debug build; examples/frame_times.py says what a release build takes.
    assert statistics.median(times) < 2e-3
    r.move(r.scene.lights[0], by=(0.0, -0.1, 0.0))
    assert not np.array_equal(r.frame()["color"], first)


def test_what_is_set_is_set_or_nothing_is(make):
    r = make("lightgraph:graphs/gi/fast_grid.ron", grid=(2, 2, 2), bounces=1)
    dark = r.frame()["color"].mean()
    r.set(bounces=4)
    assert r.params["bounces"] == 4
    assert r.frame()["color"].mean() > dark
    with pytest.raises(lg.GraphError, match="did you mean `bounces`") as caught:
        r.set(grid=(3, 3, 3), bouncs=2)
    assert caught.value.faults[0].severity == "error"
    assert r.params["grid"] == (2, 2, 2)
    with pytest.raises(lg.GraphError, match="minimum|least|below"):
        r.set(grid=(0, 1, 1))


def test_cameras_and_sizes(make):
    r = make()
    before = r.frame()["color"]
    r.camera = lg.Camera((0.5, 1.0, 2.0), (0.0, 1.0, 0.0), fov=60)
    assert r.camera.fov == pytest.approx(60)
    assert not np.array_equal(r.frame()["color"], before)
    r.camera = None
    np.testing.assert_array_equal(r.frame()["color"], before)
    r.size = (16, 8)
    assert r.frame()["color"].shape == (8, 16, 4)


def test_frames_under_way_arrive_in_order(make):
    r, waited = make(), make()
    light = r.scene.lights[0]
    flying = []
    for i in range(6):
        r.move(light, by=(0.05 * i, 0.0, 0.0))
        flying.append(r.submit())
    for i, frame in enumerate(flying):
        waited.move(light, by=(0.05 * i, 0.0, 0.0))
        np.testing.assert_array_equal(frame.result()["color"], waited.frame()["color"])
    assert flying[0].ready()

    async def both():
        first, second = r.submit(), r.submit()
        return await first, await second

    a, b = asyncio.run(both())
    np.testing.assert_array_equal(a["color"], b["color"])
    assert len(list(r.frames([0.0, 0.1, 0.2]))) == 3


def test_memory_stays_flat(make):
    r = make()
    light = r.scene.lights[0]
    for i in range(100):
        r.move(light, by=(0.001 * (i % 7), 0.0, 0.0))
        r.frame()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for i in range(1000):
        r.move(light, by=(0.001 * (i % 7), 0.0, 0.0))
        r.frame()
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 8 << 10, f"{grown} KiB more after 1,000 frames"


def test_arrays_go_in_as_inputs(tmp_path):
    graph = tmp_path / "twice.ron"
    graph.write_text(
        """Graph(
    about: "Twice what it is given",
    inputs: {"given": Texture(format: Rgba32Float, size: (5, 3))},
    resources: {"twice": Texture(format: Rgba32Float, size: "given")},
    passes: [Screen(name: "twice", shader: "twice.wgsl", color: "twice")],
    outputs: {"color": "twice"},
)
"""
    )
    (tmp_path / "twice.wgsl").write_text(
        "var given: texture_2d<f32>;\n"
        "@fragment fn shade(@builtin(position) at: vec4f) -> @location(0) vec4f {\n"
        "    return 2.0 * textureLoad(given, vec2u(at.xy), 0);\n}\n"
    )
    r = lg.Renderer(graph, size=(8, 8), shaders=[tmp_path])
    assert r.inputs == {"given": ("Rgba32Float", [1, 3, 5])}
    image = np.arange(60, dtype=np.float32).reshape(3, 5, 4)
    r.lend("given", image)
    np.testing.assert_array_equal(r.frame()["color"], 2 * image)
    for wrong, error in [
        (image[:2], (ValueError, lg.GraphError)),
        (image[None, None, None], ValueError),
        (image.astype("c8"), TypeError),
        (np.full_like(image, np.nan), ValueError),
    ]:
        with pytest.raises(error):
            r.lend("given", wrong)
    with pytest.raises(lg.GraphError, match="givn"):
        r.lend("givn", image)
    np.testing.assert_array_equal(r.frame()["color"], 2 * image)


def test_faults_have_places_and_remedies(tmp_path, scenes):
    graph = tmp_path / "bad.ron"
    graph.write_text('Graph(\n    params: {"a": Uint(defalt: 1)},\n    passes: [],\n    outputs: {},\n)\n')
    with pytest.raises(lg.GraphError) as caught:
        lg.Renderer(graph)
    fault = next(f for f in caught.value.faults if "defalt" in str(f))
    assert (fault.places[0].line, fault.places[0].path) == (2, str(graph))
    assert "^" in str(fault)
    assert [str(f) for f in lg.check(graph)] == [str(f) for f in caught.value.faults]
    with pytest.raises(lg.GraphError, match="scene"):
        lg.Renderer("lightgraph:graphs/gi/direct.ron")
    with pytest.raises(lg.GraphError, match="no_such"):
        lg.Renderer("lightgraph:graphs/gi/direct.ron", scenes / "no_such.glb")
    with pytest.raises((ValueError, TypeError, lg.GraphError)):
        lg.Renderer("lightgraph:graphs/gi/direct.ron", scenes / "cornell_point.gltf", size=(0, 4))


def test_plans_and_statistics(make):
    r = make()
    r.frame()
    assert "shadow" in r.plan.text()
    assert r.plan.svg().startswith("<svg") and r.plan._repr_html_() == r.plan.svg()
    assert r.plan.bytes[0] <= r.plan.bytes[1]
    assert r.stats["adapter"]
