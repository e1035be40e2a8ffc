"""Compares an image with a reference."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._camlux import Comparison, Frame, Image, compare_arrays
from ._fields import knows_its_arguments
from ._layers import surface
from .dataset import DatasetFrame
from .errors import ArgumentError

#: The layers whose noise is that of the layer `stderr`.
_NOISY = ("indirect", "radiance")

_LAYERED = (Frame, Image, DatasetFrame)


@knows_its_arguments
def compare(
    image: Frame | Image | DatasetFrame | npt.ArrayLike,
    reference: Frame | Image | DatasetFrame | npt.ArrayLike,
    layer: str = "radiance",
) -> Comparison:
    """Compares a layer of two images, or two arrays of one shape, (height, width) or (height, width, channels).

    For images with layers, pixels without a surface do not count, nor do pixels on edges if the reference has the layer `edge`. If the
    reference has the layer `stderr`, its noise is subtracted. For arrays, every value counts.

    Raises ArgumentError, a ValueError, if the shapes differ; LayerError, a KeyError, if a layer is missing.
    """
    standard_error = edges = None
    if isinstance(reference, _LAYERED):
        t = _array(reference[layer])
        valid = surface(reference)
        if "edge" in reference:
            edges = np.asarray(reference["edge"] > 0).reshape(-1)
        if "stderr" in reference and layer in _NOISY:
            standard_error = _array(reference["stderr"])
    else:
        t = _array(reference)
        valid = np.ones(t.shape[:2], bool)
    x = _array(image[layer] if isinstance(image, _LAYERED) else image)
    if x.shape != t.shape or x.ndim not in (2, 3):
        raise ArgumentError(f"the image has the shape {x.shape} and the reference {t.shape}; give both the same shape, (height, width[, channels])")
    channels = x.shape[2] if x.ndim == 3 else 1
    return compare_arrays(x, t, channels, valid.reshape(-1), edges, standard_error)


def _array(values: Any) -> npt.NDArray[np.float32]:
    return np.ascontiguousarray(values, np.float32)
