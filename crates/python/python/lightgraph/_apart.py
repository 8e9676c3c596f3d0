"""Commands in a process of their own: they can be interrupted, and what else the caller does tells on no time."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path


def run(words: list[str]) -> str:
    """Runs a command and returns what it printed. What it finds wrong is raised here; warnings and the progress go to
    the error stream."""
    package = Path(__file__).parent
    paths = [str(package.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    with tempfile.TemporaryDirectory() as folder:
        fault = Path(folder, "fault")
        done = subprocess.run(
            [sys.executable, "-c", "from lightgraph._apart import _main; _main()", str(fault), *words],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
            stdout=subprocess.PIPE,
            encoding="utf-8",
            check=False,
        )
        if fault.exists():
            raise pickle.loads(fault.read_bytes())
    if done.returncode:
        raise RuntimeError(f"`lightgraph {words[0]}` ended with code {done.returncode}; the error stream says why")
    return done.stdout


def _main() -> None:
    import signal

    from . import _native

    signal.signal(signal.SIGINT, signal.SIG_DFL)
    fault, *words = sys.argv[1:]
    try:
        sys.exit(_native.attempt(words))
    except Exception as error:
        Path(fault).write_bytes(pickle.dumps(error))
        sys.exit(1)
