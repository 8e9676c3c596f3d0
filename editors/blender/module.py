"""Finds the Python module `lightgraph`.

As an extension Blender installs the wheel that the add-on carries. Before 4.2 it is unpacked here, beside the add-on.
"""

from __future__ import annotations

import importlib.util
import sys
import zipfile
from pathlib import Path


def find() -> None:
    """Makes `import lightgraph` work.

    Raises `ImportError` where there is neither the module nor its wheel.
    """
    if importlib.util.find_spec("lightgraph") is not None:
        return
    folder = Path(__file__).parent
    wheel = next(iter(sorted((folder / "wheels").glob("lightgraph-*.whl"))), None)
    if wheel is None:
        raise ImportError("the add-on carries no wheel of lightgraph: `make blender` packs one that does")
    # By the wheel's name and time, so that another one is unpacked anew.
    unpacked = folder / "unpacked" / f"{wheel.stem}-{wheel.stat().st_mtime_ns}"
    if not unpacked.is_dir():
        made = unpacked.with_suffix(".part")
        with zipfile.ZipFile(wheel) as file:
            file.extractall(made)
        made.rename(unpacked)
    sys.path.append(str(unpacked))
