"""The program: `camlux`, or `python -m camlux`."""

import os
import signal
import sys

from ._camlux import run_program


def main() -> int:
    # A command without a handler of its own ends at once.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_program(["camlux", *sys.argv[1:]])


def main_of_job(caller: int) -> int:
    """The program for `run_job`: on Linux it ends as by Control-C if the calling process is killed."""
    if sys.platform == "linux":
        # Imported here, because only jobs need it.
        import ctypes

        set_parent_death_signal = 1
        ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGINT)
        # The caller may have been killed before.
        if os.getppid() != caller:
            return 1
    return main()


if __name__ == "__main__":
    sys.exit(main())
