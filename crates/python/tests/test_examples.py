"""The examples, on small inputs."""

import ast
import importlib.util
import json
import pathlib

import matplotlib
import numpy as np

import lightgraph as lg

matplotlib.use("Agg")
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
    # Of the same frames: what else the machine does falls on both, and as a rule alike.
    for _ in range(3):
        found = example("frame_times")(str(scenes / "cornell_point.gltf"), 30, (320, 240))
        (still, _), (moved, rust) = found["nothing changed"], found["the camera moved"]
        if moved <= 1.05 * rust:
            break
    assert still < moved
    assert moved <= 1.05 * rust, found


def test_scaling(scenes):
    found = example("scaling")(str(scenes / "cornell_point.gltf"), 4, 16)
    assert list(found) == ["this process", "1 worker", "2 workers"] and min(found.values()) > (0, 0)


def run_notebook(name, monkeypatch, **parameters):
    """Runs the cells of a notebook as a kernel does, and returns what they show by MIME type. `parameters` replace
    those of the cell with this tag."""
    notebook = json.loads((EXAMPLES / f"{name}.ipynb").read_text(encoding="utf-8"))
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    monkeypatch.chdir(EXAMPLES)
    names, shown = {}, []
    for cell in notebook["cells"]:
        assert cell["id"] and (cell["cell_type"] == "markdown" or cell["outputs"] == [])
        if cell["cell_type"] != "code":
            continue
        *body, last = ast.parse("".join(cell["source"])).body
        value = None
        if isinstance(last, ast.Expr):
            exec(compile(ast.Module(body, []), name, "exec"), names)
            value = eval(compile(ast.Expression(last.value), name, "eval"), names)
        else:
            exec(compile(ast.Module([*body, last], []), name, "exec"), names)
        for mime, method in (("image/png", "_repr_png_"), ("text/html", "_repr_html_"), ("text/plain", "__repr__")):
            if value is not None and hasattr(value, method):
                shown.append((mime, getattr(value, method)()))
                break
        if "parameters" in cell["metadata"].get("tags", []):
            assert parameters.keys() <= names.keys()
            names.update(parameters)
    return names, shown


def test_the_notebook_of_errors(scenes, monkeypatch):
    names, shown = run_notebook("error_against_time", monkeypatch, size=(16, 16), samples=16)
    assert len(names["entries"]) == 9 and all(e["error"]["rmse_percent"] > 0 for e in names["entries"])
    assert [mime for mime, _ in shown] == ["image/png", "text/html", "text/plain", "text/plain"]
    assert shown[0][1].startswith(b"\x89PNG") and shown[1][1].startswith("<svg")
    assert [len(line.get_xdata()) for line in names["axes"].lines] == [3, 3, 3]


def test_the_notebook_of_views(tmp_path, monkeypatch):
    names, shown = run_notebook("views", monkeypatch, folder=str(tmp_path), count=3)
    assert len(names["entries"]) == 3 and len(list(tmp_path.glob("*.exr"))) == 9
    assert shown[1][1].startswith(b"\x89PNG")
    assert names["first"]["surface_depth"].shape[:2] == names["first"]["surface_normal"].shape[:2] == (96, 128)


def test_the_notebook_of_a_light(monkeypatch):
    names, shown = run_notebook("fit", monkeypatch)
    np.testing.assert_allclose(names["found"].x, names["wanted"], atol=0.02)
    assert [mime for mime, _ in shown] == ["image/png", "text/plain", "image/png"]
