"""What all classes of a scene have: they refuse fields that they do not have, and compare by value. Functions refuse arguments likewise."""

from __future__ import annotations

import dataclasses
import functools
import operator
import sys
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

import numpy as np

from .errors import ArgumentTypeError, FieldError

_Function = TypeVar("_Function", bound=Callable[..., Any])

#: What other programs call a field or an argument.
_SYNONYMS = {
    "albedo": "kd",
    "base_color": "kd",
    "color": "kd",
    "colour": "kd",
    "diffuse": "kd",
    "reflectance": "kd",
    "specular": "ks",
    "exponent": "shininess",
    "metallic": "microfacets",
    "roughness": "microfacets",
    "flux": "power_w",
    "intensity": "power_w",
    "eye": "position_m",
    "origin": "position_m",
    "target": "look_at_m",
    "size": "resolution_px",
    "vertices": "positions_m",
    "faces": "triangles",
    "indices": "triangles",
    "uv": "texcoords",
    "uvs": "texcoords",
    "image": "pixels",
}


class Fields:
    """The base of the dataclasses of a scene. Subclasses have slots, so that a misspelt field is an error."""

    __slots__ = ("__weakref__",)

    # Type checkers would accept any name if they saw these methods. They check names by themselves.
    if not TYPE_CHECKING:

        def __new__(cls, *_arguments, **fields):
            _check(cls.__name__, fields, cls.__match_args__)
            return object.__new__(cls)

        def __setattr__(self, name, value):
            try:
                object.__setattr__(self, name, value)
            except AttributeError:
                known = [field.name for field in dataclasses.fields(self)]
                if name in known:
                    raise
                problem = f"{type(self).__name__} has no field {name}"
                raise FieldError(f"{problem}; {_hint(name, known)}") from None

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Fields) or type(self) is not type(other):
            return NotImplemented
        names = (field.name for field in dataclasses.fields(self))  # type: ignore[arg-type]
        return all(_is_same(getattr(self, name), getattr(other, name)) for name in names)


def knows_its_arguments(function: _Function) -> _Function:
    """Lets a function refuse arguments that it does not have, and name the nearest."""
    code = function.__code__
    known = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    name = function.__qualname__.removesuffix(".__init__")

    @functools.wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        _check(name, named, known)
        return function(*arguments, **named)

    return call  # type: ignore[return-value]


def refuse_arguments(function: str, names: Iterable[str]) -> NoReturn:
    """Does so for a function of the compiled module, which has got arguments of other names."""
    import inspect

    found = operator.attrgetter(function)(sys.modules[__package__])
    _check(function, names, list(inspect.signature(found).parameters))
    raise AssertionError("all arguments are known")


def _check(function: str, names: Iterable[str], known: Iterable[str]) -> None:
    known = [name for name in known if name != "self"]
    for name in names:
        if name not in known:
            raise ArgumentTypeError(f"{function} has no argument {name}; {_hint(name, known)}")


def _hint(name: str, known: list[str]) -> str:
    # Imported here, because it is rarely needed.
    import difflib

    words = {word: field for word, field in _SYNONYMS.items() if field in known}
    words |= {field: field for field in known}
    longer = [field for field in known if field.startswith(name) or field.endswith(f"_{name}")]
    near = longer or difflib.get_close_matches(name.lower(), words, n=1)
    return f"did you mean {words[near[0]]}?" if near else f"it has {', '.join(known)}"


def _is_same(a: Any, b: Any) -> bool:
    """Whether two values of a field are equal. A tuple, a list and an array of the same numbers are."""
    if a is b:
        return True
    if _is_list(a) and _is_list(b):
        return len(a) == len(b) and all(map(_is_same, a, b))
    return not (_is_list(a) or _is_list(b)) and bool(a == b)


def _is_list(value: Any) -> bool:
    return isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)
