"""The stubs of the native module name what it has, with its arguments, and nothing else."""

import ast
import inspect
import pathlib

import lightgraph
from lightgraph import _native

STUBS = pathlib.Path(lightgraph.__file__).with_name("_native.pyi")


def public(thing):
    return {name for name in vars(thing) if not name.startswith("_")}


def arguments(function):
    return [a.arg for a in function.args.args if a.arg not in ("self", "cls")]


def test_stubs_are_what_the_module_has():
    tree = ast.parse(STUBS.read_text())
    classes = {c.name: c for c in tree.body if isinstance(c, ast.ClassDef)}
    functions = {f.name: f for f in tree.body if isinstance(f, ast.FunctionDef)}
    assert public(_native) == classes.keys() | functions.keys()
    for name, stub in functions.items():
        assert list(inspect.signature(getattr(_native, name)).parameters) == arguments(stub), name
    for name, stub in classes.items():
        methods = {m.name: m for m in stub.body if isinstance(m, ast.FunctionDef) and m.name != "__new__"}
        native = getattr(_native, name)
        assert public(native) == methods.keys(), name
        for method, found in methods.items():
            if not any(isinstance(d, ast.Name) and d.id == "property" for d in found.decorator_list):
                had = [p for p in inspect.signature(getattr(native, method)).parameters if p != "self"]
                assert had == arguments(found), f"{name}.{method}"


def test_everything_public_is_documented():
    for name in lightgraph.__all__:
        assert inspect.getdoc(getattr(lightgraph, name)), name
