"""Exceptions that end a run. Their text is one line for the user."""


class Failure(Exception):
    """Something is missing or wrong. The text states what, where, and how to mend it."""


class Unsupported(Exception):
    """The peers cannot render the scene. The text states why."""
