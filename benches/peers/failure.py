"""What ends a run, in one line for its reader."""


class Failure(Exception):
    """Something is missing or wrong. The text says what, where, and how to mend it."""


class Unsupported(Exception):
    """A scene that the peers have no part in. The text says why."""
