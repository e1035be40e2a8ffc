"""What frames, image files and frames of data sets do alike, as mappings from the names of layers to arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias, Union

import numpy as np
import numpy.typing as npt

from ._camlux import Frame, Image, preview

if TYPE_CHECKING:
    from .dataset import DatasetFrame

Layered: TypeAlias = Union[Frame, Image, "DatasetFrame"]


class Points(NamedTuple):
    """The surface points that an image shows, row by row from the top; pixels without a surface are left out.

    positions_m: (n, 3), float32, in the world, metres.
    colors: (n, 3), float32, 0 to 1: the radiance in sRGB, as `save_png` shows it.
    """

    positions_m: npt.NDArray[np.float32]
    colors: npt.NDArray[np.float32]


def surface(image: Layered) -> npt.NDArray[np.bool_]:
    """Which pixels show a surface: (height, width)."""
    if "id.instance" in image:
        return np.asarray(image["id.instance"] > 0)
    if "depth" in image:
        return np.asarray(np.isfinite(image["depth"]))
    width, height = image.resolution_px
    return np.ones((height, width), bool)


def points(image: Layered) -> Points:
    positions_m, colors = image["P"], preview(np.ascontiguousarray(image["radiance"]))
    seen = surface(image) & np.isfinite(positions_m).all(axis=-1)
    return Points(positions_m[seen].astype(np.float32), (colors[seen] / 255).astype(np.float32))


def png(image: Layered) -> bytes | None:
    """The radiance as a PNG file."""
    import struct
    import zlib

    radiance = image.get("radiance")
    if radiance is None:
        return None
    pixels = preview(np.ascontiguousarray(radiance, np.float32))
    height, width, _ = pixels.shape
    # Each row begins with the number of its filter: 0, none.
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    pixel_data = zlib.compress(rows.tobytes(), 6)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixel_data) + chunk(b"IEND", b"")


def text(image: Layered) -> str:
    """Size, layers with shape and unit, and errors."""
    rows = _rows(image)
    wide = [max(map(len, column)) for column in zip(*rows)] if rows else []
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, wide)).rstrip() for row in rows]
    lines += [f"{name}: {value}" for name, value in _errors(image)]
    width, height = image.resolution_px
    return f"<camlux.{type(image).__name__} {width} x {height}\n  " + "\n  ".join(lines) + ">"


def html(image: Layered) -> str:
    """The picture, and a table of the layers and errors."""
    import base64
    import html as markup

    picture = png(image)
    shown = ""
    if picture is not None:
        data = base64.b64encode(picture).decode("ascii")
        shown = f'<img src="data:image/png;base64,{data}" alt="radiance" style="image-rendering: pixelated">'

    def row(cells: tuple[str, ...], tag: str = "td") -> str:
        return "<tr>" + "".join(f'<{tag} style="text-align: left">{markup.escape(cell)}</{tag}>' for cell in cells) + "</tr>"

    layers = row(("layer", "shape", "type", "unit"), "th") + "".join(map(row, _rows(image)))
    errors = "".join(f"<div>{markup.escape(name)}: {markup.escape(value)}</div>" for name, value in _errors(image))
    return f"<div>{shown}<table>{layers}</table>{errors}</div>"


def _rows(image: Layered) -> list[tuple[str, ...]]:
    units = image.units
    return [(name, str(array.shape), str(array.dtype), units.get(name, "")) for name, array in image.items()]


def _errors(image: Layered) -> list[tuple[str, str]]:
    """The estimated errors that the image has, and what they are of."""
    known = [
        ("error of the indirect light", "estimated_error"),
        ("below, with 95 % confidence", "estimated_error_upper"),
        ("error of the range", "estimated_range_error_mm"),
        ("below, with 95 % confidence", "estimated_range_error_upper_mm"),
        ("error of the area lights", "estimated_area_light_error"),
        ("error of the interpolation", "estimated_interpolation_error"),
    ]

    def value_of(key: str) -> float | str | None:
        return getattr(image.stats, key) if isinstance(image, Frame) else image.attributes.get(f"camlux.{key}")

    def shown(key: str, value: float) -> str:
        return f"{value:.3g} mm" if key.endswith("_mm") else f"{100 * value:.3g} %"

    return [(name, shown(key, float(value))) for name, key in known if (value := value_of(key)) is not None]
