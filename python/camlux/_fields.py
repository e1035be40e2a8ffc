"""What all classes of a scene have: they refuse fields that they do not have, and compare by value."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import FieldError


class Fields:
    """The base of the dataclasses of a scene. Subclasses have slots, so that a misspelt field is an error."""

    __slots__ = ("__weakref__",)

    # Type checkers would accept any name if they saw this method. They check names by themselves.
    if not TYPE_CHECKING:

        def __setattr__(self, name, value):
            try:
                object.__setattr__(self, name, value)
            except AttributeError:
                if name in {field.name for field in dataclasses.fields(self)}:
                    raise
                raise FieldError(_unknown(self, name)) from None

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Fields) or type(self) is not type(other):
            return NotImplemented
        names = (field.name for field in dataclasses.fields(self))  # type: ignore[arg-type]
        return all(_is_same(getattr(self, name), getattr(other, name)) for name in names)


def _unknown(part: Any, name: str) -> str:
    # Imported here, because it is rarely needed.
    import difflib

    known = [field.name for field in dataclasses.fields(part)]
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(known)}"
    return f"{type(part).__name__} has no field {name}; {hint}"


def _is_same(a: Any, b: Any) -> bool:
    """Whether two values of a field are equal. A tuple, a list and an array of the same numbers are."""
    if a is b:
        return True
    if _is_list(a) and _is_list(b):
        return len(a) == len(b) and all(map(_is_same, a, b))
    return not (_is_list(a) or _is_list(b)) and bool(a == b)


def _is_list(value: Any) -> bool:
    return isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)
