"""The add-on, under the name that Blender would import it by, without being installed."""

import importlib.util
import pathlib
import sys

ADDON = pathlib.Path(__file__).resolve().parents[1]


def load():
    name = "lightgraph_blender"
    if name not in sys.modules:
        places = [str(ADDON)]
        spec = importlib.util.spec_from_file_location(name, ADDON / "__init__.py", submodule_search_locations=places)
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
        module.register()
    return sys.modules[name]
