"""The program: `camlux`, or `python -m camlux`."""

import signal
import sys

from ._camlux import run_program


def main() -> int:
    # A command without a handler of its own ends at once.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_program(["camlux", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
