"""The `lightgraph` command, as it comes with the package: `python -m lightgraph`."""

import signal
import sys

from . import _native


def main() -> int:
    # Python would remember an interrupt until the command is over.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.command(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
